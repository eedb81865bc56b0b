import { describe, expect, it } from 'vitest';

import { atlasLayout, halfBits, packAtlas } from '../src/atlas.js';
import { valuesPerProbe } from '../src/codec/volume-shape.js';
import type { Vec3 } from '../src/edit.js';
import { random } from './support/random.js';
import { readVectors } from './support/vectors.js';

/** What a half is worth, from its definition. */
function halfValue(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 1023;
  return sign * (exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15));
}

describe('halves', () => {
  it('round-trip: all finite ones', () => {
    for (let bits = 0; bits < 0x7c00; bits++) {
      expect(halfBits(halfValue(bits))).toBe(bits);
      expect(halfBits(-halfValue(bits))).toBe(bits | 0x8000);
    }
  });

  it('are the nearest, ties to even', () => {
    const next = random(1);
    for (let i = 0; i < 20000; i++) {
      const value = Math.fround((next() < 0.5 ? -1 : 1) * 2 ** (next() * 42 - 26));
      const bits = halfBits(value);
      const error = Math.abs(halfValue(bits) - value);
      for (const other of [bits - 1, bits + 1]) {
        if ((other & 0x7fff) > 0x7bff || (other & 0x8000) !== (bits & 0x8000)) continue;
        const otherError = Math.abs(halfValue(other) - value);
        expect(error < otherError || (error === otherError && bits % 2 === 0)).toBe(true);
      }
    }
  });

  it('are always finite', () => {
    expect([65504, 65519, 65520, 1e30, Infinity].map(halfBits)).toEqual(Array(5).fill(0x7bff));
    expect(halfBits(-Infinity)).toBe(0xfbff);
    expect(halfBits(NaN)).toBe(0);
  });
});

describe('the atlas', () => {
  it('has 3, 7, 12, 19 sub-volumes for orders 1 to 4, each padded', () => {
    expect([1, 2, 3, 4].map((order) => atlasLayout([2, 3, 4], order).subVolumes)).toEqual([3, 7, 12, 19]);
    expect(atlasLayout([2, 3, 4], 2)).toEqual({ width: 2, height: 3, depth: 42, subVolumes: 7 });
  });

  it('holds value v of a probe in channel v mod 4 of sub-volume v div 4, slices copied at both ends', () => {
    const resolution: Vec3 = [2, 3, 4];
    for (const order of [1, 2, 3, 4]) {
      const n = valuesPerProbe(order);
      const scale = 8;
      // Every value tells where it belongs, within what a half holds exactly.
      const coefficients = Float32Array.from({ length: 24 * n }, (_, i) => scale * (i % 2039));
      const { width, height, depth } = atlasLayout(resolution, order);
      const atlas = packAtlas(coefficients, resolution, order, scale);
      expect(atlas.length).toBe(width * height * depth * 4);
      for (let i = 0; i < atlas.length; i++) {
        const [channel, x, y] = [i % 4, Math.floor(i / 4) % 2, Math.floor(i / 8) % 3];
        const slice = Math.floor(i / 24);
        const [sub, padded] = [Math.floor(slice / 6), slice % 6];
        const z = Math.min(Math.max(padded - 1, 0), 3);
        const v = sub * 4 + channel;
        const expected = v < n ? (((z * 3 + y) * 2 + x) * n + v) % 2039 : 0;
        if (halfValue(atlas[i]) !== expected)
          expect.fail(`half ${i} is ${halfValue(atlas[i])}, not ${expected}`);
      }
    }
  });

  it('is written into an array of the right size, and no other', () => {
    const coefficients = new Float32Array(27);
    const target = new Uint16Array(7 * 3 * 4);
    expect(packAtlas(coefficients, [1, 1, 1], 2, 1, target)).toBe(target);
    expect(() => packAtlas(coefficients, [1, 1, 1], 2, 1, new Uint16Array(3))).toThrow(RangeError);
    expect(() => packAtlas(coefficients, [1, 1, 2], 2, 1)).toThrow(RangeError);
  });

  const { atlas: vectors } = readVectors<{
    atlas: {
      coefficients: Vec3[];
      resolution: Vec3;
      order: number;
      scale_log2: number;
      size: Vec3;
      halves: number[];
    }[];
  }>('sh');
  for (const { coefficients, resolution, order, scale_log2, size, halves } of vectors) {
    it(`of order ${order} is that of vectors/sh.json`, () => {
      const { width, height, depth } = atlasLayout(resolution, order);
      expect([width, height, depth]).toEqual(size);
      const atlas = packAtlas(Float32Array.from(coefficients.flat()), resolution, order, 2 ** scale_log2);
      expect([...atlas]).toEqual(halves);
    });
  }
});
