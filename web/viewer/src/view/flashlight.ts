import type { LumencastLight, PunctualLight } from '@lumencast/three';
import { type Camera, Matrix4, type Object3D, Quaternion, SpotLight, Vector3 } from 'three';
import type { Touch } from './touch.js';

/** Where the hand holds it, from the eye: metres right, down and ahead, of a scene ten metres across. */
const HAND = new Vector3(0.18, -0.14, -0.1);

/** The light to aim: a spot light named so, else the first spot light. */
export function findFlashlight(lights: readonly PunctualLight[]): SpotLight | undefined {
  const spots = lights.filter((light) => light instanceof SpotLight);
  const named = (light: Object3D) =>
    /flash|torch|spot/i.test(light.name) || /flash|torch|spot/i.test(light.parent?.name ?? '');
  return spots.find(named) ?? spots[0];
}

/** Carries a spot light with the camera and aims it where the pointer is. */
export class Flashlight {
  /** Whether the light is in the hand. */
  on = false;
  readonly #pointer = { x: 0, y: 0 };

  constructor(
    private readonly light: LumencastLight,
    private readonly camera: Camera,
    private readonly touch: Touch,
    /** Largest extent of the scene, metres. */
    private readonly reach: number,
  ) {
    addEventListener('pointermove', ({ clientX, clientY }) => {
      this.#pointer.x = (clientX / innerWidth) * 2 - 1;
      this.#pointer.y = 1 - (clientY / innerHeight) * 2;
    });
  }

  /** Adds a flashlight to a scene that has none; everyone sees it. */
  add(): Promise<void> {
    const { translation, rotation } = this.#pose();
    const reach = this.reach / 10;
    return this.light.edit({
      edit: 'add_light',
      light: {
        type: 'spot',
        color: [1, 0.93, 0.82],
        intensity: 60 * reach * reach,
        inner: 0.15,
        outer: 0.42,
      },
      transform: {
        translation: translation.toArray(),
        rotation: rotation.toArray() as [number, number, number, number],
      },
    });
  }

  update(spot: SpotLight | undefined): void {
    if (!this.on || !spot) return;
    this.touch.touch(spot);
    const { translation, rotation } = this.#pose();
    const world = new Matrix4().compose(translation, rotation, new Vector3(1, 1, 1));
    const carrier = this.light.content.carrier(spot);
    const parent = carrier.parent?.matrixWorld ?? new Matrix4();
    const local = parent.clone().invert().multiply(world);
    local.decompose(carrier.position, carrier.quaternion, new Vector3());
    carrier.updateMatrixWorld();
  }

  /** In world space: at the hand, aimed at a point far along the pointer's ray. */
  #pose(): { translation: Vector3; rotation: Quaternion } {
    const { camera } = this;
    const translation = HAND.clone()
      .multiplyScalar(this.reach / 10)
      .applyMatrix4(camera.matrixWorld);
    const eye = new Vector3().setFromMatrixPosition(camera.matrixWorld);
    const ray = new Vector3(this.#pointer.x, this.#pointer.y, 0.5).unproject(camera).sub(eye).normalize();
    const aim = eye.addScaledVector(ray, this.reach / 2);
    const up = new Vector3(0, 1, 0);
    const rotation = new Quaternion().setFromRotationMatrix(new Matrix4().lookAt(translation, aim, up));
    return { translation, rotation };
  }
}
