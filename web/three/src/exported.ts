import {
  type BufferAttribute,
  Float32BufferAttribute,
  type InterleavedBufferAttribute,
  type Mesh,
  type Object3D,
  Uint16BufferAttribute,
} from 'three';
import type { GLTF } from 'three/addons/loaders/GLTFLoader.js';

/** What the server reads of glTF files and GLTFLoader leaves out or forgets. */
interface Nodes {
  readonly nodes?: readonly {
    readonly mesh?: number;
    readonly extensions?: {
      readonly KHR_node_visibility?: { readonly visible?: boolean };
      readonly EXT_mesh_gpu_instancing?: object;
    };
  }[];
}

/** Objects that a file hides, whoever shows or hides others. */
const hidden = new WeakSet<Object3D>();

/** Whether the file of an object hides it or what it hangs below. */
export function isHidden(object: Object3D): boolean {
  for (let at: Object3D | null = object; at; at = at.parent) if (hidden.has(at)) return true;
  return false;
}

/** Brings what GLTFLoader made of a file to what the file says. */
export function completeNodes({ parser }: GLTF): void {
  const { nodes = [] } = parser.json as Nodes;
  // Associations grow meanwhile.
  for (const [object, numbers] of [...parser.associations]) {
    const node = numbers?.nodes === undefined ? undefined : nodes[numbers.nodes];
    if (node === undefined || !('isObject3D' in object)) continue;
    if (node.extensions?.KHR_node_visibility?.visible === false) {
      object.visible = false;
      hidden.add(object);
    }
    const { mesh: meshes, extensions } = node;
    if (meshes === undefined || !extensions?.EXT_mesh_gpu_instancing) continue;
    const isOwn = (part: Object3D) => parser.associations.get(part)?.nodes === undefined;
    instancedParts(object, isOwn).forEach((part, primitives) => {
      parser.associations.set(part, { ...parser.associations.get(part), meshes, primitives });
    });
  }
  for (const object of parser.associations.keys()) {
    if ('isSkinnedMesh' in object) keepStrongest(object as unknown as Mesh);
  }
}

/** The parts of a node's instanced mesh, which GLTFLoader makes anew and forgets to number. */
function instancedParts(node: Object3D, isOwn: (object: Object3D) => boolean): Object3D[] {
  if ('isInstancedMesh' in node) return [node];
  return node.children.filter(isOwn).flatMap((child) => instancedParts(child, isOwn));
}

type Attribute = BufferAttribute | InterleavedBufferAttribute;

/**
 * Of more than four joints a vertex, which is what three.js skins by, the four with most weight. The
 * server's light is that of all.
 */
function keepStrongest({ geometry }: Mesh): void {
  const { attributes } = geometry;
  const sets: (readonly [joints: Attribute, weights: Attribute])[] = [];
  for (let set = 0; ; set++) {
    const joints = attributes[set === 0 ? 'skinIndex' : `joints_${set}`];
    const weights = attributes[set === 0 ? 'skinWeight' : `weights_${set}`];
    if (!joints || !weights) break;
    sets.push([joints, weights]);
  }
  if (sets.length < 2) return;
  const { count } = sets[0][0];
  const skinIndex = new Uint16BufferAttribute(new Uint16Array(4 * count), 4);
  const skinWeight = new Float32BufferAttribute(new Float32Array(4 * count), 4);
  for (let vertex = 0; vertex < count; vertex++) {
    const influences = sets.flatMap(([joints, weights]) =>
      [0, 1, 2, 3].map((i) => [joints.getComponent(vertex, i), weights.getComponent(vertex, i)] as const),
    );
    const strongest = influences.sort((a, b) => b[1] - a[1]).slice(0, 4);
    const sum = strongest.reduce((total, [, weight]) => total + weight, 0) || 1;
    strongest.forEach(([joint, weight], i) => {
      skinIndex.setComponent(vertex, i, joint);
      skinWeight.setComponent(vertex, i, weight / sum);
    });
  }
  geometry.setAttribute('skinIndex', skinIndex).setAttribute('skinWeight', skinWeight);
  for (let set = 1; set < sets.length; set++) {
    geometry.deleteAttribute(`joints_${set}`).deleteAttribute(`weights_${set}`);
  }
}

const JSON_CHUNK = 0x4e4f534a;
const BLANKS: ReadonlySet<number> = new Set([0, 9, 10, 13, 32]);

/** Makes blanks of the NULs that some programs put after a file's JSON, for parsers take none. */
export function blankPadding(file: ArrayBuffer): ArrayBuffer {
  const view = new DataView(file);
  const isBinary = file.byteLength >= 20 && view.getUint32(16, true) === JSON_CHUNK;
  const [from, to] = isBinary ? [20, 20 + view.getUint32(12, true)] : [0, file.byteLength];
  const text = new Uint8Array(file, from, Math.max(0, Math.min(to, file.byteLength) - from));
  for (let at = text.length - 1; at >= 0 && BLANKS.has(text[at]); at--) text[at] = 32;
  return file;
}
