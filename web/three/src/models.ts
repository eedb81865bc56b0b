import type { InstanceSource } from '@lumencast/client';
import type { Object3D } from 'three';
import type { GLTF } from 'three/addons/loaders/GLTFLoader.js';
import { type Content, instantiateMesh, loadGltf } from './content.js';

/** First numbers of a file's things. */
interface First {
  readonly mesh: number;
  readonly material: number;
  readonly animation: number;
}

/** Name of the scene's own file; no added file has an empty one. */
const ROOT = '';

/**
 * The glTF files of a scene: its own, and those that edits add. The first time a file is added its
 * meshes, materials and animations take the next numbers, as on the server; so files are read one
 * after the other, in the order of the edits.
 */
export class Models {
  readonly #first = new Map<string, First>();
  readonly #files: { readonly gltf: GLTF; readonly first: First }[] = [];
  #next: First = { mesh: 0, material: 0, animation: 0 };
  /** What the first added file gets. */
  readonly #afterRoot: First;
  #queue: Promise<unknown> = Promise.resolve();
  /** Grows with every restart: what was asked for before is no longer wanted. */
  #turn = 0;

  constructor(
    private readonly content: Content,
    private readonly urlOf: (file: string) => string,
    root: GLTF | undefined,
  ) {
    if (root) this.#add(root, ROOT, 0);
    this.#afterRoot = this.#next;
  }

  /** Forgets all added files, as their edits will come again; returns which things went with them. */
  restart(): string[] {
    this.#turn++;
    for (const name of this.#first.keys()) if (name !== ROOT) this.#first.delete(name);
    this.#files.length = this.#first.size;
    this.#next = this.#afterRoot;
    return this.content.forgetFrom(this.#afterRoot);
  }

  /** What an instance shows, to be hung below its node; `undefined` after a restart. */
  instantiate(source: InstanceSource, node: number): Promise<Object3D | undefined> {
    const turn = this.#turn;
    const wanted = () => turn === this.#turn;
    const made = this.#queue.then(() => {
      if (!wanted()) return undefined;
      return 'mesh' in source ? this.#mesh(source.mesh) : this.#file(source.file, node, wanted);
    });
    this.#queue = made.catch(() => {});
    return made;
  }

  async #mesh(mesh: number): Promise<Object3D> {
    const file = this.#files.findLast(({ first }) => first.mesh <= mesh);
    if (!file || mesh >= this.#next.mesh) throw new Error(`mesh ${mesh} is not known here`);
    const object = await instantiateMesh(file.gltf, mesh - file.first.mesh);
    this.content.addMeshes(file.gltf, object, file.first.material);
    return object;
  }

  async #file(file: string, node: number, wanted: () => boolean): Promise<Object3D | undefined> {
    const gltf = await loadGltf(this.urlOf(file));
    if (!wanted()) return undefined;
    // The instance's own node comes first.
    this.#add(gltf, file, node + 1);
    return gltf.scene;
  }

  #add(gltf: GLTF, name: string, node: number): void {
    let first = this.#first.get(name);
    if (first === undefined) {
      first = this.#next;
      this.#first.set(name, first);
      this.#files.push({ gltf, first });
      const { meshes = [], materials = [] } = gltf.parser.json as Counted;
      this.#next = {
        mesh: first.mesh + meshes.length,
        // The material of primitives without one has a number too, the last.
        material: first.material + materials.length + 1,
        animation: first.animation + gltf.animations.length,
      };
    }
    this.content.add(gltf, { ...first, node });
  }
}

interface Counted {
  readonly meshes?: readonly unknown[];
  readonly materials?: readonly unknown[];
}
