/** `vectors/lumels.json`, which Rust reads too: lumel frames, and what they decode to. */
import { describe, expect, it } from 'vitest';

import { halfValue } from '../src/codec/half.js';
import { tileOf } from '../src/codec/lightmap-shape.js';
import { LumelDecoder, type TileLight } from '../src/codec/lumels.js';
import { slopeOf, STEEPEST } from '../src/slopes.js';
import { WireError } from '../src/wire-error.js';
import { bytesOf, fnv, readVectors } from './support/vectors.js';

type Size = [number, number];

interface Vectors {
  sequences: {
    name: string;
    size: Size;
    frames: {
      bytes: string;
      update: number;
      base: number | null;
      tick: number;
      time: number;
      scene_version: number;
      scale_log2: number;
      /** FNV-1a of the irradiance's f32 bits. */
      irradiance: number;
      first: [number, number, number];
      changed: boolean;
    }[];
  }[];
  malformed: { name: string; bytes: string; error: string }[];
  /** One byte of a frame changed: the hash of what is decoded then, null where it is refused. */
  slopes: { region: number; size: Size; bytes: string; first: [number, number, number][] };
  mutations: { sequence: number; frame: number; offset: number; byte: number; irradiance: number | null }[];
}

const vectors = readVectors<Vectors>('lumels');

/** r, g, b of each lumel, lux. */
function irradianceOf({ texels, header }: TileLight): Float32Array {
  const values = texels.filter((_, i) => i % 4 < 3);
  return Float32Array.from(values, (half) => halfValue(half) * header.scale);
}

describe('vectors/lumels.json', () => {
  for (const { name, size, frames } of vectors.sequences) {
    it(`decodes to the recorded bits: ${name}`, () => {
      const decoder = new LumelDecoder(size);
      for (const frame of frames) {
        const light = decoder.decode(bytesOf(frame.bytes));
        const irradiance = irradianceOf(light);
        expect(fnv(irradiance)).toBe(frame.irradiance);
        expect([...irradiance.subarray(0, 3)]).toEqual(frame.first.map(Math.fround));
        // 1 as a half.
        expect(light.texels.every((half, i) => i % 4 < 3 || half === 0x3c00)).toBe(true);
        // A keyframe's lumels are not compared.
        expect(light.changed).toBe(frame.changed || frame.base === null);
        expect(light.header).toMatchObject({
          update: frame.update,
          base: frame.base ?? undefined,
          tick: frame.tick,
          time: frame.time,
          sceneVersion: frame.scene_version,
          scale: 2 ** frame.scale_log2,
          size,
        });
      }
    });
  }

  it('tells slopes by light', () => {
    const { region, size, bytes, first } = vectors.slopes;
    const shape = { coding: 'halves', pageSize: 8, pages: 1, slopes: true, layout: '' } as const;
    expect(tileOf(shape, region)).toMatchObject({ page: 0, slopes: true, size });
    const told = irradianceOf(new LumelDecoder(size).decode(bytesOf(bytes)));
    first.flat().forEach((slope, i) => expect(slopeOf(told[i])).toBeCloseTo(slope, 5));
    expect(first[0][0]).toBe(STEEPEST);
  });

  for (const { name, bytes, error } of vectors.malformed) {
    it(`refuses ${name}`, () => {
      const decoder = new LumelDecoder([9, 9]);
      expect(() => decoder.decode(bytesOf(bytes))).toThrow(expect.objectContaining({ kind: error }));
    });
  }

  it('decodes or refuses mutated frames as Rust does, and is none the worse for it', () => {
    for (const [index, mutation] of vectors.mutations.entries()) {
      const { size, frames } = vectors.sequences[mutation.sequence];
      const decoder = new LumelDecoder(size);
      for (const frame of frames.slice(0, mutation.frame)) decoder.decode(bytesOf(frame.bytes));
      const good = frames[mutation.frame];
      const bytes = bytesOf(good.bytes);
      bytes[mutation.offset] = mutation.byte;
      const hash = hashOrNull(decoder, bytes);
      expect(hash, `mutation ${index}`).toBe(mutation.irradiance);
      if (hash !== null) continue;
      expect(hashOrNull(decoder, bytesOf(good.bytes)), `after mutation ${index}`).toBe(good.irradiance);
    }
  });
});

function hashOrNull(decoder: LumelDecoder, bytes: Uint8Array): number | null {
  try {
    return fnv(irradianceOf(decoder.decode(bytes)));
  } catch (error) {
    if (error instanceof WireError) return null;
    throw error;
  }
}
