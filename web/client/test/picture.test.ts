/** What codes of pictures mean. */
import { describe, expect, it } from 'vitest';

import type { PlanesPicture } from '../src/api.js';
import { halfBits } from '../src/atlas.js';
import { irradianceOf } from '../src/picture.js';

const MAPPING = { toe: 7, octaves: 12, scale: 64 } as const;

function picture(
  size: [number, number],
  codes: { y: number[]; co: number[]; cg: number[] },
  chroma: [number, number] = size,
): PlanesPicture {
  return {
    kind: 'planes',
    ...MAPPING,
    y: Uint8Array.from(codes.y),
    co: Uint8Array.from(codes.co),
    cg: Uint8Array.from(codes.cg),
    width: size[0],
    height: size[1],
    chromaWidth: chroma[0],
    chromaHeight: chroma[1],
  };
}

/** The code of irradiance, not rounded. */
function code(irradiance: number): number {
  const { toe, octaves, scale } = MAPPING;
  return (255 * Math.log2(1 + (2 ** toe * irradiance) / scale)) / octaves;
}

/** Irradiance of a code. */
function irradiance(code: number): number {
  const { toe, octaves, scale } = MAPPING;
  return (scale * (2 ** ((code / 255) * octaves) - 1)) / 2 ** toe;
}

describe('a picture of planes', () => {
  it('has no light at code 0, and at code 255 that of all octaves', () => {
    const ends = picture([2, 1], { y: [0, 255], co: [128, 128], cg: [128, 128] });
    expect(irradianceOf(ends, 2, 0, 0)).toEqual([0, 0, 0]);
    const most = (64 * (2 ** 12 - 1)) / 128;
    irradianceOf(ends, 2, 1, 0).forEach((value) => expect(value).toBeCloseTo(most, 6));
  });

  it('has octaves of equal length above the toe', () => {
    // 85 codes are a third of the 12 octaves; 1 / 2^toe times the scale, 0.5, is where the toe ends.
    const grey = picture([2, 1], { y: [170, 255], co: [128, 128], cg: [128, 128] });
    const [low, high] = [irradianceOf(grey, 2, 0, 0)[0], irradianceOf(grey, 2, 1, 0)[0]];
    expect((high + 0.5) / (low + 0.5)).toBeCloseTo(16, 6);
  });

  it('has colours within a rounding of what was coded', () => {
    for (const colour of [
      [100, 50, 25],
      [3, 800, 90],
      [0.01, 0.5, 40],
    ]) {
      const [r, g, b] = colour.map((value) => Math.round(code(value)));
      const y = Math.round((r + 2 * g + b) / 4);
      const co = Math.round((r - b) / 2 + 128);
      const cg = Math.round((-r + 2 * g - b) / 4 + 128);
      const found = irradianceOf(picture([1, 1], { y: [y], co: [co], cg: [cg] }), 1, 0, 0);
      // Rounding of the code, and of Y, Co and Cg: 2 codes at most.
      found.forEach((value, i) => expect(Math.abs(code(value) - code(colour[i]))).toBeLessThan(2));
    }
  });

  it('has codes beyond the ends cut off', () => {
    const strong = picture([1, 1], { y: [128], co: [255], cg: [128] });
    const [r, g, b] = irradianceOf(strong, 1, 0, 0);
    expect(r).toBeCloseTo(irradiance(255), 6);
    expect(g).toBeCloseTo(irradiance(128), 6);
    expect(b).toBeCloseTo(irradiance(1), 9);
    const weak = picture([1, 1], { y: [20], co: [128], cg: [255] });
    expect(irradianceOf(weak, 1, 0, 0)).toEqual([0, irradiance(147), 0]);
  });

  it('reads halved chroma between its samples, and at the edges the last', () => {
    // Two samples over four columns, two over three rows: 0 at the top left, 40 to the right, 80 below.
    const y = new Array<number>(12).fill(100);
    const co = [128, 168, 208, 248];
    const halved = picture([4, 3], { y, co, cg: [128, 128, 128, 128] }, [2, 2]);
    // Without Cg, r = Y + Co.
    const chromaAt = (x: number, row: number) => code(irradianceOf(halved, 4, x, row)[0]) - 100;
    const columns = [0, 1, 2, 3].map((x) => chromaAt(x, 0));
    [0, 10, 30, 40].forEach((wanted, x) => expect(columns[x]).toBeCloseTo(wanted, 9));
    [0, 20, 60].forEach((wanted, row) => expect(chromaAt(0, row)).toBeCloseTo(wanted, 9));
    expect(chromaAt(1, 1)).toBeCloseTo(30, 9);
  });
});

it('a picture of halves is its values times the scale', () => {
  const texels = new Uint16Array(8).fill(halfBits(1));
  texels.set([0.5, 0.25, 2].map(halfBits), 4);
  expect(irradianceOf({ kind: 'halves', scale: 8, texels }, 1, 0, 1)).toEqual([4, 2, 16]);
});
