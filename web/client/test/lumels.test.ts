/** Decoding of lumel frames, by an encoder of the tests' own. */
import { describe, expect, it } from 'vitest';

import { halfValue } from '../src/codec/half.js';
import { LumelDecoder } from '../src/codec/lumels.js';
import { WireError } from '../src/wire-error.js';
import { encodeLumels } from './support/lumel-encoder.js';
import type { FrameInfo } from './support/probe-encoder.js';
import { random } from './support/random.js';

const SIZE = [21, 11] as const;
const COUNT = SIZE[0] * SIZE[1];

/** Light that falls off, with some noise. */
function light(seed: number): number[] {
  const next = random(seed);
  return Array.from(
    { length: 3 * COUNT },
    (_, i) => (100 / (1 + Math.floor(i / 3))) * (1 + 0.1 * (next() - 0.5)),
  );
}

/** r, g, b of each lumel. */
function values(texels: Uint16Array, scale = 1): number[] {
  return [...texels].filter((_, i) => i % 4 < 3).map((half) => halfValue(half) * scale);
}

/** Expects values within half a step of half floats, which is 2⁻¹¹ of each. */
function expectNear(found: readonly number[], wanted: readonly number[]): void {
  expect(found.length).toBe(wanted.length);
  found.forEach((value, i) => expect(Math.abs(value - wanted[i])).toBeLessThanOrEqual(wanted[i] * 2 ** -11));
}

describe('half floats', () => {
  it('have the values that they stand for', () => {
    const known: [number, number][] = [
      [0, 0],
      [1, 2 ** -24],
      [0x3ff, 1023 * 2 ** -24],
      [0x400, 2 ** -14],
      [0x3c00, 1],
      [0x3c01, 1 + 2 ** -10],
      [0x7bff, 65_504],
    ];
    for (const [bits, value] of known) expect(halfValue(bits)).toBe(value);
  });
});

describe('a tile', () => {
  it('comes out as it went in, keyframe and deltas', () => {
    const decoder = new LumelDecoder(SIZE);
    let base = encodeLumels(light(1), SIZE, { update: 5 });
    expectNear(values(decoder.decode(base.frame).texels), light(1));
    for (let update = 6; update < 12; update++) {
      base = encodeLumels(light(update), SIZE, { update, base: update - 1 }, base);
      const { texels, changed, header } = decoder.decode(base.frame);
      expect([changed, header.update]).toEqual([true, update]);
      expectNear(values(texels), light(update));
    }
  });

  it('is divided by a scale', () => {
    const decoder = new LumelDecoder(SIZE);
    const bright = light(1).map((value) => value * 2 ** 20);
    const { frame } = encodeLumels(bright, SIZE, { update: 0, scaleLog2: 20 });
    const { texels, header } = decoder.decode(frame);
    expectNear(values(texels, header.scale), bright);
  });

  it('tells whether anything has changed', () => {
    const decoder = new LumelDecoder(SIZE);
    const key = encodeLumels(light(1), SIZE, { update: 0 });
    const before = decoder.decode(key.frame);
    expect(before.changed).toBe(true);
    const same = encodeLumels(light(1), SIZE, { update: 1, base: 0 }, key);
    const after = decoder.decode(same.frame);
    expect(after.changed).toBe(false);
    expect(after.texels).toBe(before.texels);
    const one = light(1).with(3 * COUNT - 1, 77);
    const next = decoder.decode(encodeLumels(one, SIZE, { update: 2, base: 1 }, same).frame);
    expect(next.changed).toBe(true);
    expectNear(values(next.texels), one);
    // The same lumels at another scale are another light.
    const halved = light(1).map((value) => value / 2);
    const key2 = encodeLumels(halved, SIZE, { update: 3, scaleLog2: -1 });
    decoder.decode(key2.frame);
    const told = encodeLumels(light(1), SIZE, { update: 4, base: 3 }, key2);
    expect(decoder.decode(told.frame).changed).toBe(true);
  });

  it('stays as it was when a frame is refused', () => {
    const decoder = new LumelDecoder(SIZE);
    const key = encodeLumels(light(1), SIZE, { update: 0 });
    const { texels } = decoder.decode(key.frame);
    const kept = texels.slice();
    const delta = encodeLumels(light(2), SIZE, { update: 1, base: 0 }, key);
    expect(() => decoder.decode(delta.frame.subarray(0, 60))).toThrow(WireError);
    expect(texels).toEqual(kept);
    expectNear(values(decoder.decode(delta.frame).texels), light(2));
  });

  const refused: [string, string, readonly [number, number], FrameInfo][] = [
    ['of another size', 'mismatch', [20, 11], { update: 1 }],
    ['whose base was lost', 'missing_base', SIZE, { update: 3, base: 2 }],
    ['too bright for 32 bits', 'malformed', SIZE, { update: 1, scaleLog2: 127 }],
  ];
  it.each(refused)('refuses a frame %s', (_, kind, size, info) => {
    const bright = Array.from({ length: 3 * size[0] * size[1] }, () => 4 * 2 ** (info.scaleLog2 ?? 0));
    const base = info.base === undefined ? undefined : encodeLumels(bright, size, { update: 2 });
    const { frame } = encodeLumels(bright, size, info, base);
    const decoder = new LumelDecoder(SIZE);
    decoder.decode(encodeLumels(light(1), SIZE, { update: 0 }).frame);
    expect(() => decoder.decode(frame)).toThrow(expect.objectContaining({ kind }));
  });

  it('may be as bright as 32 bits hold', () => {
    const bright = Array.from({ length: 3 * COUNT }, () => 1.5 * 2 ** 127);
    const { frame } = encodeLumels(bright, SIZE, { update: 0, scaleLog2: 127 });
    const { texels, header } = new LumelDecoder(SIZE).decode(frame);
    expect(values(texels, header.scale)).toEqual(bright);
  });

  it('is not replaced by a late frame', () => {
    const decoder = new LumelDecoder(SIZE);
    const key = encodeLumels(light(1), SIZE, { update: 4 });
    decoder.decode(key.frame);
    decoder.decode(encodeLumels(light(9), SIZE, { update: 3 }).frame);
    const delta = encodeLumels(light(2), SIZE, { update: 5, base: 4 }, key);
    expectNear(values(decoder.decode(delta.frame).texels), light(2));
  });
});
