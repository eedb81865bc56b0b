import {
  type AnimationClip,
  type Camera,
  FileLoader,
  Group,
  LoaderUtils,
  type Material,
  Mesh,
  type Object3D,
  type Texture,
} from 'three';
import { type GLTF, GLTFLoader, type GLTFReference } from 'three/addons/loaders/GLTFLoader.js';
import { withoutCharts } from './charted.js';
import { blankPadding, completeNodes } from './exported.js';
import { SpecularGlossiness } from './glossiness.js';
import { isPunctualLight, type PunctualLight } from './lights.js';
import { copyParts } from './materials.js';
import { materialsOf } from './patch.js';

/** What a web page begins with, <. */
const MARKUP = 0x3c;

/** An animation and the object whose descendants it moves. */
export interface Animation {
  readonly clip: AnimationClip;
  readonly root: Object3D;
}

/**
 * What a scene holds, by the numbers that edits know it by: indices of the glTF file; nodes, meshes,
 * materials and animations of files that are added later follow on.
 */
export class Content {
  readonly #object = new Map<number, Object3D>();
  readonly #node = new WeakMap<Object3D, number>();
  /** Which primitive of its file's mesh an object shows. */
  readonly #primitive = new WeakMap<Object3D, number>();
  readonly #materials = new Map<number, Material[]>();
  readonly #animations = new Map<number, readonly Animation[]>();
  readonly cameras: Camera[] = [];

  /** Takes in a file, or another copy of one, whose first node, material and animation have these numbers. */
  add(gltf: GLTF, first: { node: number; material: number; animation: number }): void {
    completeNodes(gltf);
    for (const [thing, numbers] of associationsOf(gltf)) {
      const { nodes, materials } = numbers ?? {};
      if (nodes !== undefined && 'isObject3D' in thing) this.setNode(first.node + nodes, thing);
      if (materials !== undefined && 'isMaterial' in thing)
        this.#addMaterial(first.material + materials, thing);
    }
    this.addMeshes(gltf, gltf.scene, first.material);
    gltf.animations.forEach((clip, i) => {
      const copies = this.#animations.get(first.animation + i) ?? [];
      this.#animations.set(first.animation + i, [...copies, { clip, root: gltf.scene }]);
    });
    this.cameras.push(...gltf.cameras);
  }

  /**
   * Takes in the meshes of a file below an object: which primitives they show, and their materials. Those
   * that no other mesh shows are among these, and glTF's default material, which comes after the file's own.
   */
  addMeshes(gltf: GLTF, below: Object3D, first: number): void {
    const { meshes = [], materials = [] } = gltf.parser.json as MeshesAndMaterials;
    const associations = associationsOf(gltf);
    below.traverse((object) => {
      const { meshes: mesh, primitives: index } = associations.get(object) ?? {};
      const primitive =
        mesh === undefined || index === undefined ? undefined : meshes[mesh]?.primitives[index];
      if (index === undefined || !primitive) return;
      this.#primitive.set(object, index);
      const number = first + (primitive.material ?? materials.length);
      for (const material of materialsOf(object)) this.#addMaterial(number, material);
    });
  }

  /** Forgets materials and animations from these numbers on; returns them, as keys of values have them. */
  forgetFrom(first: { material: number; animation: number }): string[] {
    const materials = [...this.#materials.keys()].filter((number) => number >= first.material);
    const animations = [...this.#animations.keys()].filter((number) => number >= first.animation);
    for (const number of materials) this.#materials.delete(number);
    for (const number of animations) this.#animations.delete(number);
    return [
      ...materials.map((number) => `material/${number}`),
      ...animations.map((number) => `animation/${number}`),
    ];
  }

  /** GLTFLoader makes variants of a material, say for meshes with vertex colours. */
  #addMaterial(number: number, material: Material): void {
    const variants = this.#materials.get(number) ?? [];
    if (variants.includes(material)) return;
    // One that comes late looks as edits have made the others: that of a file's second copy.
    if (variants[0]) copyParts(variants[0], material);
    this.#materials.set(number, [...variants, material]);
  }

  setNode(number: number, object: Object3D): void {
    this.#object.set(number, object);
    this.#node.set(object, number);
  }

  deleteNode(number: number): void {
    const object = this.#object.get(number);
    if (object) this.#node.delete(object);
    this.#object.delete(number);
  }

  object(node: number): Object3D | undefined {
    return this.#object.get(node);
  }

  /** The node that an object is, or the nearest one above it. */
  nodeOf(object: Object3D): number | undefined {
    for (let at: Object3D | null = object; at; at = at.parent) {
      const node = this.#node.get(at);
      if (node !== undefined) return node;
    }
    return undefined;
  }

  /** The object that stands for the node that an object is, or belongs to: what edits of it move. */
  carrier(object: Object3D): Object3D {
    const node = this.nodeOf(object);
    return (node === undefined ? undefined : this.object(node)) ?? object;
  }

  /** The numbers of an object's node and of all nodes below it. */
  nodesBelow(object: Object3D): number[] {
    const nodes: number[] = [];
    object.traverse((below) => {
      const node = this.#node.get(below);
      if (node !== undefined) nodes.push(node);
    });
    return nodes;
  }

  /** The light of a node: the node's object itself, or a part of it that is no node of its own. */
  light(node: number): PunctualLight | undefined {
    const object = this.#object.get(node);
    if (object === undefined || isPunctualLight(object)) return object;
    return object.children.find(
      (child): child is PunctualLight => isPunctualLight(child) && !this.#node.has(child),
    );
  }

  /**
   * The mesh that shows a primitive of a node. In a scene of the program's own nobody has numbered them:
   * there the node's meshes count in their order.
   */
  mesh(node: number, primitive: number): Mesh | undefined {
    const object = this.#object.get(node);
    const meshes = object ? this.#meshesOf(object) : [];
    const isNumbered = meshes.some((mesh) => this.#primitive.has(mesh));
    return isNumbered ? meshes.find((mesh) => this.#primitive.get(mesh) === primitive) : meshes[primitive];
  }

  /** A node's own meshes, without those of nodes below it. */
  #meshesOf(object: Object3D): Mesh[] {
    const below = object.children.filter((child) => !this.#node.has(child));
    return [...(isMesh(object) ? [object] : []), ...below.flatMap((child) => this.#meshesOf(child))];
  }

  materials(number: number): readonly Material[] {
    return this.#materials.get(number) ?? [];
  }

  /** Animations by number; several where a file has been added several times. */
  get animations(): ReadonlyMap<number, readonly Animation[]> {
    return this.#animations;
  }
}

interface MeshesAndMaterials {
  readonly meshes?: readonly {
    readonly primitives: readonly { readonly material?: number }[];
    readonly weights?: readonly number[];
  }[];
  readonly materials?: readonly unknown[];
}

/** GLTFLoader leaves variants of the default material in without numbers, whatever its types say. */
function associationsOf({
  parser,
}: GLTF): ReadonlyMap<Object3D | Material | Texture, GLTFReference | undefined> {
  return parser.associations;
}

/**
 * Loads a glTF file; `progress` gets bytes so far and, where known, of all.
 * @throws Error, with the address and what was answered, when there is none
 */
export async function loadGltf(
  url: string,
  progress?: (loaded: number, total: number | undefined) => void,
): Promise<GLTF> {
  const file = await loadFile(url, progress);
  const folder = LoaderUtils.extractUrlBase(url);
  const loader = new GLTFLoader().register((parser) => new SpecularGlossiness(parser));
  const gltf = await loader.parseAsync(blankPadding(file), folder);
  if (gltf.scenes.length > 1) await nameNodes(gltf);
  // Matrices decompose into what edits set.
  gltf.scene.traverse((object) => void (object.matrixAutoUpdate = true));
  return gltf;
}

async function loadFile(url: string, progress: Parameters<typeof loadGltf>[1]): Promise<ArrayBuffer> {
  const file = await new FileLoader()
    .setResponseType('arraybuffer')
    .loadAsync(url, (event) => progress?.(event.loaded, event.lengthComputable ? event.total : undefined))
    .catch((error: Error & { response?: Response }) => {
      const status = error.response?.status;
      const what = status === 404 ? 'is missing' : 'cannot be read';
      throw new Error(`${url} ${what} (${status ? `HTTP ${status}` : error.message})`, { cause: error });
    });
  // Development servers answer with their page where a file is missing; glTF begins with { or glTF.
  if (new Uint8Array(file as ArrayBuffer)[0] === MARKUP)
    throw new Error(`${url} is missing (a web page was answered)`);
  return file as ArrayBuffer;
}

/** Of a file with several scenes GLTFLoader forgets which object is which node; its parser still knows. */
async function nameNodes({ parser }: GLTF): Promise<void> {
  const { nodes = [] } = parser.json as { nodes?: readonly unknown[] };
  for (const index of nodes.keys()) {
    const object = (await parser.getDependency('node', index)) as Object3D;
    parser.associations.set(object, { ...parser.associations.get(object), nodes: index });
  }
}

/**
 * A glTF mesh as an instance of its own shows it: without the nodes that hang below it and the skeleton
 * of the node that it was made for, morphed by the mesh's own weights.
 */
export async function instantiateMesh(gltf: GLTF, mesh: number): Promise<Object3D> {
  const { primitives, weights = [] } = (gltf.parser.json as MeshesAndMaterials).meshes![mesh];
  const original = (await gltf.parser.getDependency('mesh', mesh)) as Object3D;
  const parts = primitives.length === 1 ? [original] : original.children.slice(0, primitives.length);
  const copies = parts.filter(isMesh).map((part) => {
    // The one that there is may have lumels where it stands.
    const copy = new Mesh(withoutCharts(part.geometry), part.material);
    copy.morphTargetInfluences?.forEach((_, i, all) => (all[i] = weights[i] ?? 0));
    // As GLTFLoader does with its copies.
    gltf.parser.associations.set(copy, { meshes: mesh, primitives: parts.indexOf(part) });
    return copy;
  });
  return copies.length === 1 ? copies[0] : new Group().add(...copies);
}

function isMesh(object: Object3D): object is Mesh {
  return (object as Partial<Mesh>).isMesh === true;
}
