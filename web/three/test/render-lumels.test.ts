/**
 * Light at lumels as both renderers draw it, in a headless browser, against closed forms. Skipped, in words,
 * where there is no Chromium.
 */
import { afterAll, beforeAll, beforeEach, describe, expect, it } from 'vitest';
import { chromiumProgram } from '../../testing/chromium.js';
import { GAMMA } from '../src/handover.js';
import { DARK } from '../src/strokes.js';
import type { Drawer, Picture, Step } from './render/lumels.js';
import type { Radiance } from './render/stage.js';
import { openRenderPage, type RenderPage } from './support/render-page.js';

if (!chromiumProgram) console.log('skipped: no Chromium');

const TILE = 8;
const SIZE = 64;
/** Irradiance at a lumel: red grows with columns, green with rows. */
const GRADIENT = Array.from({ length: TILE * TILE }, (_, i) => [
  1 + (i % TILE),
  20 + 3 * Math.floor(i / TILE),
  5,
]);
/** Light on the way from one to another: its codes on a display change evenly. */
const between = (from: number, to: number, way: number) =>
  ((1 - way) * from ** (1 / GAMMA) + way * to ** (1 / GAMMA)) ** GAMMA;
const even = (value: number) => new Array<number[]>(TILE * TILE).fill([value, value, value]);
const halves = (irradiance: readonly number[][], scale = 1): Picture => ({
  kind: 'halves',
  scale,
  irradiance,
});

/** Lumels from the first one at a pixel of the left floor, between the middles of the outermost lumels. */
const lumelAt = (pixel: number) => ((pixel + 0.5) / (SIZE / 2)) * (TILE - 1);
/** Pixels of the left floor, its middle, and one of the right one. */
const LEFT = [0, 5, 13, 16, 24, 31];
const MIDDLE = 16;
const RIGHT = 48;

describe.skipIf(!chromiumProgram)('lumels', () => {
  let opened: RenderPage;

  beforeAll(async () => {
    opened = await openRenderPage();
  }, 90_000);

  afterAll(() => opened?.close(), 30_000);

  beforeEach(() => void (opened.complaints.length = 0));

  describe.each(['webgl', 'webgpu', 'fallback'] as const)('drawn by %s', (kind: Drawer) => {
    const rows = (steps: readonly Step[], areCopies = false): Promise<Radiance[][]> =>
      opened.page.evaluate(([kind, steps, areCopies]) => window.measure!.lumels(kind, steps, areCopies), [
        kind,
        steps,
        areCopies,
      ] as const);

    /** Of steps whose tiles are of one value, irradiance of the left floor, and radiance of the right one. */
    const middles = async (steps: readonly Step[]) =>
      (await rows(steps)).map((row) => [row[MIDDLE][0] * Math.PI, row[RIGHT][0]]);

    it.each([1, 2 ** 17, 2 ** -12])(
      'light in place of probes, at a scale of %s',
      async (scale) => {
        const scaled = GRADIENT.map((rgb) => rgb.map((value) => value * scale));
        const [without, row, after] = await rows([
          {},
          { tiles: { 0: { picture: halves(scaled, scale * 32), revision: 1 } } },
        ]);
        for (const pixel of LEFT) {
          const at = lumelAt(pixel);
          const expected = [1 + at, 20 + 3 * at, 5];
          expected.forEach((value, c) => {
            expect((row[pixel][c] * Math.PI) / scale / value).toBeCloseTo(1, 2);
            expect(without[pixel][c]).toBeCloseTo(1, 2);
            expect(after[pixel][c]).toBe(0);
          });
        }
        expect(row[RIGHT][0]).toBeCloseTo(1, 2);
        expect(opened.complaints).toEqual([]);
      },
      60_000,
    );

    it('show what video pictures mean, chroma between its samples', async () => {
      const [scale, toe, octaves] = [4, 7, 11.75];
      const n = TILE * TILE;
      for (const chroma of [TILE, TILE / 2]) {
        const picture: Picture = {
          ...{ kind: 'planes', scale, toe, octaves, chroma },
          y: Array.from({ length: n }, (_, i) => 100 + 4 * (i % TILE)),
          // In even steps: read between samples, it is as even.
          co: Array.from({ length: chroma * chroma }, (_, i) => 120 + (24 / chroma) * (i % chroma)),
          cg: Array.from({ length: chroma * chroma }, (_, i) => 110 + (32 / chroma) * Math.floor(i / chroma)),
        };
        const [row] = await rows([{ tiles: { 0: { picture, revision: 1 } } }]);
        // At lumels' middles nothing is filtered but chroma.
        for (const lumel of [2, 3, 4, 5]) {
          const sample = chroma === TILE ? lumel : lumel / 2 - 0.25;
          const [y, co, cg] = [100 + 4 * lumel, (24 / chroma) * sample - 8, (32 / chroma) * sample - 18];
          const codes = [y - cg + co, y + cg, y - cg - co];
          const light = codes.map((code) => (scale * (2 ** ((code / 255) * octaves) - 1)) / 2 ** toe);
          light.forEach((value, c) => {
            expect((interpolated(row, lumel)[c] * Math.PI) / value).toBeCloseTo(1, 1.5);
          });
        }
      }
      expect(opened.complaints).toEqual([]);
    }, 60_000);

    it('go over from one picture to the next, and know all of it in the end', async () => {
      const tile = (value: number, revision: number, shown: number): Step => ({
        tiles: { 0: { picture: halves(even(value), 16), revision, shown } },
      });
      const seen = await middles([
        tile(2, 1, 0.3),
        tile(10, 2, 0),
        tile(10, 2, 0.25),
        tile(10, 2, 0.5),
        // Another one comes on the way: it goes on from what is shown.
        tile(0, 3, 0.5),
        tile(0, 3, 1),
        tile(5, 4, 1),
      ]);
      // There is no way from nothing.
      [2, 2, 4, 6, 3, 0, 5].forEach((value, i) => expect(seen[i][0]).toBeCloseTo(value, 2));
    }, 60_000);

    it('keep tiles apart, in their places, through changes of scale', async () => {
      const tiles = (scale: number, first: number) => ({
        0: { picture: halves(even(3), scale), revision: first },
        3: { picture: halves(even(7), scale), revision: first },
      });
      const seen = await rows([
        { tiles: tiles(8, 1) },
        { turned: true },
        { tiles: { 0: { picture: halves(even(4), 1024), revision: 2 } } },
        { turned: false },
      ]);
      // From below, left is right.
      const expected = [
        [3, MIDDLE],
        [7, SIZE - MIDDLE],
        [7, SIZE - MIDDLE],
        [4, MIDDLE],
      ];
      expected.forEach(([value, x], i) => expect(seen[i][x][0] * Math.PI).toBeCloseTo(value, 2));
    }, 60_000);

    it('have strengths of their own, and are exposed as all light is', async () => {
      const lit = { tiles: { 0: { picture: halves(even(3)), revision: 1 } } };
      const seen = await middles([
        lit,
        { strengths: { static: 0.5, dynamic: 1 } },
        { strengths: { static: 1, dynamic: 0.25 } },
        { strengths: { static: 1, dynamic: 1 }, preExposure: 0.5 },
        { preExposure: 1, show: 'direct' },
        { show: 'both' },
      ]);
      const expected = [
        [3, 1],
        [1.5, 1],
        [3, 0.25],
        [1.5, 0.5],
        [0, 0],
        [3, 1],
      ];
      expected.forEach((pair, i) => pair.forEach((value, j) => expect(seen[i][j]).toBeCloseTo(value, 2)));
    }, 60_000);

    it('leave what moves to probes, and come back with it', async () => {
      const lit = { tiles: { 0: { picture: halves(even(9), 16), revision: 1 } } };
      const [part, whole] = [{ after: 250 }, { after: 500 }];
      const seen = await middles([lit, { moved: 0.5 }, part, part, part, { moved: 0 }, part, whole]);
      const half = between(Math.PI, 9, 0.5);
      const expected = [9, 9, half, Math.PI, Math.PI, Math.PI, half, 9];
      expected.forEach((value, i) => expect(seen[i][0]).toBeCloseTo(value, 2));
    }, 60_000);

    it('make a share of the light while layouts change, on both sides', async () => {
      const lit = {
        tiles: {
          0: { picture: halves(even(9), 16), revision: 1 },
          3: { picture: halves(even(5), 16), revision: 1 },
        },
      };
      const seen = await rows([
        { ...lit, named: false },
        { named: true },
        { after: 250 },
        { turned: true, after: 0 },
        { turned: false, strengths: { static: 0.5, dynamic: 0.25 }, after: 0 },
        { named: false, strengths: { static: 1, dynamic: 1 }, after: 0 },
        { after: 125 },
        { after: 125 },
      ]);
      const half = between(Math.PI, 9, 0.5);
      const expected = [
        ...[Math.PI, Math.PI, half, between(Math.PI, 5, 0.5)],
        ...[between(0.25 * Math.PI, 0.5 * 9, 0.5), half, between(Math.PI, 9, 0.25), Math.PI],
      ];
      // From below, left is right.
      expected.forEach((value, i) => {
        expect(seen[i][i === 3 ? SIZE - MIDDLE : MIDDLE][0] * Math.PI).toBeCloseTo(value, 2);
      });
      expect(opened.complaints).toEqual([]);
    }, 60_000);

    it('come without a jump: in thirty even frames at 60 Hz', async () => {
      const lit = { tiles: { 0: { picture: halves(even(9), 16), revision: 1 } } };
      const frames = Array.from({ length: 31 }, () => ({}));
      const [, ...seen] = await middles([{ ...lit, named: false }, { named: true }, ...frames]);
      // The last one is without lumels.
      seen.pop();
      const code = (value: number) => value ** (1 / GAMMA);
      const step = (code(9) - code(Math.PI)) / 30;
      seen.forEach(([value], i) => {
        expect(value).toBeCloseTo(between(Math.PI, 9, Math.min(i / 30, 1)), 2);
        if (i > 0) expect(Math.abs(code(value) - code(seen[i - 1][0]))).toBeLessThan(step + 0.002);
      });
      expect(seen.at(-1)![0]).toBeCloseTo(9, 2);
    }, 60_000);

    it('of copies of a mesh are each one’s own', async () => {
      const tiles = [halves(GRADIENT, 32), halves(even(7), 16), undefined, halves(even(5), 16)];
      const lit = Object.fromEntries(
        tiles.flatMap((picture, tile) => (picture ? [[tile, { picture, revision: 1 }]] : [])),
      );
      const [above, below, moved, half] = await rows(
        [{ tiles: lit }, { turned: true }, { turned: false, moved: 0.5 }, { after: 250 }],
        true,
      );
      for (const pixel of LEFT) expect(above[pixel][0] * Math.PI).toBeCloseTo(1 + lumelAt(pixel), 1);
      expect(above[RIGHT][0] * Math.PI).toBeCloseTo(7, 2);
      // From below, left is right, and its copy's back has none.
      expect(below[SIZE - MIDDLE][0] * Math.PI).toBeCloseTo(5, 2);
      expect(below[SIZE - RIGHT][0]).toBeCloseTo(1, 2);
      expect(moved[RIGHT][0] * Math.PI).toBeCloseTo(7, 2);
      expect(half[RIGHT][0] * Math.PI).toBeCloseTo(between(Math.PI, 7, 0.5), 2);
      expect(opened.complaints).toEqual([]);
    }, 60_000);

    it('light normal maps from where light comes, once slopes tell it', async () => {
      // The normal map leans along x, by codes of 8 bits.
      const bump = [204, 128, 230] as const;
      const [x, z] = [(2 * 204) / 255 - 1, (2 * 230) / 255 - 1];
      const length = Math.hypot(x, z, 1 / 255);
      const shading = [x / length, z / length];
      const slope = [1, 0.5, -0.5];
      const told = new Array<number[]>(TILE * TILE).fill(slope.map((s) => (1 + s / 3) / 2));
      const slopes = (picture: Picture, revision: number) => ({
        0: { picture, revision },
        3: { picture, revision },
      });
      const tiles = slopes(halves(even(3), 16), 1);
      const seen = await rows([
        { tiles, bump },
        { slopes: slopes(halves(told), 2) },
        { turned: true },
        { turned: false, look: 'lumels' },
        { look: 'light' },
      ]);
      // On the back the normal and the map's lean are turned about.
      const tilt = slope[0] * shading[0] + slope[1] * (shading[1] - 1);
      const expected = [3, 3 * (1 + tilt), 3 * (1 - tilt), undefined, 3 * (1 + tilt)];
      expected.forEach((value, i) => {
        if (value === undefined) return;
        expect(seen[i][i === 2 ? SIZE - MIDDLE : MIDDLE][0] * Math.PI).toBeCloseTo(value, 1);
      });
      expect(tilt).toBeGreaterThan(0.4);
      expect(seen[1][RIGHT][0]).toBeCloseTo(1, 2);
      expect(opened.complaints).toEqual([]);
    }, 60_000);

    it('are seen as a checkerboard', async () => {
      const lit = { tiles: { 0: { picture: halves(even(3)), revision: 1 } } };
      const [, row] = await rows([lit, { look: 'lumels' }]);
      // Along the diagonal all are bright; between two of them dark ones are mixed in.
      for (const pixel of LEFT) {
        const part = lumelAt(pixel) % 1;
        expect(row[pixel][0]).toBeCloseTo(0.8 * (1 - 2 * part * (1 - part) * (1 - DARK)), 2);
      }
    }, 60_000);
  });
});

/** A row of the left floor at a lumel's middle, which may lie between two pixels. */
function interpolated(row: readonly Radiance[], lumel: number): Radiance {
  const at = (lumel / (TILE - 1)) * (SIZE / 2) - 0.5;
  const [pixel, part] = [Math.floor(at), at % 1];
  return row[pixel].map((value, c) => value + part * (row[pixel + 1][c] - value)) as Radiance;
}
