import type { Edit, LumencastLight, PunctualLight } from '@lumencast/three';
import {
  type Camera,
  Matrix4,
  type Object3D,
  Quaternion,
  Raycaster,
  SpotLight,
  Vector2,
  Vector3,
} from 'three';
import type { Touch } from './touch.js';

/** Where the hand holds it, from the eye: metres right, down and ahead, of a scene ten metres across. */
const HAND = new Vector3(0.18, -0.14, -0.1);
/** Half-angles of the cone where its light begins to fall off, and where it ends, radians. */
const CONE = { inner: 0.07, outer: 0.15 } as const;
/** What the spot's radiance is in the picture on a white wall: bright, but not burnt out. */
const SHOWN = 1.5;
/** Milliseconds between two looks at how far away is what one points at: rays are slow in large scenes. */
const LOOK_INTERVAL = 150;

/** The spot light of the scene that is named a flashlight. */
export function findFlashlight(lights: readonly PunctualLight[]): SpotLight | undefined {
  const isNamed = ({ name }: Object3D) => /flash|torch/i.test(name);
  return lights
    .filter((light) => light instanceof SpotLight)
    .find((light) => isNamed(light) || (light.parent !== null && isNamed(light.parent)));
}

/** What the flashlight needs of the page. */
export interface Surroundings {
  readonly light: LumencastLight;
  readonly camera: Camera;
  readonly canvas: HTMLCanvasElement;
  readonly touch: Touch;
  /** What it shines on. */
  readonly content: Object3D;
  /** Largest extent of the scene, metres. */
  readonly reach: number;
  lights(): PunctualLight[];
  /** Of the picture, 1 / (cd/m²). */
  exposure(): number;
}

/**
 * A spot light that is carried with the camera and aims where the pointer is: the scene's own, or one that
 * is added while it is in the hand.
 */
export class Flashlight {
  /** Whether the light is in the hand. */
  #on = false;
  /** The light that this page has added. */
  #added: SpotLight | undefined;
  readonly #pointer = new Vector2();
  readonly #raycaster = new Raycaster();
  /** Metres to what one points at, and when that was found. */
  #distance: number;
  #lookedAt = -Infinity;

  constructor(private readonly around: Surroundings) {
    this.#distance = around.reach / 2;
    const follow = ({ clientX, clientY }: PointerEvent) => {
      const { left, top, width, height } = around.canvas.getBoundingClientRect();
      this.#pointer.set(((clientX - left) / width) * 2 - 1, 1 - ((clientY - top) / height) * 2);
    };
    around.canvas.addEventListener('pointerdown', follow);
    around.canvas.addEventListener('pointermove', follow);
  }

  get on(): boolean {
    return this.#on;
  }

  /** The light that the hand takes. */
  get spot(): SpotLight | undefined {
    const lights = this.around.lights();
    return this.#added && lights.includes(this.#added) ? this.#added : findFlashlight(lights);
  }

  /** Takes the flashlight, and adds one to a scene that has none; everyone sees it. */
  async take(): Promise<void> {
    if (this.#on) return;
    this.#on = true;
    // Taken by a button, it points ahead; by a key, where the pointer is.
    if (!this.around.canvas.matches(':hover')) this.#pointer.set(0, 0);
    this.#look(performance.now());
    if (this.spot) return;
    const others = this.around.lights();
    try {
      await this.#add();
    } catch (error) {
      this.#on = false;
      throw error;
    }
    this.#added = this.around
      .lights()
      .find((light): light is SpotLight => light instanceof SpotLight && !others.includes(light));
    if (!this.#on) await this.#remove();
  }

  /** Lets go of the flashlight: the scene's own stays where it is, an added one is gone. */
  async putAway(): Promise<void> {
    this.#on = false;
    await this.#remove();
  }

  /** Whether the light goes when it is put away. */
  get isAdded(): boolean {
    return this.#added !== undefined;
  }

  update(now: number): void {
    const { spot } = this;
    if (!this.#on || !spot) return;
    if (now - this.#lookedAt > LOOK_INTERVAL) this.#look(now);
    this.around.touch.touch(spot);
    const { translation, rotation } = this.#pose();
    const world = new Matrix4().compose(translation, rotation, new Vector3(1, 1, 1));
    const carrier = this.around.light.content.carrier(spot);
    const parent = carrier.parent?.matrixWorld ?? new Matrix4();
    const local = parent.clone().invert().multiply(world);
    local.decompose(carrier.position, carrier.quaternion, new Vector3());
    carrier.updateMatrixWorld();
  }

  /** Temporary: it does not stay behind when the page is closed. */
  #add(): Promise<void> {
    const { translation, rotation } = this.#pose();
    const edit: Edit = {
      edit: 'add_light',
      light: {
        type: 'spot',
        color: [1, 0.93, 0.82],
        // White under E lux has a radiance of E / π; at this distance, E is the intensity over its square.
        intensity: (SHOWN * Math.PI * this.#distance ** 2) / this.around.exposure(),
        ...CONE,
      },
      transform: {
        translation: translation.toArray(),
        rotation: rotation.toArray() as [number, number, number, number],
      },
    };
    return this.around.light.edit(edit, { temporary: true });
  }

  async #remove(): Promise<void> {
    const added = this.#added;
    this.#added = undefined;
    const node = added && this.around.light.content.nodeOf(added);
    if (node === undefined) return;
    this.around.touch.release(added!);
    await this.around.light.edit({ edit: 'remove_node', node });
  }

  /** Finds how far away is what one points at. */
  #look(now: number): void {
    const { camera, content, reach } = this.around;
    this.#lookedAt = now;
    this.#raycaster.setFromCamera(this.#pointer, camera);
    const hit = this.#raycaster.intersectObject(content, true).find(({ object }) => object.visible);
    this.#distance = Math.max(hit?.distance ?? reach / 2, reach / 100);
  }

  /** In world space: at the hand, aimed at what one points at. */
  #pose(): { translation: Vector3; rotation: Quaternion } {
    const { camera, reach } = this.around;
    const translation = HAND.clone()
      .multiplyScalar(reach / 10)
      .applyMatrix4(camera.matrixWorld);
    this.#raycaster.setFromCamera(this.#pointer, camera);
    const aim = this.#raycaster.ray.at(this.#distance, new Vector3());
    const up = new Vector3(0, 1, 0);
    const rotation = new Quaternion().setFromRotationMatrix(new Matrix4().lookAt(translation, aim, up));
    return { translation, rotation };
  }
}
