import { isHidden, isPunctualLight, type LumencastLight, type PunctualLight } from '@lumencast/three';
import {
  Box3,
  type Camera,
  CanvasTexture,
  type Color,
  DirectionalLight,
  Group,
  type Object3D,
  Raycaster,
  Sprite,
  SpriteMaterial,
  Vector2,
  Vector3,
} from 'three';
import { TransformControls } from 'three/addons/controls/TransformControls.js';
import type { Touch } from './touch.js';

export type Gizmo = 'translate' | 'rotate' | 'scale';

/** Share of the scene's extent past which a click does not take hold of an object: walls and houses. */
const TOO_LARGE = 0.7;

/**
 * Selecting and dragging: a click takes the light glyph or object under the pointer, a gizmo moves it.
 */
export class Selection {
  /** Glyphs and gizmo: what is drawn over the scene and is no part of it. */
  readonly overlay = new Group();
  onChange: (object: Object3D | undefined) => void = () => {};
  /** True while the gizmo is dragged. */
  dragging = false;

  readonly #controls: TransformControls;
  readonly #glyphs = new Map<PunctualLight, Sprite>();
  readonly #raycaster = new Raycaster();
  #selected: Object3D | undefined;
  #pressed: { x: number; y: number } | undefined;

  constructor(
    private readonly light: LumencastLight,
    private readonly content: Object3D,
    private readonly camera: Camera,
    private readonly canvas: HTMLCanvasElement,
    private readonly touch: Touch,
    onDragging: (dragging: boolean) => void,
  ) {
    this.#controls = new TransformControls(camera, canvas);
    this.#controls.setSize(0.8);
    this.overlay.add(this.#controls.getHelper());
    this.#controls.addEventListener('dragging-changed', ({ value }) => {
      this.dragging = value === true;
      onDragging(this.dragging);
      this.#hold();
    });
    this.#controls.addEventListener('objectChange', () => this.#hold());
    canvas.addEventListener('pointerdown', ({ clientX: x, clientY: y }) => (this.#pressed = { x, y }));
    canvas.addEventListener('pointerup', (event) => this.#click(event));
  }

  get selected(): Object3D | undefined {
    return this.#selected;
  }

  select(object: Object3D | undefined): void {
    this.#selected = object;
    // A directional light has no place; sliders turn it.
    if (object && !(object instanceof DirectionalLight))
      this.#controls.attach(this.light.content.carrier(object));
    else this.#controls.detach();
    this.onChange(object);
  }

  set gizmo(mode: Gizmo) {
    this.#controls.setMode(mode);
  }

  get gizmo(): Gizmo {
    return this.#controls.mode as Gizmo;
  }

  /** All lights of the scene that are not hidden. */
  get lights(): PunctualLight[] {
    const lights: PunctualLight[] = [];
    this.content.traverseVisible((object) => {
      if (isPunctualLight(object)) lights.push(object);
    });
    return lights;
  }

  /** The page owns what the gizmo drags from the moment that the hand takes it, also while it rests. */
  #hold(): void {
    if (this.dragging && this.#selected) this.touch.touch(this.#selected);
  }

  /** Lets glyphs follow their lights. */
  update(): void {
    this.#hold();
    const lights = this.lights.filter((light) => !(light instanceof DirectionalLight));
    for (const [light, glyph] of this.#glyphs) {
      if (lights.includes(light)) continue;
      glyph.removeFromParent();
      this.#glyphs.delete(light);
    }
    for (const light of lights) {
      let glyph = this.#glyphs.get(light);
      if (!glyph) {
        glyph = lightGlyph();
        glyph.userData.light = light;
        this.#glyphs.set(light, glyph);
        this.overlay.add(glyph);
      }
      light.getWorldPosition(glyph.position);
      setHue(glyph.material.color, light.color);
      glyph.material.opacity = light === this.#selected ? 1 : 0.75;
    }
    // What was removed from the scene cannot stay selected.
    if (this.#selected && !isBelow(this.#selected, this.content)) this.select(undefined);
  }

  #click({ clientX, clientY }: PointerEvent): void {
    const pressed = this.#pressed;
    this.#pressed = undefined;
    if (!pressed || this.dragging || Math.hypot(clientX - pressed.x, clientY - pressed.y) > 4) return;
    this.select(this.#under(clientX, clientY));
  }

  #under(clientX: number, clientY: number): Object3D | undefined {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const pointer = new Vector2(((clientX - left) / width) * 2 - 1, 1 - ((clientY - top) / height) * 2);
    this.#raycaster.setFromCamera(pointer, this.camera);
    const glyph = this.#raycaster.intersectObjects([...this.#glyphs.values()], false)[0];
    if (glyph) return glyph.object.userData.light as Object3D;
    const hits = this.#raycaster.intersectObject(this.content, true);
    const hit = hits.find(({ object }) => !isHidden(object));
    const node = hit && this.light.content.nodeOf(hit.object);
    const object = node === undefined ? undefined : this.light.content.object(node);
    return object && this.#isHandy(object) ? object : undefined;
  }

  #isHandy(object: Object3D): boolean {
    const extent = (of: Object3D) => new Box3().setFromObject(of).getSize(new Vector3()).length();
    return extent(object) < TOO_LARGE * extent(this.content);
  }
}

function isBelow(object: Object3D, root: Object3D): boolean {
  for (let at: Object3D | null = object; at; at = at.parent) if (at === root) return true;
  return false;
}

/** A colour at full brightness. */
function setHue(target: Color, color: Color): void {
  const most = Math.max(color.r, color.g, color.b, 1e-6);
  target.copy(color).multiplyScalar(1 / most);
}

let glyphTexture: CanvasTexture | undefined;

/** A small soft disc with a ring, of the same size on the screen at any distance. */
function lightGlyph(): Sprite {
  glyphTexture ??= drawGlyph();
  const material = new SpriteMaterial({
    map: glyphTexture,
    sizeAttenuation: false,
    depthTest: false,
    toneMapped: false,
    transparent: true,
  });
  const sprite = new Sprite(material);
  sprite.scale.setScalar(0.045);
  sprite.renderOrder = 10;
  return sprite;
}

function drawGlyph(): CanvasTexture {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 128;
  const context = canvas.getContext('2d')!;
  const glow = context.createRadialGradient(64, 64, 0, 64, 64, 60);
  glow.addColorStop(0, 'rgba(255,255,255,1)');
  glow.addColorStop(0.28, 'rgba(255,255,255,0.95)');
  glow.addColorStop(0.34, 'rgba(255,255,255,0.25)');
  glow.addColorStop(1, 'rgba(255,255,255,0)');
  context.fillStyle = glow;
  context.fillRect(0, 0, 128, 128);
  context.strokeStyle = 'rgba(20,20,24,0.55)';
  context.lineWidth = 4;
  context.beginPath();
  context.arc(64, 64, 22, 0, 2 * Math.PI);
  context.stroke();
  return new CanvasTexture(canvas);
}
