import type { Vec3 } from '../../src/edit.js';
import { valuesPerProbe } from '../../src/codec/volume-shape.js';
import { RangeEncoder } from './range-encoder.js';

/** What a frame's header says; see docs/wire.md. */
export interface FrameInfo {
  update: number;
  base?: number;
  tick?: number;
  sceneVersion?: number;
  time?: number;
  scaleLog2?: number;
}

/** A region as its encoder holds it: a, b, c of each coefficient, and a step index a probe. */
export interface EncodedRegion {
  frame: Uint8Array;
  values: Float32Array;
  steps: Int16Array;
}

const SET = 16;

/**
 * A plain encoder of probe frames, written from docs/wire.md apart from the decoder: rounds to the
 * nearest step, skips probes that stay within half a step.
 */
export function encodeProbes(
  target: Float32Array,
  size: Vec3,
  order: number,
  q: number,
  info: FrameInfo,
  base?: EncodedRegion,
): EncodedRegion {
  const n = valuesPerProbe(order);
  const probes = size[0] * size[1] * size[2];
  const step = Math.fround(2 ** ((((q % 4) + 4) % 4) / 4)) * 2 ** Math.floor(q / 4);
  const coder = new RangeEncoder();
  const values = new Float32Array(probes * n);
  const steps = new Int16Array(probes).fill(q);
  const skipped: boolean[] = [];
  let previous = new Array<number>(n).fill(0);
  for (let p = 0; p < probes; p++) {
    const x = p % size[0];
    const y = Math.floor(p / size[0]) % size[1];
    const z = Math.floor(p / (size[0] * size[1]));
    const range = Array.from({ length: n }, (_, v) => v);
    let predicted: number[];
    let stepBefore: number;
    if (base) {
      const likely = (x > 0 && skipped[p - 1] ? 1 : 0) + (y > 0 && skipped[p - size[0]] ? 1 : 0);
      skipped[p] = range.every((v) => Math.abs(target[p * n + v] - base.values[p * n + v]) <= step / 2);
      coder.bit(likely, skipped[p]);
      predicted = range.map((v) => base.values[p * n + v]);
      stepBefore = base.steps[p];
      if (skipped[p]) {
        values.set(predicted, p * n);
        steps[p] = stepBefore;
        previous = range.map(() => 0);
        continue;
      }
    } else {
      const near = [x > 0 ? p - 1 : -1, y > 0 ? p - size[0] : -1, z > 0 ? p - size[0] * size[1] : -1];
      const there = near.filter((i) => i >= 0);
      predicted = range.map((v) =>
        there.length ? there.reduce((sum, i) => sum + values[i * n + v], 0) / there.length : 0,
      );
      stepBefore = p > 0 ? steps[p - 1] : 0;
    }
    coder.signed(3, q - stepBefore);
    const residuals: number[] = [];
    for (let v = 0; v < n; v++) {
      const i = Math.floor(v / 3);
      const k = v % 3;
      const residual = Math.round((target[p * n + v] - predicted[v]) / step);
      const before = k > 0 ? residuals[3 * i] : i > 0 ? residuals[3 * i - 3] : 0;
      const near = Math.min(2, Math.abs(before) + Math.abs(previous[v]));
      const band = Math.floor(Math.sqrt(i));
      coder.signed(3 + SET + (((k > 0 ? 5 : 0) + band) * 3 + near) * SET, residual);
      residuals.push(residual);
      values[p * n + v] = predicted[v] + residual * step;
    }
    previous = residuals;
  }
  return { frame: join(header(info, order, size), coder.finish()), values, steps };
}

function header(info: FrameInfo, order: number, size: Vec3): Uint8Array {
  return join(frameHead(info), [order, ...size]);
}

/** What frames of light of any kind begin with. */
export function frameHead(info: FrameInfo): Uint8Array {
  const bytes = [1, info.base === undefined ? 1 : 0];
  bytes.push(...varint(info.update), ...varint(info.base === undefined ? 0 : info.update - info.base));
  bytes.push(...varint(info.sceneVersion ?? 0), ...varint(info.tick ?? info.update));
  bytes.push(...new Uint8Array(new Float64Array([info.time ?? 0]).buffer));
  bytes.push((info.scaleLog2 ?? 0) & 0xff);
  return Uint8Array.from(bytes);
}

export function varint(value: number): number[] {
  const bytes = [];
  for (; value >= 128; value = Math.floor(value / 128)) bytes.push((value % 128) | 0x80);
  return [...bytes, value];
}

export function join(...parts: (Uint8Array | number[])[]): Uint8Array {
  return Uint8Array.from(parts.flatMap((part) => [...part]));
}
