import { type Object3D, PropertyBinding } from 'three';
import { readGltfJson } from './gltf-json.js';

/** A node of a glTF file that has a name. */
export interface NamedNode {
  readonly node: number;
  readonly name: string;
}

export interface Matches {
  readonly pairs: readonly (readonly [object: Object3D, node: number])[];
  /** Names that more objects or nodes have than can be told apart. */
  readonly ambiguous: readonly string[];
}

interface Tree {
  readonly scene?: number;
  readonly scenes?: readonly { readonly nodes?: readonly number[] }[];
  readonly nodes?: readonly { readonly name?: string; readonly children?: readonly number[] }[];
}

/** The named nodes of a glTF file's scene, each before those below it. Only the file's JSON is read. */
export async function readNames(url: string): Promise<readonly NamedNode[]> {
  return namesOf((await readGltfJson(url)) as Tree);
}

/** Most that a node's name may have in edits, bytes of UTF-8. */
const NAME_BYTES = 64;

/** What of an object's name may be the name of a node that an edit adds. */
export function nodeName({ name }: Object3D): string | undefined {
  // Control characters, and halves of surrogate pairs.
  const kept = name.replace(/[\p{Cc}\p{Cs}]/gu, '');
  const { read } = new TextEncoder().encodeInto(kept, new Uint8Array(NAME_BYTES));
  return kept.slice(0, read) || undefined;
}

export function namesOf({ scene = 0, scenes = [], nodes = [] }: Tree): readonly NamedNode[] {
  const named: NamedNode[] = [];
  const seen = new Set<number>();
  const visit = (node: number): void => {
    if (seen.has(node)) return;
    seen.add(node);
    const { name, children = [] } = nodes[node] ?? {};
    if (name) named.push({ node, name });
    children.forEach(visit);
  };
  scenes[scene]?.nodes?.forEach(visit);
  return named;
}

/**
 * Finds the objects that stand for a file's nodes. Programs give them the nodes' names, as GLTFExporter
 * keeps them. GLTFLoader changes names to fit its animations and to be unique, and keeps the file's in
 * `userData.name`. Several of one name are told apart by their order, where there are as many objects as
 * nodes. Objects that `isOther` tells are passed over.
 */
export function matchNames(
  nodes: readonly NamedNode[],
  scene: Object3D,
  isOther: (object: Object3D) => boolean = () => false,
): Matches {
  const [own, original] = [new Map<string, Object3D[]>(), new Map<string, Object3D[]>()];
  scene.traverse((object) => {
    if (isOther(object)) return;
    const { name } = object.userData as { name?: unknown };
    if (typeof name === 'string') add(original, name, object);
    if (object.name) add(own, object.name, object);
  });
  const numbers = new Map<string, number[]>();
  for (const { name, node } of nodes) add(numbers, name, node);

  const pairs: [Object3D, number][] = [];
  const ambiguous: string[] = [];
  const taken = new Set<Object3D>();
  for (const [name, ofName] of numbers) {
    const candidates = [
      original.get(name),
      own.get(name),
      own.get(PropertyBinding.sanitizeNodeName(name)),
    ].map((objects = []) => objects.filter((object) => !taken.has(object)));
    const found = candidates.find(({ length }) => length === ofName.length);
    found?.forEach((object, i) => {
      taken.add(object);
      pairs.push([object, ofName[i]]);
    });
    if (!found && candidates.some(({ length }) => length > 0)) ambiguous.push(name);
  }
  return { pairs, ambiguous };
}

function add<T>(lists: Map<string, T[]>, name: string, item: T): void {
  const list = lists.get(name);
  if (list) list.push(item);
  else lists.set(name, [item]);
}
