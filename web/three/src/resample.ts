import { type Vec3, valuesPerProbe } from '@lumencast/client';
import { conjugate, type GridPlan, rotate, type Volume } from './volumes.js';

/** Values of an L2 probe: nine coefficients of three channels. */
export const L2_VALUES = valuesPerProbe(2);

/**
 * Fills a grid's probes from fields by trilinear interpolation. A probe takes the first field whose
 * box holds it, else the nearest one, whose outermost probes go on unchanged outside its box.
 * Where to read and how much is worked out once; an update is one pass over the values.
 */
export class Resampler {
  /** Index into `plan.fields` for each probe. */
  readonly #source: Uint8Array;
  /** Eight probe indices and weights a probe. */
  readonly #corner: Uint32Array;
  readonly #weight: Float32Array;

  constructor(readonly plan: GridPlan) {
    const probes = plan.resolution[0] * plan.resolution[1] * plan.resolution[2];
    this.#source = new Uint8Array(probes);
    this.#corner = new Uint32Array(probes * 8);
    this.#weight = new Float32Array(probes * 8);
    for (let probe = 0; probe < probes; probe++) this.#place(probe);
  }

  #place(probe: number): void {
    const { plan } = this;
    const position = probePosition(plan, probe);
    const distances = plan.fields.map((field) => outside(field, position));
    const source = distances.indexOf(Math.min(...distances));
    this.#source[probe] = source;
    const { resolution, size } = plan.fields[source].shape.grid;
    const axes = volumeFromWorld(plan.fields[source], position).map((p, axis) => {
      const n = resolution[axis];
      const cell = Math.min(Math.max(snapped((p / size[axis] + 0.5) * n - 0.5), 0), n - 1);
      const low = Math.min(Math.floor(cell), Math.max(n - 2, 0));
      return { low, high: Math.min(low + 1, n - 1), weight: cell - low };
    });
    for (let corner = 0; corner < 8; corner++) {
      const picks = axes.map(({ low, high, weight }, axis) =>
        (corner >> axis) & 1 ? { cell: high, weight } : { cell: low, weight: 1 - weight },
      );
      const [x, y, z] = picks.map((pick) => pick.cell) as Vec3;
      this.#corner[probe * 8 + corner] = (z * resolution[1] + y) * resolution[0] + x;
      this.#weight[probe * 8 + corner] = picks.reduce((product, pick) => product * pick.weight, 1);
    }
  }

  /**
   * Writes L2 coefficients of all the grid's probes into `out`. `coefficients` holds, for each of the
   * plan's fields, its values, or nothing while none have come: such probes are dark.
   */
  fill(coefficients: readonly (Float32Array | undefined)[], out: Float32Array): void {
    out.fill(0);
    const strides = this.plan.fields.map((field) => valuesPerProbe(field.shape.order));
    for (let probe = 0; probe < this.#source.length; probe++) {
      const source = this.#source[probe];
      const from = coefficients[source];
      if (from === undefined) continue;
      const stride = strides[source];
      const values = Math.min(stride, L2_VALUES);
      for (let corner = probe * 8; corner < probe * 8 + 8; corner++) {
        const weight = this.#weight[corner];
        if (weight === 0) continue;
        const first = this.#corner[corner] * stride;
        const to = probe * L2_VALUES;
        for (let i = 0; i < values; i++) out[to + i] += weight * from[first + i];
      }
    }
  }
}

/** Coefficients of any order as L2: higher bands are dropped, missing ones are 0. */
export function toL2(coefficients: Float32Array, order: number, out: Float32Array): Float32Array {
  if (order === 2) return coefficients;
  const stride = valuesPerProbe(order);
  const values = Math.min(stride, L2_VALUES);
  for (let from = 0, to = 0; from < coefficients.length; from += stride, to += L2_VALUES) {
    for (let i = 0; i < values; i++) out[to + i] = coefficients[from + i];
  }
  return out;
}

/** A place among probes; that of a probe itself where it is one but for rounding. */
function snapped(cell: number): number {
  const nearest = Math.round(cell);
  return Math.abs(cell - nearest) < 1e-4 ? nearest : cell;
}

function probePosition({ center, size, resolution }: GridPlan, probe: number): Vec3 {
  const [nx, ny] = resolution;
  const cell = [probe % nx, Math.floor(probe / nx) % ny, Math.floor(probe / (nx * ny))];
  return cell.map((c, axis) => center[axis] + ((c + 0.5) / resolution[axis] - 0.5) * size[axis]) as Vec3;
}

/** A world position in a volume's box: metres from its centre along its axes. */
function volumeFromWorld({ shape: { grid } }: Volume, position: Vec3): Vec3 {
  return rotate(conjugate(grid.rotation), position.map((p, axis) => p - grid.center[axis]) as Vec3);
}

/** Distance from a volume's box, 0 inside. */
function outside(field: Volume, position: Vec3): number {
  const local = volumeFromWorld(field, position);
  return Math.hypot(
    ...local.map((p, axis) => Math.max(Math.abs(p) - field.shape.grid.size[axis] / 2 - 1e-6, 0)),
  );
}
