import {
  type Box3,
  type Camera,
  Euler,
  MathUtils,
  PerspectiveCamera,
  Quaternion,
  TOUCH,
  Vector3,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

export type CameraMode = 'orbit' | 'fly';

/** Seconds that the way to another view takes. */
const FLIGHT = 0.9;
/** What of the scene is in sight as a whole: a ball about it. */
const OVERVIEW = { fov: 50, aspect: 1 } as const;
const FLY_KEYS = new Set(['KeyW', 'KeyA', 'KeyS', 'KeyD', 'KeyQ', 'KeyE', 'ShiftLeft', 'ShiftRight']);

/** The camera and how one moves it: around a point, or freely with W A S D and the mouse. */
export class CameraRig {
  readonly camera = new PerspectiveCamera();
  #mode: CameraMode = 'orbit';
  readonly #orbit: OrbitControls;
  readonly #pressed = new Set<string>();
  /** Metres a second. */
  #speed: number;
  #view: { readonly fov: number; readonly aspect: number } = OVERVIEW;
  #flight: { from: Pose; to: Pose; seconds: number } | undefined;
  #look: { id: number; x: number; y: number } | undefined;
  /** Pointers that are down on the canvas while flying. */
  readonly #fingers = new Map<number, { x: number; y: number }>();
  #locked = false;
  #fingerPoints = false;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly bounds: Box3,
  ) {
    const reach = bounds.getSize(new Vector3()).length() || 1;
    this.#speed = reach / 8;
    this.camera.near = reach * 1e-3;
    this.camera.far = reach * 8;
    this.#orbit = new OrbitControls(this.camera, canvas);
    this.#orbit.enableDamping = true;
    this.#orbit.dampingFactor = 0.12;
    this.#orbit.addEventListener('start', () => (this.#flight = undefined));
    this.#listen();
    this.overview();
  }

  get mode(): CameraMode {
    return this.#mode;
  }

  set mode(mode: CameraMode) {
    this.#mode = mode;
    this.#flight = undefined;
    if (mode === 'orbit') this.#aimOrbit();
  }

  /** Set while something else is dragged, of which the camera sees the pointer too. */
  set locked(locked: boolean) {
    this.#locked = locked;
    if (locked) this.#orbit.enabled = false;
  }

  /** Set while one finger points at something: it takes two to move the camera. */
  set fingerPoints(points: boolean) {
    this.#fingerPoints = points;
    this.#orbit.touches.ONE = points ? null : TOUCH.ROTATE;
  }

  /** A view of the whole scene. */
  overview(): void {
    this.#flight = undefined;
    this.#view = OVERVIEW;
    const size = this.bounds.getSize(new Vector3());
    const target = this.bounds.getCenter(new Vector3());
    const distance = (0.6 * size.length()) / Math.tan(MathUtils.degToRad(OVERVIEW.fov / 2));
    this.camera.position.copy(target).addScaledVector(new Vector3(0.35, 0.25, 1).normalize(), distance);
    this.camera.lookAt(target);
    this.#orbit.target.copy(target);
    this.#fit();
  }

  /** Goes to where a camera of the file stands; at once when `instant`. */
  goTo(camera: Camera, instant = false): void {
    camera.updateWorldMatrix(true, false);
    const to = {
      position: camera.getWorldPosition(new Vector3()),
      rotation: camera.getWorldQuaternion(new Quaternion()),
    };
    if (camera instanceof PerspectiveCamera) this.#view = { fov: camera.fov, aspect: camera.aspect };
    const calm = instant || matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.#flight = { from: this.#pose(), to, seconds: calm ? FLIGHT : 0 };
    this.update(0);
  }

  /** Fits the camera to the canvas: what a camera of the file shows stays in sight in a narrow one. */
  #fit(): void {
    const { camera } = this;
    camera.aspect = this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1);
    const half = Math.tan(MathUtils.degToRad(this.#view.fov / 2));
    const widened = Math.max(half, (half * this.#view.aspect) / camera.aspect);
    camera.fov = Math.min(MathUtils.radToDeg(2 * Math.atan(widened)), 110);
    camera.updateProjectionMatrix();
  }

  /** Moves on by a frame of that many seconds. */
  update(seconds: number): void {
    this.#fit();
    this.#orbit.enabled = this.#mode === 'orbit' && !this.#locked && this.#flight === undefined;
    if (this.#flight) this.#fly(this.#flight, seconds);
    else if (this.#mode === 'orbit') this.#orbit.update(seconds);
    else this.#walk(seconds);
  }

  #fly(flight: { from: Pose; to: Pose; seconds: number }, seconds: number): void {
    flight.seconds += seconds;
    const share = MathUtils.smootherstep(flight.seconds / FLIGHT, 0, 1);
    this.camera.position.lerpVectors(flight.from.position, flight.to.position, share);
    this.camera.quaternion.slerpQuaternions(flight.from.rotation, flight.to.rotation, share);
    if (share < 1) return;
    this.#flight = undefined;
    this.#aimOrbit();
  }

  #walk(seconds: number): void {
    const axis = (plus: string, minus: string) =>
      Number(this.#pressed.has(plus)) - Number(this.#pressed.has(minus));
    const step = new Vector3(axis('KeyD', 'KeyA'), 0, axis('KeyS', 'KeyW')).applyQuaternion(
      this.camera.quaternion,
    );
    step.y += axis('KeyE', 'KeyQ');
    const fast = this.#pressed.has('ShiftLeft') || this.#pressed.has('ShiftRight') ? 3 : 1;
    this.camera.position.addScaledVector(step, this.#speed * fast * Math.min(seconds, 0.1));
  }

  /** A point ahead to orbit about: a third of the scene away. */
  #aimOrbit(): void {
    // What is left of an earlier turn must not carry the camera on from here: it is spent at once.
    const { position, rotation } = this.#pose();
    this.#orbit.enableDamping = false;
    this.#orbit.update();
    this.#orbit.enableDamping = true;
    this.camera.position.copy(position);
    this.camera.quaternion.copy(rotation);
    const ahead = this.camera.getWorldDirection(new Vector3());
    const distance = this.bounds.getSize(new Vector3()).length() / 5;
    this.#orbit.target.copy(this.camera.position).addScaledVector(ahead, distance);
    this.#orbit.update();
  }

  #pose(): Pose {
    return { position: this.camera.position.clone(), rotation: this.camera.quaternion.clone() };
  }

  #listen(): void {
    addEventListener('keydown', (event) => {
      if (FLY_KEYS.has(event.code) && !event.ctrlKey && !event.metaKey && !isTyping(event))
        this.#pressed.add(event.code);
    });
    addEventListener('keyup', (event) => this.#pressed.delete(event.code));
    addEventListener('blur', () => this.#pressed.clear());
    this.canvas.addEventListener('pointerdown', ({ pointerId: id, pointerType, clientX: x, clientY: y }) => {
      if (this.#mode !== 'fly' || this.#locked) return;
      this.#fingers.set(id, { x, y });
      const points = this.#fingerPoints && pointerType === 'touch';
      this.#look = points || this.#fingers.size > 1 ? undefined : { id, x, y };
    });
    addEventListener('pointermove', (event) => {
      this.#turn(event);
      this.#push(event);
    });
    for (const end of ['pointerup', 'pointercancel'] as const) {
      addEventListener(end, ({ pointerId }) => {
        this.#fingers.delete(pointerId);
        if (pointerId === this.#look?.id) this.#look = undefined;
      });
    }
    this.canvas.addEventListener('wheel', ({ deltaY }) => {
      if (this.#mode === 'fly') this.#speed *= Math.exp(-deltaY * 1e-3);
    });
  }

  #turn({ pointerId, clientX, clientY }: PointerEvent): void {
    const look = this.#look;
    if (look?.id !== pointerId || this.#locked) return;
    const perPixel = MathUtils.degToRad(this.camera.fov) / this.canvas.clientHeight;
    const euler = new Euler().setFromQuaternion(this.camera.quaternion, 'YXZ');
    euler.y += (clientX - look.x) * perPixel;
    euler.x = MathUtils.clamp(euler.x + (clientY - look.y) * perPixel, -1.55, 1.55);
    euler.z = 0;
    this.camera.quaternion.setFromEuler(euler);
    Object.assign(look, { x: clientX, y: clientY });
  }

  /** Two fingers fly: dragged aside and up, spread ahead. The height of the canvas is four seconds' way. */
  #push({ pointerId, clientX, clientY }: PointerEvent): void {
    const moved = this.#fingers.get(pointerId);
    if (!moved || this.#fingers.size !== 2 || this.#locked) return;
    const [other] = [...this.#fingers].filter(([id]) => id !== pointerId).map(([, at]) => at);
    const gap = (x: number, y: number) => Math.hypot(x - other.x, y - other.y);
    const spread = gap(clientX, clientY) - gap(moved.x, moved.y);
    const step = new Vector3((moved.x - clientX) / 2, (clientY - moved.y) / 2, -spread);
    const perPixel = (4 * this.#speed) / this.canvas.clientHeight;
    this.camera.position.addScaledVector(step.applyQuaternion(this.camera.quaternion), perPixel);
    Object.assign(moved, { x: clientX, y: clientY });
  }
}

interface Pose {
  readonly position: Vector3;
  readonly rotation: Quaternion;
}

/** Whether a key goes into a field of the page. */
export function isTyping({ target }: KeyboardEvent): boolean {
  return (
    target instanceof HTMLSelectElement || (target instanceof HTMLInputElement && target.type !== 'range')
  );
}
