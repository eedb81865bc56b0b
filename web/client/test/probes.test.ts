import { describe, expect, it } from 'vitest';

import { valuesPerProbe } from '../src/codec/volume-shape.js';
import { ProbeDecoder } from '../src/codec/probes.js';
import type { Vec3 } from '../src/edit.js';
import { WireError } from '../src/wire-error.js';
import { type EncodedRegion, encodeProbes } from './support/probe-encoder.js';
import { random } from './support/random.js';

const K = { a: 1 / Math.sqrt(3), b: Math.SQRT1_2, c: 1 / Math.sqrt(6) };

/** Smooth light with some noise, as a, b, c. */
function light(size: Vec3, order: number, scale: number, seed: number): Float32Array {
  const next = random(seed);
  const n = valuesPerProbe(order);
  return Float32Array.from({ length: size[0] * size[1] * size[2] * n }, (_, i) => {
    const falloff = 1 / (1 + (i % n));
    return scale * falloff * (Math.sin(0.2 * Math.floor(i / n)) + 0.1 * (next() - 0.5));
  });
}

describe('probe frames', () => {
  for (const order of [1, 2, 3, 4]) {
    for (const size of [
      [1, 1, 1],
      [3, 5, 2],
      [8, 8, 8],
      [16, 1, 16],
    ] as Vec3[]) {
      it(`decodes a keyframe and a delta of order ${order} and ${size} cells`, () => {
        const decoder = new ProbeDecoder(size, order);
        const first = light(size, order, 1e5, 1);
        const q = Math.floor(4 * Math.log2(1e5 * 0.01));
        const key = encodeProbes(first, size, order, q, { update: 0, scaleLog2: 17, tick: 7 });
        const decoded = decoder.decode(key.frame);
        expect(decoded.header).toMatchObject({
          update: 0,
          base: undefined,
          tick: 7,
          scale: 2 ** 17,
          order,
          size,
        });
        expectRgb(decoded.coefficients, key.values);

        const delta = encodeProbes(
          light(size, order, 1e5, 2),
          size,
          order,
          q - 3,
          { update: 4, base: 0 },
          key,
        );
        expectRgb(decoder.decode(delta.frame).coefficients, delta.values);
      });
    }
  }

  it('stays within one step of what was encoded', () => {
    const size: Vec3 = [4, 4, 4];
    const target = light(size, 2, 10, 3);
    const { values } = encodeProbes(target, size, 2, -8, { update: 0 });
    // S(−8) = 1/4.
    expect(Math.max(...values.map((v, i) => Math.abs(v - target[i])))).toBeLessThanOrEqual(0.25);
  });

  it('reads large residuals through the Exp-Golomb escape', () => {
    const size: Vec3 = [2, 1, 1];
    const target = new Float32Array(2 * 12).fill(0).map((_, i) => [0, 14, -15, 16, 1000, -70000][i % 6]);
    const { frame, values } = encodeProbes(target, size, 1, 0, { update: 0 });
    expect([...values]).toEqual([...target]);
    expectRgb(new ProbeDecoder(size, 1).decode(frame).coefficients, values);
  });

  it('loses nothing but rate when upper layers are dropped', () => {
    const size: Vec3 = [4, 3, 2];
    const all = new ProbeDecoder(size, 2);
    const lowest = new ProbeDecoder(size, 2);
    const sent: EncodedRegion[] = [];
    for (let update = 0; update < 40; update++) {
      const back = update % 4 === 0 ? 4 : update % 2 === 0 ? 2 : 1;
      const base = update === 0 ? {} : { base: update - back };
      const info = { update, ...base };
      sent.push(encodeProbes(light(size, 2, 5, update), size, 2, -20, info, sent[update - back]));
      const decoded = all.decode(sent[update].frame);
      expectRgb(decoded.coefficients, sent[update].values);
      if (update % 4 === 0) expect(lowest.decode(sent[update].frame)).toEqual(decoded);
    }
  });

  it('names a lost base, and goes on after it', () => {
    const size: Vec3 = [2, 2, 2];
    const decoder = new ProbeDecoder(size, 1);
    const u0 = encodeProbes(light(size, 1, 1, 0), size, 1, -20, { update: 0 });
    const u4 = encodeProbes(light(size, 1, 1, 1), size, 1, -20, { update: 4, base: 0 }, u0);
    const u8 = encodeProbes(light(size, 1, 1, 2), size, 1, -20, { update: 8, base: 4 }, u4);
    decoder.decode(u0.frame);
    expect(kindOf(() => decoder.decode(u8.frame))).toBe('missing_base');
    decoder.decode(u4.frame);
    expectRgb(decoder.decode(u8.frame).coefficients, u8.values);
  });

  it('is total: damaged frames give light or a WireError', () => {
    const size: Vec3 = [5, 4, 3];
    const next = random(11);
    const key = encodeProbes(light(size, 2, 100, 5), size, 2, 0, { update: 4, scaleLog2: 7 });
    const delta = encodeProbes(light(size, 2, 100, 6), size, 2, 0, { update: 8, base: 4 }, key);
    const kinds = new Map<string, number>();
    for (let round = 0; round < 6000; round++) {
      const decoder = new ProbeDecoder(size, 2);
      decoder.decode(key.frame);
      const bytes = (round % 2 ? key : delta).frame.slice();
      for (let hits = 1 + next() * 4; hits >= 1; hits--)
        bytes[Math.floor(next() * bytes.length)] = next() * 256;
      const cut = next() < 0.3 ? bytes.subarray(0, next() * bytes.length) : bytes;
      const kind = kindOf(() => {
        const { coefficients } = decoder.decode(cut);
        expect(coefficients.every(Number.isFinite)).toBe(true);
      });
      kinds.set(kind, (kinds.get(kind) ?? 0) + 1);
    }
    // The damage must have reached the payload too, or this has shown nothing.
    for (const kind of ['none', 'truncated', 'version', 'malformed', 'limit', 'missing_base']) {
      expect(kinds.get(kind) ?? 0, kind).toBeGreaterThan(0);
    }
  });

  it('refuses frames of another size or order before it allocates', () => {
    const { frame } = encodeProbes(light([2, 2, 2], 1, 1, 0), [2, 2, 2], 1, 0, { update: 0 });
    expect(kindOf(() => new ProbeDecoder([2, 2, 1], 1).decode(frame))).toBe('mismatch');
    expect(kindOf(() => new ProbeDecoder([2, 2, 2], 2).decode(frame))).toBe('mismatch');
  });
});

function kindOf(action: () => unknown): string {
  try {
    action();
    return 'none';
  } catch (error) {
    if (error instanceof WireError) return error.kind;
    throw error;
  }
}

/** Compares decoded colours with the encoder's a, b, c. */
function expectRgb(rgb: Float32Array, abc: Float32Array): void {
  expect(rgb.length).toBe(abc.length);
  for (let i = 0; i < abc.length; i += 3) {
    const [a, b, c] = abc.subarray(i, i + 3);
    const expected = [K.a * a + K.b * b - K.c * c, K.a * a + 2 * K.c * c, K.a * a - K.b * b - K.c * c];
    const size = Math.hypot(a, b, c);
    for (let k = 0; k < 3; k++) {
      if (Math.abs(rgb[i + k] - expected[k]) > 1e-6 * size) {
        expect.fail(`value ${i + k}: ${rgb[i + k]} instead of ${expected[k]}`);
      }
    }
  }
}
