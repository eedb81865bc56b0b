/**
 * The model of a region's values: which numbers are coded, in which order, with which predictions and
 * contexts (docs/wire.md, "What is coded"). The twin of `codec/src/probe/model.rs`, to the bit:
 * sums and products in f64, each value rounded once to f32.
 */
import type { Vec3 } from '../edit.js';
import { WireError } from '../wire-error.js';
import { cellCount, valuesPerProbe } from './volume-shape.js';
import { Contexts, RangeDecoder, SIGNED_CONTEXTS } from './range.js';

/** What encoder and decoder agree that a region holds. */
export interface Reconstruction {
  /** a, b, c of each coefficient, probe by probe. */
  readonly values: Float32Array;
  /** Step index of each probe. */
  readonly steps: Int16Array;
}

/** Step indices are from −400 to 400. */
const MAX_STEP = 400;
/** 1, 2^¼, 2^½, 2^¾, rounded to f32. */
const MANTISSAS = [0, 1, 2, 3].map((quarter) => Math.fround(2 ** (quarter / 4)));
/** S(q), by q + MAX_STEP. */
const STEPS = Float64Array.from({ length: 2 * MAX_STEP + 1 }, (_, i) => {
  const q = i - MAX_STEP;
  return MANTISSAS[((q % 4) + 4) % 4] * 2 ** Math.floor(q / 4);
});

/** Where the context sets begin: 3 for `skip`, then `dq`, then by channel, band and neighbourhood. */
const DQ = 3;
const RESIDUAL = DQ + SIGNED_CONTEXTS;
const BANDS = 5;
const contexts = new Contexts(RESIDUAL + 2 * BANDS * 3 * SIGNED_CONTEXTS);

/** Where the context set of a residual begins. */
function residualContexts(channel: number, band: number, near: number): number {
  const set = ((channel > 0 ? BANDS : 0) + band) * 3 + (near < 2 ? near : 2);
  return RESIDUAL + set * SIGNED_CONTEXTS;
}

/** Band l of each coefficient i = l(l+1)+m. */
const BAND = Uint8Array.from({ length: BANDS * BANDS }, (_, i) => Math.floor(Math.sqrt(i)));
const MAX_VALUES = valuesPerProbe(BANDS - 1);
const predicted = new Float64Array(MAX_VALUES);
/** Magnitudes of the residuals of this probe and of the one before. */
let current = new Int32Array(MAX_VALUES);
let previous = new Int32Array(MAX_VALUES);

/** Decodes the payload of a frame: a delta on `base`, or a keyframe when there is none. */
export function decodeRegion(
  payload: Uint8Array,
  size: Vec3,
  order: number,
  base: Reconstruction | undefined,
): Reconstruction {
  contexts.reset();
  previous.fill(0);
  const coder = new RangeDecoder(payload, contexts);
  if (!coder.valid) throw new WireError('malformed', 'start of the payload');
  const probes = cellCount(size);
  const n = valuesPerProbe(order);
  const region = { values: new Float32Array(probes * n), steps: new Int16Array(probes) };
  const { values, steps } = region;
  const skipped = new Uint8Array(probes);
  const [width, height] = size;
  for (let probe = 0; probe < probes; probe++) {
    if (coder.overrun) throw new WireError('truncated', 'the payload ends too early');
    const x = probe % width;
    const y = Math.floor(probe / width) % height;
    const start = probe * n;
    if (base) {
      const likely = (x > 0 ? skipped[probe - 1] : 0) + (y > 0 ? skipped[probe - width] : 0);
      if (coder.bit(likely)) {
        skipped[probe] = 1;
        for (let v = start; v < start + n; v++) values[v] = base.values[v];
        steps[probe] = base.steps[probe];
        previous.fill(0);
        continue;
      }
      for (let v = 0; v < n; v++) predicted[v] = base.values[start + v];
      steps[probe] = decodeStep(coder, base.steps[probe]);
    } else {
      predictFromNeighbours(values, probe, n, x > 0, y > 0 ? width : 0, width * height);
      steps[probe] = decodeStep(coder, probe > 0 ? steps[probe - 1] : 0);
    }
    decodeProbe(coder, values, start, n, STEPS[steps[probe] + MAX_STEP]);
  }
  if (coder.overrun) throw new WireError('truncated', 'the payload ends too early');
  if (!coder.atEnd) throw new WireError('malformed', 'bytes after the end');
  return region;
}

function decodeStep(coder: RangeDecoder, predictedStep: number): number {
  const q = predictedStep + coder.signed(DQ);
  // Written so that NaN, which stands for a number too long, is refused too.
  if (!(Math.abs(q) <= MAX_STEP)) throw new WireError('malformed', 'step index');
  return q;
}

/** Reads the residuals of a probe and adds them to what is predicted. */
function decodeProbe(
  coder: RangeDecoder,
  values: Float32Array,
  start: number,
  n: number,
  step: number,
): void {
  let v = 0;
  for (let i = 0; v < n; i++) {
    for (let channel = 0; channel < 3; channel++, v++) {
      const before = channel > 0 ? current[3 * i] : i > 0 ? current[3 * i - 3] : 0;
      const residual = coder.signed(residualContexts(channel, BAND[i], before + previous[v]));
      values[start + v] = predicted[v] + residual * step;
      // A number too long (NaN) and one past all floats end here alike.
      if (!Number.isFinite(values[start + v])) throw new WireError('malformed', 'a value is not finite');
      current[v] = Math.abs(residual);
    }
  }
  [current, previous] = [previous, current];
}

/** Means of the values of the neighbours at x−1, y−1, z−1 that there are. */
function predictFromNeighbours(
  values: Float32Array,
  probe: number,
  n: number,
  hasLeft: boolean,
  row: number,
  slice: number,
): void {
  predicted.fill(0, 0, n);
  let count = 0;
  for (const back of [hasLeft ? 1 : 0, row, probe >= slice ? slice : 0]) {
    if (back === 0) continue;
    count++;
    const from = (probe - back) * n;
    for (let v = 0; v < n; v++) predicted[v] += values[from + v];
  }
  if (count > 1) for (let v = 0; v < n; v++) predicted[v] /= count;
}
