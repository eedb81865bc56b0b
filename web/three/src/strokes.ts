import {
  BufferGeometry,
  Float32BufferAttribute,
  type Material,
  Mesh,
  OrthographicCamera,
  Scene,
} from 'three';
import type { Paint, PlanesPaint, Stroke } from './platform.js';

/** How dark every other lumel of a checkerboard is. */
export const DARK = 0.1;

/** A material for each kind of paint. */
export type PaintMaterials = Readonly<Record<Paint['kind'], Material>>;

/** Meshes that paint strokes, made as many as are needed. */
export class Strokes {
  readonly scene = new Scene();
  /** Sees the whole texture, in lumels. */
  readonly camera: OrthographicCamera;
  readonly #square = square();
  readonly #meshes: Mesh[] = [];
  #strokes: readonly Stroke[] = [];
  /** Called before each is drawn. */
  onDraw: (stroke: Stroke) => void = () => {};

  /** `isFirstRowOnTop`: whether pictures begin with their upper row on the device. */
  constructor(
    private readonly materials: PaintMaterials,
    width: number,
    height: number,
    isFirstRowOnTop: boolean,
  ) {
    const [top, bottom] = isFirstRowOnTop ? [0, height] : [height, 0];
    this.camera = new OrthographicCamera(0, width, top, bottom, -1, 1);
  }

  /** Puts these on the scene, in place of the last ones. */
  set(strokes: readonly Stroke[]): void {
    this.#strokes = strokes;
    while (this.#meshes.length < strokes.length) this.#add();
    this.#meshes.forEach((mesh, i) => {
      const stroke = strokes[i];
      mesh.visible = stroke !== undefined;
      if (!stroke) return;
      mesh.material = this.materials[stroke.paint.kind];
      mesh.position.set(stroke.x, stroke.y, 0);
      mesh.scale.set(stroke.width, stroke.height, 1);
    });
  }

  #add(): void {
    const mesh = new Mesh(this.#square);
    mesh.frustumCulled = false;
    const number = this.#meshes.push(mesh) - 1;
    mesh.onBeforeRender = () => this.onDraw(this.#strokes[number]);
    this.scene.add(mesh);
  }

  dispose(): void {
    this.#square.dispose();
    for (const material of Object.values(this.materials)) material.dispose();
  }
}

/** From 0, 0 to 1, 1. */
function square(): BufferGeometry {
  const corners = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0];
  return new BufferGeometry()
    .setAttribute('position', new Float32BufferAttribute(corners, 3))
    .setIndex([0, 1, 2, 0, 2, 3]);
}

/** Columns and rows of lumels that a sample of chroma stands for: 2 or 1. */
export function lumelsPerChroma({ y, co }: PlanesPaint): readonly [number, number] {
  const per = (side: 'width' | 'height') => (co.image[side] < y.image[side] ? 2 : 1);
  return [per('width'), per('height')];
}
