import type {
  AddedNode,
  Edit,
  EditOptions,
  Environment,
  MaterialChange,
  Playback,
  Session,
  Transform,
} from '@lumencast/client';
import { Group, type Object3D, type Scene } from 'three';
import type { GLTF } from 'three/addons/loaders/GLTFLoader.js';
import { Additions } from './additions.js';
import { Animations } from './animations.js';
import { Content } from './content.js';
import { showEnvironment } from './environment.js';
import {
  canBecome,
  createLight,
  describeLight,
  isPunctualLight,
  lightSpec,
  type PunctualLight,
  setLight,
} from './lights.js';
import { lacksPhysical, materialPart, setMaterialPart } from './materials.js';
import { Models } from './models.js';
import { nodeName } from './names.js';
import { LIGHT_PARTS, Reconciler, type Values } from './reconcile.js';

/** What a replica tells those who draw the scene. */
export interface ReplicaEvents {
  /** An object came into the scene (shadows, shaders). */
  added(object: Object3D): void;
  removed(object: Object3D): void;
  warning(message: string): void;
}

/**
 * A three.js scene that follows a server's: applies snapshots and accepted edits in the server's
 * order, shows own edits at once, and plays animations at the server's time.
 */
export class Replica implements Values {
  readonly content = new Content();
  /** Grows with every change of the scene that was made here. */
  revision = 0;

  readonly #root: Object3D;
  readonly #models: Models;
  readonly #animations: Animations;
  readonly #reconciler = new Reconciler(this);
  /** Nodes that edits added, with their objects; forgotten when a snapshot starts anew. */
  readonly #added = new Map<number, Object3D>();
  /** Objects of the file that edits removed, and where they were. */
  readonly #removed = new Map<Object3D, Object3D>();
  /** The program's own objects that became nodes; they stay in its scene whatever the server says. */
  readonly #adopted = new Map<number, Object3D>();
  readonly #additions: Additions;
  /** Materials of which it was said that they cannot show what edits set. */
  readonly #notPhysical = new Set<number>();
  #environment: Environment | undefined;
  #environmentTurn = 0;

  constructor(
    private readonly scene: Scene,
    gltf: GLTF | undefined,
    private readonly session: Pick<Session, 'edit' | 'sceneTime'>,
    private readonly urlOf: (file: string) => string,
    private readonly events: ReplicaEvents,
  ) {
    this.#root = gltf?.scene ?? scene;
    this.#additions = new Additions(session);
    this.#models = new Models(this.content, urlOf, gltf);
    this.#animations = new Animations(this.content);
    const environment = (gltf?.scene.userData as Extras | undefined)?.lumencast?.environment;
    if (environment) this.set('environment', environment);
  }

  /** Starts again from the file's state. */
  applySnapshot(edits: readonly Edit[]): void {
    // What was removed from an added file goes with it.
    for (const [object, parent] of this.#removed) {
      parent.add(object);
      this.events.added(object);
    }
    this.#removed.clear();
    for (const object of this.#added.values()) this.#take(object);
    this.#added.clear();
    for (const node of [...this.#adopted.keys()]) {
      if (!edits.some((edit) => edit.edit === 'add_light' && edit.node === node)) this.disown(node);
    }
    for (const thing of this.#models.restart()) this.#reconciler.forget(`${thing}/`);
    this.#animations.restart();
    // What the edits add must be there before values are set on it.
    for (const edit of edits) this.#applyStructure(edit, undefined);
    this.#reconciler.restart(edits);
    this.revision++;
  }

  /** Applies an edit that the server has accepted. */
  applyAccepted(edit: Edit, own: boolean): void {
    const isOwnLight = own && edit.edit === 'add_light';
    this.#applyStructure(edit, isOwnLight ? this.#additions.accepted(edit.node) : undefined);
    this.#reconciler.accept(edit);
    this.revision++;
  }

  /** Shows an edit at once and sends it; rejects, with the scene as before, when it is refused. */
  async edit(edit: Edit, options?: EditOptions): Promise<void> {
    const pending = this.#reconciler.begin(edit);
    this.revision++;
    try {
      if (edit.edit === 'add_light') await this.#additions.send(edit, options);
      else await this.session.edit(edit, options);
    } finally {
      pending.done();
      this.revision++;
    }
  }

  /**
   * Makes an object that the server does not know a light of its scene, for as long as somebody edits it.
   * Resolves with its node; with `undefined` where that came as part of a snapshot.
   */
  adoptLight(object: PunctualLight, transform: Transform): Promise<number | undefined> {
    const name = nodeName(object);
    const light = describeLight(object);
    const edit = { edit: 'add_light', ...(name && { name }), light, transform } as const;
    return this.#additions.send(edit, { temporary: true }, object);
  }

  /** A node that an edit has added for a light like this one of the program's, by its name. */
  findAdded(light: PunctualLight): number | undefined {
    const name = nodeName(light);
    const isFor = (object: Object3D) =>
      object.name === name &&
      object.parent === this.#root &&
      isPunctualLight(object) &&
      canBecome(object, light);
    return [...this.#added].find(([, object]) => name !== undefined && isFor(object))?.[0];
  }

  /** Lets a light of the program's own stand for an added node, in the place of the one that does. */
  takeOver(node: number, light: PunctualLight): void {
    const former = this.#added.get(node);
    if (!former) return;
    const below = former.children.filter((child) => this.content.nodeOf(child) !== node);
    if (below.length > 0) light.add(...below);
    this.#added.delete(node);
    this.content.deleteNode(node);
    former.removeFromParent();
    this.events.removed(former);
    this.#adopt(node, light);
    this.revision++;
  }

  /** Leaves a light that was the program's own to it: it stays where it is and stands for no node. */
  disown(node: number): void {
    const object = this.#adopted.get(node);
    if (!this.#adopted.delete(node)) return;
    for (const below of this.#added.values()) if (below.parent === object) this.#take(below);
    this.#forget(node);
  }

  /** Another run of the server numbers nodes anew. */
  forgetAdopted(): void {
    for (const node of [...this.#adopted.keys()]) this.disown(node);
  }

  /** Whether an object is there, or below one that is, because of an edit. */
  isAdded(object: Object3D): boolean {
    for (let node = this.content.nodeOf(object); node !== undefined;) {
      if (this.#added.has(node)) return true;
      const above = this.content.object(node)?.parent;
      node = above ? this.content.nodeOf(above) : undefined;
    }
    return false;
  }

  /** Lets objects of the program's own scene stand for nodes, as they now are on the server. */
  setNodes(pairs: readonly (readonly [object: Object3D, node: number])[]): void {
    for (const [object, node] of pairs) this.content.setNode(node, object);
    this.#reconciler.arrived();
    this.revision++;
  }

  /** Whether a node is one of the program's own lights. */
  isAdopted(node: number): boolean {
    return this.#adopted.has(node);
  }

  /** Lets this page own a node's transform and light until the returned function is called. */
  hold(node: number): () => void {
    return this.#reconciler.hold([
      ...['translation', 'rotation', 'scale'].map((part) => `node/${node}/${part}`),
      ...LIGHT_PARTS.map((part) => `light/${node}/${part}`),
    ]);
  }

  /** Plays animations; `time` is the server's scene time in seconds. */
  update(time: number | undefined): void {
    if (time !== undefined && this.#animations.update(time)) this.revision++;
  }

  playback(animation: number): Required<Playback> | undefined {
    return this.#animations.playback(animation);
  }

  get environment(): Environment | undefined {
    return this.#environment;
  }

  // Values: how keys of the reconciler reach the three.js scene.

  get(key: string): unknown {
    const [kind, id, part] = key.split('/');
    const number = Number(id);
    switch (kind) {
      case 'node':
        return nodePart(this.content.object(number), part);
      case 'light': {
        const light = this.content.light(number);
        return light && lightSpec(light)[part as keyof ReturnType<typeof lightSpec>];
      }
      case 'material':
        return materialPart(this.content.materials(number)[0], part as keyof MaterialChange);
      case 'animation':
        // Its time runs by itself: there is no value to go back to.
        return part === 'time' ? undefined : this.#animations.playback(number)?.[part as keyof Playback];
      default:
        return this.#environment ?? { type: 'constant', radiance: [0, 0, 0] };
    }
  }

  set(key: string, value: unknown): void {
    const [kind, id, part] = key.split('/');
    const number = Number(id);
    switch (kind) {
      case 'node':
        return setNodePart(this.content.object(number), part, value as number[]);
      case 'light': {
        const light = this.content.light(number);
        if (light) setLight(light, { [part as string]: value });
        return;
      }
      case 'material':
        return this.#setMaterial(number, part as keyof MaterialChange, value);
      case 'animation':
        return this.#animations.set(
          number,
          { [part as string]: value },
          this.session.sceneTime(undefined, 0) ?? 0,
        );
      default:
        this.#showEnvironment(value as Environment);
    }
  }

  #setMaterial(number: number, part: keyof MaterialChange, value: unknown): void {
    const materials = this.content.materials(number);
    for (const material of materials) setMaterialPart(material, part, value);
    if (this.#notPhysical.has(number) || !materials.some((m) => lacksPhysical(m, part))) return;
    this.#notPhysical.add(number);
    this.events.warning(
      `material ${number} cannot show ${part}: it was not loaded as a MeshPhysicalMaterial`,
    );
  }

  #showEnvironment(environment: Environment): void {
    this.#environment = environment;
    const turn = ++this.#environmentTurn;
    showEnvironment(this.scene, environment, this.urlOf, () => turn === this.#environmentTurn)
      .then(() => this.revision++)
      .catch((error: unknown) => this.events.warning(`the environment cannot be shown: ${String(error)}`));
  }

  // Edits that add and remove.

  #applyStructure(edit: Edit, adopted: Object3D | undefined): void {
    switch (edit.edit) {
      case 'add_instance': {
        const group = new Group();
        this.#insert(group, edit);
        void this.#fillInstance(group, edit);
        return;
      }
      case 'add_light': {
        const own = adopted ?? (edit.node === undefined ? undefined : this.#adopted.get(edit.node));
        if (own === undefined) this.#insert(createLight(edit.light), edit);
        else if (edit.node !== undefined) this.#adopt(edit.node, own);
        return;
      }
      case 'remove_node':
        return this.#removeNode(edit.node);
    }
  }

  #adopt(node: number, object: Object3D): void {
    this.#adopted.set(node, object);
    this.content.setNode(node, object);
    this.events.added(object);
  }

  #insert(object: Object3D, { node, name = '', parent, transform = {} }: AddedNode): void {
    object.name = name;
    for (const [part, value] of Object.entries(transform)) setNodePart(object, part, value as number[]);
    const above = parent === undefined ? this.#root : this.content.object(parent);
    if (node === undefined || above === undefined) return;
    above.add(object);
    this.content.setNode(node, object);
    this.#added.set(node, object);
    this.events.added(object);
  }

  async #fillInstance(group: Group, { source, node = 0 }: Edit & { edit: 'add_instance' }): Promise<void> {
    try {
      const object = await this.#models.instantiate(source, node);
      if (!object) return;
      if (this.content.object(node) !== group) return this.#forgetBelow(object);
      group.add(object);
      this.#reconciler.arrived();
      this.events.added(group);
      this.revision++;
    } catch (error) {
      this.events.warning(`an added instance cannot be shown: ${String(error)}`);
    }
  }

  #removeNode(node: number): void {
    if (this.#adopted.has(node)) return this.disown(node);
    const object = this.content.object(node);
    const parent = object?.parent;
    if (!object || !parent) return;
    if (this.#added.delete(node)) return this.#take(object);
    this.#removed.set(object, parent);
    parent.remove(object);
    this.events.removed(object);
  }

  /** Takes an added object out for good: its numbers are never used again. */
  #take(object: Object3D): void {
    this.#forgetBelow(object);
    object.removeFromParent();
    this.events.removed(object);
  }

  /** Forgets the nodes that an object and all below it stand for. */
  #forgetBelow(object: Object3D): void {
    for (const node of this.content.nodesBelow(object)) {
      // The program may have its own light below it, which is nobody's child for the server.
      if (this.#adopted.has(node)) continue;
      this.#added.delete(node);
      this.#forget(node);
    }
  }

  #forget(node: number): void {
    this.content.deleteNode(node);
    this.#reconciler.forget(`node/${node}/`);
    this.#reconciler.forget(`light/${node}/`);
  }
}

/** glTF `extras` of the scene that Lumencast reads. */
interface Extras {
  lumencast?: { environment?: Environment };
}

function nodePart(object: Object3D | undefined, part: string | undefined): unknown {
  if (part === 'translation') return object?.position.toArray();
  if (part === 'rotation') return object?.quaternion.toArray();
  return object?.scale.toArray();
}

function setNodePart(object: Object3D | undefined, part: string | undefined, value: readonly number[]): void {
  if (part === 'translation') object?.position.fromArray(value);
  else if (part === 'rotation') object?.quaternion.fromArray(value).normalize();
  else object?.scale.fromArray(value);
}
