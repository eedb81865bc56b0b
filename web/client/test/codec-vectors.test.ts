import { describe, expect, it } from 'vitest';

import { layerOf } from '../src/codec/probe-header.js';
import { ProbeDecoder } from '../src/codec/probes.js';
import type { Vec3 } from '../src/edit.js';
import { WireError } from '../src/wire-error.js';
import { bytesOf, fnv, readVectors } from './support/vectors.js';

interface Vectors {
  sequences: {
    name: string;
    size: Vec3;
    order: number;
    frames: {
      bytes: string;
      update: number;
      layer: number;
      base: number | null;
      tick: number;
      time: number;
      scene_version: number;
      scale_log2: number;
      /** FNV-1a of the coefficients' f32 bits. */
      coefficients: number;
      first: Vec3;
    }[];
  }[];
  malformed: { name: string; bytes: string; error: string }[];
  /** One byte of a frame changed: the hash of what is decoded then, null where it is refused. */
  mutations: { sequence: number; frame: number; offset: number; byte: number; coefficients: number | null }[];
}

const vectors = readVectors<Vectors>('codec');

describe('vectors/codec.json', () => {
  for (const { name, size, order, frames } of vectors.sequences) {
    it(`decodes to the recorded bits: ${name}`, () => {
      const decoder = new ProbeDecoder(size, order);
      for (const frame of frames) {
        const { header, coefficients } = decoder.decode(bytesOf(frame.bytes));
        expect(fnv(coefficients)).toBe(frame.coefficients);
        expect([...coefficients.subarray(0, 3)]).toEqual(frame.first.map(Math.fround));
        expect(layerOf(header.update)).toBe(frame.layer);
        expect(header).toMatchObject({
          update: frame.update,
          base: frame.base ?? undefined,
          tick: frame.tick,
          time: frame.time,
          sceneVersion: frame.scene_version,
          scale: 2 ** frame.scale_log2,
        });
      }
    });
  }

  for (const { name, bytes, error } of vectors.malformed) {
    it(`refuses ${name}`, () => {
      const decoder = new ProbeDecoder([2, 1, 1], 2);
      expect(() => decoder.decode(bytesOf(bytes))).toThrow(expect.objectContaining({ kind: error }));
    });
  }

  it('decodes or refuses mutated frames as Rust does', () => {
    for (const [index, mutation] of vectors.mutations.entries()) {
      const { size, order, frames } = vectors.sequences[mutation.sequence];
      const decoder = new ProbeDecoder(size, order);
      for (const frame of frames.slice(0, mutation.frame)) decoder.decode(bytesOf(frame.bytes));
      const bytes = bytesOf(frames[mutation.frame].bytes);
      bytes[mutation.offset] = mutation.byte;
      expect(hashOrNull(decoder, bytes), `mutation ${index}`).toBe(mutation.coefficients);
    }
  });
});

function hashOrNull(decoder: ProbeDecoder, bytes: Uint8Array): number | null {
  try {
    return fnv(decoder.decode(bytes).coefficients);
  } catch (error) {
    if (error instanceof WireError) return null;
    throw error;
  }
}
