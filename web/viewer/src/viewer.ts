import { isLightmap, type Session } from '@lumencast/client';
import { attach, loadGltf, type LumencastLight, type PunctualLight, type Shown } from '@lumencast/three';
import {
  Box3,
  type InstancedMesh,
  type Mesh,
  type Object3D,
  Scene,
  type SkinnedMesh,
  Timer,
  Vector3,
} from 'three';
import type { GLTF } from 'three/addons/loaders/GLTFLoader.js';
import { Controls } from './controls.js';
import type { Figures } from './ui/stats.js';
import { CameraRig } from './view/camera-rig.js';
import { meter, withinStops } from './view/exposure.js';
import { Flashlight } from './view/flashlight.js';
import { PagesView } from './view/pages.js';
import { ProbeSpheres } from './view/probes.js';
import { type AnyRenderer, createRenderer, isWebGPU, Resolution } from './view/renderer.js';
import { Selection } from './view/selection.js';
import { isDark } from './view/sky.js';
import { Touch } from './view/touch.js';
import { Failure, missingFile } from './words.js';

export interface ViewerOptions {
  readonly canvas: HTMLCanvasElement;
  readonly renderer: 'webgl' | 'webgpu';
  /** Address of the scene's glTF file. */
  readonly file: string;
  /** Makes the session, once the scene is loaded. */
  readonly connect: () => Session;
  /** Pixels a CSS pixel; adapts to the device's speed unless given. */
  readonly pixelRatio: number | undefined;
  readonly onProgress: (loaded: number, total: number | undefined) => void;
  readonly onWarning: (message: string) => void;
}

/** Frames after the first light that exposure is measured at again: the light settles meanwhile. */
const METER_AT = [0, 40, 120];

/** Milliseconds between two looks at the server's metrics. */
const ASK_INTERVAL = 3000;

/** Loads everything that a viewer needs, in the order in which it can fail. */
export async function openViewer(options: ViewerOptions): Promise<Viewer> {
  const renderer = await createRenderer(options.renderer, options.canvas);
  const gltf = await loadGltf(options.file, options.onProgress).catch((error: unknown) => {
    throw sceneFailure(options.file, error);
  });
  const scene = new Scene();
  scene.add(gltf.scene);
  const session = options.connect();
  const attached = { scene, gltf, onWarning: options.onWarning };
  const light = isWebGPU(renderer)
    ? (await import('@lumencast/three/webgpu')).attach(session, { ...attached, renderer })
    : attach(session, { ...attached, renderer });
  return new Viewer(options, renderer, gltf, session, light, scene);
}

/** Why a scene's file is not shown. */
function sceneFailure(file: string, error: unknown): Failure {
  const what = "The scene's file";
  const thrown = (error as Error).cause ?? error;
  // What three.js throws has the answer with it; fetch throws a TypeError when nobody answers.
  const { response } = thrown as { response?: Response };
  if (response) return missingFile(what, file, String(response.status), error);
  if (thrown instanceof TypeError) return missingFile(what, file, 'nobody answers', error);
  return new Failure(`${what} cannot be read: ${file}`, 'Is it a glTF file?', { cause: error });
}

/** The picture and what one can do with it. The page's controls are in {@link Controls}. */
export class Viewer {
  readonly rig: CameraRig;
  readonly selection: Selection;
  readonly touch: Touch;
  readonly flashlight: Flashlight;
  readonly probes = new ProbeSpheres();
  readonly pages = new PagesView();
  readonly controls: Controls;
  /** Metering goes on by itself until somebody sets the exposure. */
  autoExposure = true;

  readonly #resolution: Resolution;
  readonly #timer = new Timer();
  #drawnRevision = -1;
  #darkRevision = -1;
  #isDark = false;
  #litFrames = 0;
  #frameTime = 16;
  #lumelTime = 0;
  #askedAt = 0;
  #clients: number | undefined;
  #metering: Promise<void> | undefined;

  constructor(
    readonly options: ViewerOptions,
    readonly renderer: AnyRenderer,
    readonly gltf: GLTF,
    readonly session: Session,
    readonly light: LumencastLight,
    readonly scene: Scene,
  ) {
    const { canvas } = options;
    const bounds = contentBounds(gltf.scene);
    this.rig = new CameraRig(canvas, bounds);
    if (gltf.cameras[0]) this.rig.goTo(gltf.cameras[0], true);
    this.touch = new Touch(light);
    this.selection = new Selection(light, gltf.scene, this.rig.camera, canvas, this.touch, (dragging) => {
      this.rig.locked = dragging;
    });
    this.flashlight = new Flashlight({
      light,
      camera: this.rig.camera,
      canvas,
      touch: this.touch,
      content: gltf.scene,
      reach: bounds.getSize(new Vector3()).length() || 1,
      lights: () => this.lights,
      exposure: () => this.exposure,
    });
    this.probes.group.name = 'probes';
    this.selection.overlay.add(this.probes.group, this.pages.mesh);
    scene.add(this.selection.overlay);
    this.#resolution = new Resolution(renderer, canvas, options.pixelRatio);
    this.controls = new Controls(this);
    this.#timer.connect(document);
  }

  /** Draws from now on. */
  start(): void {
    void this.renderer.setAnimationLoop((now: number) => this.#frame(now));
  }

  /** Draws no more by itself; light and edits go on to come in. */
  stop(): void {
    void this.renderer.setAnimationLoop(null);
  }

  #frame(now: number): void {
    this.#timer.update(now);
    const seconds = this.#timer.getDelta();
    this.#frameTime += (seconds * 1000 - this.#frameTime) * 0.08;
    this.#resolution.frame(seconds * 1000);
    this.draw(performance.now(), seconds);
    this.#lumelTime += (this.light.lumelTime - this.#lumelTime) * 0.08;
    this.controls.update();
    this.#meterWhenLit();
    if (now - this.#askedAt > ASK_INTERVAL) {
      this.#askedAt = now;
      void this.#askClients();
    }
  }

  /** One picture, at a time as of `performance.now()`. */
  draw(now: number = performance.now(), seconds = 0): void {
    this.#resolution.fit();
    this.rig.fingerPoints = this.flashlight.on;
    this.rig.update(seconds);
    this.rig.camera.updateMatrixWorld();
    this.flashlight.update(now);
    this.touch.update(now);
    this.light.update(this.rig.camera, now);
    this.selection.update();
    if (this.probes.group.visible) this.probes.update(this.session.light(now), now);
    if (this.pages.mesh.visible) this.pages.update(this.rig.camera, this.light);
    this.#refreshShadows();
    this.renderer.render(this.scene, this.rig.camera);
  }

  /** Shadow maps of a large scene cost more than the picture: only when something has moved. */
  #refreshShadows(): void {
    const moved = this.light.sceneRevision !== this.#drawnRevision;
    this.#drawnRevision = this.light.sceneRevision;
    for (const { shadow } of this.selection.lights) {
      shadow.autoUpdate = false;
      shadow.needsUpdate ||= moved;
    }
  }

  /** Whether nothing gives light in a scene that a server would change. */
  get isDark(): boolean {
    const { light, session } = this;
    if (session.status.state !== 'connected' || light.lightRevision === 0) return false;
    if (light.sceneRevision !== this.#darkRevision) {
      this.#darkRevision = light.sceneRevision;
      this.#isDark = isDark(this.gltf.scene, light.environment);
    }
    return this.#isDark;
  }

  get lights(): PunctualLight[] {
    return this.selection.lights;
  }

  /** Shows all pages of lumels before the picture, or no more. */
  togglePages(): void {
    this.pages.mesh.visible = !this.pages.mesh.visible;
  }

  setMode(shown: Shown): void {
    this.light.show = shown;
  }

  get playing(): boolean {
    return [...this.light.content.animations.keys()].some((number) => this.light.playback(number)?.playing);
  }

  /** Pauses all animations, or plays them on; everyone sees it. */
  togglePlaying(): void {
    const playing = !this.playing;
    for (const animation of this.light.content.animations.keys()) {
      this.light
        .edit({ edit: 'set_animation', animation, playing })
        .catch((error: Error) => this.options.onWarning(error.message));
    }
  }

  /** Of the picture, 1 / (cd/m²). All light is drawn with it, so that half floats hold what is shown. */
  get exposure(): number {
    return this.light.preExposure;
  }

  set exposure(exposure: number) {
    this.light.preExposure = withinStops(exposure);
  }

  /** Sets the exposure by the picture. */
  meter(): Promise<void> {
    const { renderer, scene, rig, selection, exposure } = this;
    return (this.#metering ??= meter(renderer, scene, rig.camera, selection.overlay, exposure)
      .then((measured) => {
        if (measured !== undefined) this.exposure = measured;
      })
      .finally(() => (this.#metering = undefined)));
  }

  /** Lets exposure find its way again, as after the first light, where the page has it. */
  meterAnew(): void {
    this.#litFrames = 0;
  }

  #meterWhenLit(): void {
    if (!this.autoExposure || this.light.lightRevision === 0) return;
    if (METER_AT.includes(this.#litFrames++)) void this.meter();
  }

  /** Whether this is saved light, which no server stands behind. */
  get isSaved(): boolean {
    return this.session.status.state === 'saved';
  }

  stats(): Figures {
    return {
      ...this.session.stats,
      framesPerSecond: 1000 / this.#frameTime,
      clients: this.#clients,
      lumels: this.#lumelFigures(),
    };
  }

  #lumelFigures(): Figures['lumels'] {
    const { light, session } = this;
    const shapes = session.catalog?.fields.filter(isLightmap).map(({ shape }) => shape) ?? [];
    if (!light.pages || shapes.length === 0) return undefined;
    const pages = shapes.reduce((sum, shape) => sum + shape.pages, 0);
    return { pages, pageSize: shapes[0].pageSize, meshes: light.lumelMeshes, time: this.#lumelTime };
  }

  /** Who else watches stands in the server's metrics. */
  async #askClients(): Promise<void> {
    if (document.hidden || this.session.status.state !== 'connected') return;
    try {
      const metrics = await (await fetch(new URL('metrics', location.href))).text();
      const count = /^lumencast_clients(?:\{[^}]*\})? (\d+)/m.exec(metrics)?.[1];
      this.#clients = count === undefined ? undefined : Number(count);
    } catch {
      this.#clients = undefined;
    }
  }

  /** Red, green, blue, 0 to 255, of points of a picture drawn for `now`; from the upper left, in CSS pixels. */
  pixels(
    points: readonly (readonly [x: number, y: number])[],
    now: number = performance.now(),
  ): [r: number, g: number, b: number][] {
    const { canvas } = this.options;
    const copy = document.createElement('canvas');
    copy.width = canvas.width;
    copy.height = canvas.height;
    const context = copy.getContext('2d', { willReadFrequently: true })!;
    // A canvas holds its picture only until the browser has shown it.
    this.draw(now);
    context.drawImage(canvas, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    const { width, height } = canvas.getBoundingClientRect();
    return points.map(([x, y]) => {
      const column = Math.floor((x / width) * copy.width);
      const at = (Math.floor((y / height) * copy.height) * copy.width + column) * 4;
      return [data[at], data[at + 1], data[at + 2]];
    });
  }

  /** One point; see {@link pixels}. */
  pixel(x: number, y: number): [r: number, g: number, b: number] {
    return this.pixels([[x, y]])[0];
  }
}

function contentBounds(content: Object3D): Box3 {
  const bounds = new Box3();
  content.updateWorldMatrix(true, true);
  content.traverseVisible((object) => bounds.union(boundsAlone(object)));
  return bounds.isEmpty() ? bounds.set(new Vector3(-1, -1, -1), new Vector3(1, 1, 1)) : bounds;
}

/** The box of an object in the world, without what hangs below it. */
function boundsAlone(object: Object3D): Box3 {
  const mesh = object as Partial<InstancedMesh | SkinnedMesh>;
  if (!mesh.geometry) return new Box3();
  // Instances and joints have a box of their own.
  const of = 'boundingBox' in mesh ? mesh : mesh.geometry;
  (of as Mesh['geometry']).computeBoundingBox();
  return (of.boundingBox ?? new Box3()).clone().applyMatrix4(object.matrixWorld);
}
