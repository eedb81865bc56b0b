import { halfBits } from '../../src/atlas.js';
import { type FrameInfo, frameHead, join, varint } from './probe-encoder.js';
import { RangeEncoder } from './range-encoder.js';

/** A tile as its encoder holds it: Y, Co and Cg of each lumel. */
export interface EncodedTile {
  frame: Uint8Array;
  channels: number[][];
}

type Size = readonly [number, number];
const BLOCK = 8;
const MORE = 17;
const SECOND = 12 * MORE;
const NEGATIVE = SECOND + MORE + 1;
const RESIDUAL = NEGATIVE + 9;

/**
 * A plain encoder of lumel frames, written from docs/wire.md apart from the decoder. `irradiance` has r, g, b
 * of each lumel; changes are told by their neighbours where that gives smaller numbers.
 */
export function encodeLumels(
  irradiance: readonly number[],
  [width, height]: Size,
  info: FrameInfo,
  base?: EncodedTile,
): EncodedTile {
  const scale = 2 ** (info.scaleLog2 ?? 0);
  const count = width * height;
  const channels = Array.from({ length: count }, (_, at) =>
    channelsOf(irradiance.slice(3 * at, 3 * at + 3).map((value) => halfBits(value / scale))),
  );
  const changes = channels.map((own, at) => own.map((value, k) => value - (base?.channels[at][k] ?? 0)));
  const coder = new RangeEncoder();
  const residuals = Array.from({ length: count }, () => [0, 0, 0]);
  const across = Math.ceil(width / BLOCK);
  const skipped: boolean[] = [];
  for (let block = 0; block < across * Math.ceil(height / BLOCK); block++) {
    const lumels = lumelsOf(block, across, [width, height]);
    let nearby = true;
    if (base) {
      const left = block % across > 0 && skipped[block - 1] ? 1 : 0;
      const above = block >= across && skipped[block - across] ? 1 : 0;
      skipped[block] = lumels.every((at) => changes[at].every((change) => change === 0));
      coder.bit(left + above, skipped[block]);
      if (skipped[block]) continue;
      const apart = lumels.flatMap((at) => changes[at]);
      const told = lumels.flatMap((at) => changes[at].map((d, k) => d - likely(changes, at, k, width)));
      nearby = digits(told) < digits(apart);
      coder.bit(3, nearby);
    }
    for (const at of lumels) {
      for (let k = 0; k < 3; k++) {
        const west = at % width > 0 ? residuals[at - 1][k] : 0;
        const north = at >= width ? residuals[at - width][k] : 0;
        const residual = changes[at][k] - (nearby ? likely(changes, at, k, width) : 0);
        const luma = k > 0 ? residuals[at][0] : 0;
        encodeResidual(coder, k > 0 ? 4 + RESIDUAL : 4, [west, north, luma], residual);
        residuals[at][k] = residual;
      }
    }
  }
  const size = [...varint(width), ...varint(height)];
  return { frame: join(frameHead(info), size, coder.finish()), channels };
}

function channelsOf([r, g, b]: number[]): number[] {
  const co = r - b;
  const t = b + (co >> 1);
  const cg = g - t;
  return [t + (cg >> 1), co, cg];
}

function lumelsOf(block: number, across: number, [width, height]: Size): number[] {
  const [x0, y0] = [BLOCK * (block % across), BLOCK * Math.floor(block / across)];
  const lumels = [];
  for (let y = y0; y < Math.min(y0 + BLOCK, height); y++) {
    for (let x = x0; x < Math.min(x0 + BLOCK, width); x++) lumels.push(y * width + x);
  }
  return lumels;
}

/** The median edge detector. */
function likely(changes: number[][], at: number, k: number, width: number): number {
  const west = at % width > 0 ? changes[at - 1][k] : undefined;
  const north = at >= width ? changes[at - width][k] : undefined;
  if (west === undefined || north === undefined) return west ?? north ?? 0;
  const [low, high] = [Math.min(west, north), Math.max(west, north)];
  return Math.min(Math.max(west + north - changes[at - width - 1][k], low), high);
}

function digits(values: number[]): number {
  return values.reduce((sum, value) => sum + bits(value), 0);
}

function bits(value: number): number {
  return value === 0 ? 0 : Math.abs(value).toString(2).length;
}

function encodeResidual(coder: RangeEncoder, set: number, near: readonly number[], value: number): void {
  const [west, north] = near;
  const kind = Math.min(11, bits(near.reduce((sum, residual) => sum + Math.abs(residual), 0)));
  const count = bits(value);
  for (let j = 0; j < MORE && j <= count; j++) coder.bit(set + kind * MORE + j, j < count);
  if (count === 0) return;
  const text = Math.abs(value).toString(2);
  for (let j = 1; j < count; j++) {
    if (j === 1) coder.bit(set + SECOND + count, text[j] === '1');
    else coder.evenBit(text[j] === '1');
  }
  const sign = (residual: number) => Math.sign(residual) + 1;
  coder.bit(set + NEGATIVE + 3 * sign(west) + sign(north), value < 0);
}
