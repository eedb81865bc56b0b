import {
  type AcceptedEdit,
  type Catalog,
  type Edit,
  type EditOptions,
  type Environment,
  isLightmap,
  isVolume,
} from '@lumencast/client';
import { type Camera, type Light, type Object3D, type Scene, type Texture, Vector3 } from 'three';
import type { GLTF } from 'three/addons/loaders/GLTFLoader.js';
import type { Content } from './content.js';
import { expose, type SetWhileDrawn, whileDrawn } from './exposure.js';
import { nameOf, SavedFiles, sceneFile } from './files.js';
import { Following } from './following.js';
import { ProbeGrids } from './grids.js';
import { isPunctualLight } from './lights.js';
import type { LightSession } from './light-session.js';
import type { LumelLook } from './lumel-pages.js';
import { Lumels } from './lumels.js';
import type { NamedNode } from './names.js';
import type { Platform, ProbeGrid } from './platform.js';
import { Replica } from './replica.js';
import { type ShadowOptions, Shadows } from './shadows.js';

export interface AttachOptions {
  /** Where the light is shown. */
  scene: Scene;
  /** The server's scene file as GLTFLoader gave it: through it objects are known by their node. */
  gltf?: GLTF | undefined;
  /** Shadows of direct light, or `false` where the program has its own. */
  shadows?: ShadowOptions | false;
  /** Gets what is shown otherwise than the server means it. `console.warn` unless given. */
  onWarning?: (message: string) => void;
}

/** Which part of the light is drawn; emission and background are in all of them. */
export type Shown = 'both' | 'direct' | 'indirect';

/** Where warnings go unless a program takes them. */
export function warnInConsole(message: string): void {
  console.warn(`Lumencast: ${message}`);
}

/** How long the server may take to hear of what was followed, milliseconds. */
const FAREWELL = 1000;

/** What a session tells of the scene. */
export type SceneEvent = { readonly snapshot: readonly Edit[] } | { readonly accepted: AcceptedEdit };

/** A scene lit by a server: streamed indirect light, and the server's edits applied. */
export class LumencastLight {
  /**
   * What all that radiates in the scene is multiplied by while it is drawn. Half-float targets overflow
   * at a radiance of 65,504 cd/m², which sunlit scenes pass: WebGPURenderer draws into one, and both
   * renderers draw what transmissive materials show into another. With the picture's exposure here, and
   * `renderer.toneMappingExposure` left at 1, they hold what is shown. Pictures in a program's own
   * render targets are multiplied as well. 1 unless set.
   */
  preExposure = 1;
  /**
   * What indirect light is multiplied by: `static` that of meshes that have lumels, `dynamic` that of all
   * others, which probes light. Without lightmaps nothing is known of what moves: `static` is for all.
   */
  readonly strengths = { static: 1, dynamic: 1 };

  readonly #replica: Replica;
  readonly #grids: ProbeGrids;
  readonly #lumels: Lumels;
  readonly #shadows: Shadows | undefined;
  readonly #following: Following;
  readonly #unsubscribe: (() => void)[];
  readonly #saved: SavedFiles;
  readonly #camera = new Vector3();
  readonly #warn: (message: string) => void;
  readonly #restoreHooks: () => void;
  readonly #warned = new Set<string>();
  #show: Shown = 'both';
  #fittedRevision = -1;
  #fittedAt = -Infinity;
  #lightRevision = 0;
  #epoch: string | undefined;

  constructor(
    readonly session: LightSession,
    private readonly platform: Platform,
    private readonly options: AttachOptions,
    missed: readonly SceneEvent[] = [],
    names?: Promise<readonly NamedNode[]>,
  ) {
    const { scene, gltf, shadows = {} } = options;
    this.#warn = options.onWarning ?? warnInConsole;
    this.#saved = new SavedFiles(session);
    this.#shadows = shadows === false ? undefined : new Shadows(shadows);
    this.#replica = new Replica(scene, gltf, session, (file) => this.urlOf(file), {
      added: (object) => this.#added(object),
      removed: (object) => this.#shadows?.remove(object),
      warning: this.#warn,
    });
    this.#lumels = new Lumels(scene, this.#replica.content, platform, this.#warn);
    this.#grids = new ProbeGrids(scene, platform, () => this.#lumels.units);
    this.#following = new Following(session, this.#replica, this.#warn);
    this.#added(scene);
    this.#restoreHooks = whileDrawn(scene, (set) => this.#changeWhileDrawn(set));
    this.#unsubscribe = [
      session.on('catalog', (catalog) => this.#offered(catalog)),
      session.on('snapshot', (snapshot) => this.#receive({ snapshot })),
      session.on('edit', (accepted) => this.#receive({ accepted })),
    ];
    if (session.saved) this.#receive({ snapshot: session.saved.edits });
    for (const event of missed) this.#receive(event);
    if (session.catalog) this.#offered(session.catalog);
    if (names) void this.#following.match(names, scene);
  }

  /** To be called each frame, before rendering. `now` is `performance.now()`. */
  update(camera: Camera, now: number = performance.now()): void {
    this.session.setCamera(this.#camera.setFromMatrixPosition(camera.matrixWorld).toArray());
    this.#warnOnce(this.#grids.fit());
    const light = this.session.light(now);
    const [ofGrids, ofLumels] = [this.#grids.update(light), this.#lumels.update(light, now)];
    if (ofGrids || ofLumels) this.#lightRevision++;
    this.#following.send(now);
    this.#replica.update(this.session.sceneTime(now));
    this.#lumels.follow(this.#replica.revision, now);
    this.platform.patch(this.options.scene);
    this.#fitShadows(now);
  }

  /**
   * This page moves the object, and changes it when it is a light; the server and every other page
   * follow, up to 30 times a second. Until the returned function is called, others' edits of it do
   * not show here. With saved light, nobody is told.
   *
   * A light that is not in the server's scene stands for one of its name and kind that a page has added,
   * or is added to it, with a warning, for as long as somebody edits it. The returned function and
   * {@link dispose} remove it from the server's scene, unless other clients have sent edits of it: then it
   * goes ten seconds after the last of those. Whoever removes it, while it is followed it is added anew.
   * It stays in the page's scene.
   * @throws Error when the server cannot know the object.
   */
  follow(object: Object3D): () => void {
    this.#following.add(object);
    return () => this.#following.remove(object);
  }

  /**
   * Says that an object of the program's own scene stands for a node of the server's: what changes the
   * one changes the other from now on. It must hang below what stands for the node's parent, as edits
   * place nodes relative to theirs. Needed only where names do not say it.
   */
  setNode(object: Object3D, node: number): void {
    this.#replica.setNodes([[object, node]]);
  }

  /**
   * Shows an edit at once and sends it. Rejects, with the scene as before, when it is refused. What a
   * `temporary` one adds goes ten seconds after all who have sent edits of it.
   */
  edit(edit: Edit, options?: EditOptions): Promise<void> {
    return this.#replica.edit(edit, options);
  }

  /** Which part of the light is drawn. */
  get show(): Shown {
    return this.#show;
  }

  set show(show: Shown) {
    this.#show = show;
    this.#grids.visible = show !== 'direct';
  }

  /** The scene's light from afar, as far as it is known. */
  get environment(): Environment | undefined {
    return this.#replica.environment;
  }

  /** Nodes, materials, animations and cameras by glTF number. */
  get content(): Content {
    return this.#replica.content;
  }

  get playback(): Replica['playback'] {
    return (animation) => this.#replica.playback(animation);
  }

  /** The probe grids that the scene is lit by. */
  get grids(): readonly ProbeGrid[] {
    return this.#grids.grids;
  }

  /**
   * The texture that holds all pages of lumels, rows from 0 on, and what its values are multiplied by to be
   * irradiance in lux; `undefined` where there are none.
   */
  get pages(): { readonly texture: Texture; readonly scale: number } | undefined {
    const { pages, scale } = this.#lumels;
    return pages && { texture: pages, scale };
  }

  /** Meshes that are lit by lumels now. */
  get lumelMeshes(): number {
    return this.#lumels.meshes;
  }

  /** Milliseconds that lumels took of the page's thread in the last {@link update}. */
  get lumelTime(): number {
    return this.#lumels.time;
  }

  /** What the pages show: the light, or, on white, the lumels as a checkerboard or how old each part is. */
  get look(): LumelLook {
    return this.#lumels.look;
  }

  set look(look: LumelLook) {
    this.#lumels.look = look;
  }

  /** Grows when objects, lights or materials have changed: shadow maps are to be drawn anew. */
  get sceneRevision(): number {
    return this.#replica.revision;
  }

  /** Grows when indirect light has changed. */
  get lightRevision(): number {
    return this.#lightRevision;
  }

  /** The address of a file of the scene, which edits name by its URI. */
  urlOf(uri: string): string {
    const address = sceneFile(this.session, nameOf(uri));
    return this.#saved.addressInstead(address) ?? address;
  }

  /**
   * Gives the scene back without its indirect light, and ends the session: at once, or a second later
   * where the server is still to hear of what was followed.
   */
  dispose(): void {
    const ends = this.#following.clear();
    for (const unsubscribe of this.#unsubscribe) unsubscribe();
    this.#restoreHooks();
    this.#saved.dispose();
    this.#grids.dispose();
    this.#lumels.dispose();
    this.platform.unpatch(this.options.scene);
    const close = () => this.session.close();
    if (ends === undefined || this.session.status.state !== 'connected') close();
    else void Promise.race([ends, new Promise((resolve) => setTimeout(resolve, FAREWELL))]).then(close);
  }

  #added(object: Object3D): void {
    this.#shadows?.add(object);
    this.platform.patch(object);
  }

  #offered({ epoch, fields }: Catalog): void {
    if (epoch !== this.#epoch) this.#replica.forgetAdopted();
    this.#epoch = epoch;
    this.#warned.clear();
    // Lumels take their unit before grids are planned.
    const unshown = this.session.unshown ?? [];
    this.#lumels.setLightmaps(fields.filter(isLightmap).filter((field) => !unshown.includes(field)));
    this.#warnOnce(this.#grids.setVolumes(fields.filter(isVolume)));
  }

  /** Grids are made anew as materials come and go. */
  #warnOnce(warnings: readonly string[]): void {
    for (const warning of warnings) {
      if (this.#warned.has(warning)) continue;
      this.#warned.add(warning);
      this.#warn(warning);
    }
  }

  #receive(event: SceneEvent): void {
    if ('snapshot' in event) this.#joined(event.snapshot);
    else this.#accepted(event.accepted);
  }

  #accepted({ edit, own, client }: AcceptedEdit): void {
    this.#replica.applyAccepted(edit, own);
    if (!own && client !== undefined) this.#following.heard(edit);
  }

  /** The file's state and a snapshot on it; what this page follows stays as it is and is sent anew. */
  #joined(edits: readonly Edit[]): void {
    this.#replica.applySnapshot(edits);
    this.#following.restart();
  }

  #fitShadows(now: number): void {
    const revision = this.#replica.revision;
    if (revision !== this.#fittedRevision && now - this.#fittedAt > 500) {
      this.#fittedRevision = revision;
      this.#fittedAt = now;
      this.#shadows?.fit(this.options.gltf?.scene ?? this.options.scene);
    }
    this.#shadows?.update();
  }

  #changeWhileDrawn(set: SetWhileDrawn): void {
    const { preExposure } = this;
    const { scene } = this.options;
    this.#weighIndirect(set);
    if (preExposure === 1 && this.#show !== 'indirect') return;
    scene.traverse((object) => {
      if (!('isLight' in object)) return;
      const { intensity } = object as Light;
      const dark = this.#show === 'indirect' && isPunctualLight(object);
      set(object, 'intensity', dark ? 0 : intensity * preExposure);
    });
    if (preExposure !== 1) expose(scene, preExposure, set);
  }

  /** What else the grids' light is multiplied by stands in their intensity or their atlas. */
  #weighIndirect(set: SetWhileDrawn): void {
    const { preExposure, platform, strengths } = this;
    const { factors, pages, scaleIn } = platform;
    const exposure = scaleIn === 'atlas' ? preExposure : 1;
    const hasLumels = this.#lumels.units > 0;
    set(factors.still, 'value', exposure * strengths.static);
    set(factors.moving, 'value', exposure * (hasLumels ? strengths.dynamic : strengths.static));
    const ofLumels = this.#show === 'direct' ? 0 : this.#lumels.scale * strengths.static * preExposure;
    // What is looked into it by is shown as bright as white paper, whatever the exposure.
    set(factors.lumels, 'value', this.look === 'light' ? ofLumels : Math.PI);
    set(factors.slopes, 'value', this.#lumels.slopes);
    if (pages) set(pages, 'value', this.#lumels.pages ?? null);
  }
}
