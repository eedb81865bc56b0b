import {
  halfBits,
  hasSameShape,
  isVolume,
  type LightState,
  packAtlas,
  type Vec3,
  type VolumeLight,
} from '@lumencast/client';
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  HalfFloatType,
  LinearFilter,
  RGBAFormat,
  type Scene,
  Vector3,
} from 'three';
import { withMargin } from './margin.js';
import type { Platform, ProbeGrid } from './platform.js';
import { L2_VALUES, Resampler, toL2 } from './resample.js';
import { type GridPlan, mostCells, planVolumes, type Volume } from './volumes.js';

/**
 * By how many cells a grid's box is larger on each side than the volume. A grid lights nothing outside
 * its box, and samples of a pixel at the edge of a triangle lie outside the triangle: walls that bound
 * a volume would have black edges. Probes appear displaced by at most so much of a cell.
 */
const GROWTH = 0.05;

/**
 * The probe grids of a scene: made from the catalog's volumes, filled from the session's light. Each
 * owns one half-float 3D texture, whose data is replaced when the light has changed.
 */
export class ProbeGrids {
  #filled: FilledGrid[] = [];
  #volumes: readonly Volume[] = [];
  /** The most grids that the plan could have. */
  #planned = 0;
  #black = atlasTexture([1, 1, 1], new Uint16Array(4 * 7 * 3));
  #visible = true;

  /** `unitsKept`: texture units that are not for grids. */
  constructor(
    private readonly scene: Scene,
    private readonly platform: Platform,
    private readonly unitsKept: () => number = () => 0,
  ) {}

  /** Replaces the grids by those for these volumes; returns what could not be shown as meant. */
  setVolumes(volumes: readonly Volume[]): readonly string[] {
    this.#volumes = volumes;
    return this.#plan();
  }

  /** Replaces the grids where the scene now leaves units for more or fewer; returns as {@link setVolumes}. */
  fit(): readonly string[] {
    return this.#mostGrids() === this.#planned ? [] : this.#plan();
  }

  #mostGrids(): number {
    const free = this.platform.freeUnits(this.scene) - this.unitsKept();
    return Math.max(0, Math.min(free, this.#volumes.length));
  }

  #plan(): readonly string[] {
    const { platform } = this;
    this.#planned = this.#mostGrids();
    const plan = planVolumes(this.#volumes, {
      grids: this.#planned,
      textureSize: platform.max3DTextureSize,
    });
    this.#clear();
    const maxCells = mostCells(platform.max3DTextureSize);
    this.#filled = plan.grids
      .map((grid) => withMargin(grid, plan.grids, maxCells))
      .map((grid, priority) => new FilledGrid(grid, priority, platform));
    for (const { grid } of this.#filled) this.scene.add(grid);
    this.visible = this.#visible;
    return plan.warnings;
  }

  /** The grids, coarse before fine. */
  get grids(): readonly ProbeGrid[] {
    return this.#filled.map(({ grid }) => grid);
  }

  /** Whether indirect light is shown. The grids stay in the scene, as removing them recompiles every shader. */
  get visible(): boolean {
    return this.#visible;
  }

  set visible(visible: boolean) {
    this.#visible = visible;
    for (const filled of this.#filled) filled.show(visible, this.#black);
  }

  /** Takes over light that has changed; true when some had. */
  update(light: LightState): boolean {
    const volumes = light.fields.filter(isVolume);
    return this.#filled.map((filled) => filled.update(volumes)).includes(true);
  }

  dispose(): void {
    this.#clear();
    this.#black.dispose();
  }

  #clear(): void {
    for (const filled of this.#filled) {
      this.scene.remove(filled.grid);
      filled.dispose();
    }
    this.#filled = [];
  }
}

class FilledGrid {
  readonly grid: ProbeGrid;
  readonly #texture: Data3DTexture;
  readonly #atlas: Uint16Array<ArrayBuffer>;
  readonly #resampler: Resampler | undefined;
  readonly #coefficients: Float32Array;
  /** Of what the light says of its field, whether it is of the shape that is planned for. */
  readonly #isPlanned = new WeakMap<Volume, boolean>();
  #revisions = '';
  #scale = 1;
  #visible = true;

  constructor(
    private readonly plan: GridPlan,
    priority: number,
    private readonly platform: Platform,
  ) {
    const [nx, ny, nz] = plan.resolution;
    this.#atlas = new Uint16Array(nx * ny * 7 * (nz + 2) * 4);
    this.#texture = atlasTexture(plan.resolution, this.#atlas);
    this.#coefficients = new Float32Array(nx * ny * nz * L2_VALUES);
    this.#resampler = plan.exact ? undefined : new Resampler(plan);
    this.grid = platform.createGrid(plan.size, plan.resolution);
    this.grid.name = `lumencast ${plan.fields.map((field) => field.id).join('+')}`;
    this.grid.position.fromArray(plan.center);
    this.grid.priority = priority;
    this.grid.texture = this.#texture;
    this.grid.updateBoundingBox();
    const cell = plan.size.map((size, axis) => size / plan.resolution[axis]);
    this.grid.boundingBox.expandByVector(new Vector3(...cell).multiplyScalar(GROWTH));
  }

  update(volumes: readonly VolumeLight[]): boolean {
    const sources = this.plan.fields.map((field) => volumes.find((lit) => this.#isOf(field, lit.field)));
    const revisions = sources.map((source) => source?.revision).join();
    if (revisions === this.#revisions) return false;
    this.#revisions = revisions;
    this.#scale = Math.max(...sources.map((source) => source?.scale ?? 0)) || 1;
    packAtlas(this.#gather(sources), this.plan.resolution, 2, this.#scale, this.#atlas);
    if (this.platform.scaleIn === 'atlas') fillFreeChannel(this.#atlas, halfBits(Math.log2(this.#scale)));
    this.#texture.needsUpdate = true;
    this.platform.upload?.(this.#texture);
    this.#setIntensity();
    return true;
  }

  /** Whether light is that of a planned volume: until there is new light, it may be of a former shape. */
  #isOf(planned: Volume, lit: Volume): boolean {
    if (lit.id !== planned.id) return false;
    const known = this.#isPlanned.get(lit);
    if (known !== undefined) return known;
    const isPlanned = hasSameShape(lit, planned);
    this.#isPlanned.set(lit, isPlanned);
    return isPlanned;
  }

  /** L2 coefficients of the grid's own probes. */
  #gather(sources: readonly (VolumeLight | undefined)[]): Float32Array {
    if (this.#resampler) {
      this.#resampler.fill(
        sources.map((source) => source?.coefficients),
        this.#coefficients,
      );
      return this.#coefficients;
    }
    const source = sources[0];
    return source
      ? toL2(source.coefficients, source.field.shape.order, this.#coefficients)
      : this.#coefficients.fill(0);
  }

  show(visible: boolean, black: Data3DTexture): void {
    this.#visible = visible;
    // WebGPU's node keeps the texture it was built with, WebGL's shader knows no intensity.
    if (this.platform.scaleIn === 'atlas') this.grid.texture = visible ? this.#texture : black;
    this.#setIntensity();
  }

  #setIntensity(): void {
    this.grid.intensity = this.#visible ? (this.platform.scaleIn === 'intensity' ? this.#scale : 1) : 0;
  }

  dispose(): void {
    this.grid.dispose();
    this.#texture.dispose();
  }
}

/** Sets the fourth channel of the last sub-volume, its padding included. */
function fillFreeChannel(atlas: Uint16Array, half: number): void {
  for (let i = (atlas.length / 7) * 6 + 3; i < atlas.length; i += 4) atlas[i] = half;
}

function atlasTexture([nx, ny, nz]: Vec3, atlas: Uint16Array<ArrayBuffer>): Data3DTexture {
  const texture = new Data3DTexture(atlas, nx, ny, 7 * (nz + 2));
  texture.format = RGBAFormat;
  texture.type = HalfFloatType;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
  texture.generateMipmaps = false;
  texture.needsUpdate = true;
  return texture;
}
