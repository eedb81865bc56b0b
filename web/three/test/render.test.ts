/**
 * What both renderers really draw, in a headless browser, against closed forms. Skipped, in words,
 * where there is no Chromium.
 */
import type { Page } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, it } from 'vitest';
import { chromiumProgram } from '../../testing/chromium.js';
import { distanceAttenuation, spotAttenuation } from '../src/falloff.js';
import { openRenderPage, type RenderPage } from './support/render-page.js';

if (!chromiumProgram) console.log('skipped: no Chromium');

const SIZE = 64;
/** World x of a pixel of the floor's middle row; its z is half a pixel off the axis. */
const worldX = (pixel: number) => ((pixel + 0.5) / SIZE) * 4 - 2;
const HALF_PIXEL = 2 / SIZE;

describe.skipIf(!chromiumProgram)('drawn by', () => {
  let opened: RenderPage;
  let page: Page;

  beforeAll(async () => {
    opened = await openRenderPage();
    ({ page } = opened);
  }, 90_000);

  afterAll(() => opened?.close(), 30_000);

  describe.each(['webgl', 'webgpu'] as const)('%s,', (kind) => {
    it.each(['point', 'spot'] as const)(
      'a %s light falls off as in KHR_lights_punctual',
      async (type) => {
        const light = { type, height: 1.5, intensity: 10, range: 2.5, inner: 0.3, outer: 0.8 };
        const worst = async (withPlugin: boolean) => {
          const row = await page.evaluate(
            ([kind, light, withPlugin]) => window.measure!.lamp(kind, light, withPlugin),
            [kind, light, withPlugin] as const,
          );
          const errors = row.map(([, green], i) => {
            const distance = Math.hypot(worldX(i), HALF_PIXEL, light.height);
            const cos = light.height / distance;
            const cone = type === 'spot' ? spotAttenuation(light.inner, light.outer, Math.acos(cos)) : 1;
            const expected =
              (light.intensity * cone * distanceAttenuation(distance, light.range) * cos) / Math.PI;
            return Math.abs(green - expected) / (1 + expected);
          });
          return Math.max(...errors);
        };
        expect(await worst(true)).toBeLessThan(2e-3);
        // three.js' own falloff is another, and this test can tell.
        expect(await worst(false)).toBeGreaterThan(2e-2);
      },
      60_000,
    );

    it.each([
      { order: 2, scale: 1 },
      { order: 2, scale: 2 ** 17 },
      { order: 2, scale: 2 ** -12 },
      { order: 1, scale: 4 },
      { order: 4, scale: 4 },
    ])(
      'a volume of order $order and scale $scale lights a floor',
      async ({ order, scale }) => {
        // Light that grows along x, with a part from above: bands 0 and 1 of an L1 to L4 probe.
        const stride = 3 * (order + 1) ** 2;
        const coefficients = new Array<number>(4 * 2 * 3 * stride).fill(0);
        const [c0, c1] = [
          [0.5, 0.3, 0.2],
          [0.2, 0.1, 0.4],
        ];
        for (let probe = 0; probe < 24; probe++) {
          for (let c = 0; c < 3; c++) {
            coefficients[probe * stride + c] = scale * c0[c] * ((probe % 4) + 1) * 0.25;
            coefficients[probe * stride + 3 + c] = scale * c1[c] * 0.25;
          }
        }
        const row = await page.evaluate(
          ([kind, coefficients, scale, order]) => window.measure!.volume(kind, coefficients, scale, order),
          [kind, coefficients, scale, order] as const,
        );
        for (let i = 0; i < SIZE; i += 5) {
          // Probes at −1.5, −0.5, 0.5, 1.5; beyond the outermost the light stays.
          const step = Math.min(Math.max(worldX(i) + 1.5, 0), 3) + 1;
          for (let c = 0; c < 3; c++) {
            const irradiance =
              Math.PI * 0.282095 * c0[c] * step * 0.25 + ((2 * Math.PI) / 3) * 0.488603 * c1[c] * 0.25;
            expect(row[i][c] / scale).toBeCloseTo(irradiance / Math.PI, 2);
          }
        }
      },
      60_000,
    );

    it('an occlusion map dims streamed light, and no other', async () => {
      const coefficients = Array.from({ length: 24 * 27 }, (_, i) => (i % 27 < 3 ? 2 : 0));
      const light = { type: 'point' as const, height: 1.5, intensity: 10, range: 0, inner: 0, outer: 0 };
      const middle = async (occlusion: number | undefined) => {
        const [indirect, direct] = await page.evaluate(
          async ([kind, coefficients, light, occlusion]) => [
            await window.measure!.volume(kind, coefficients, 1, 2, occlusion),
            await window.measure!.lamp(kind, light, true, occlusion),
          ],
          [kind, coefficients, light, occlusion] as const,
        );
        return [indirect[SIZE / 2][0], direct[SIZE / 2][0]];
      };
      const [open, occluded] = [await middle(undefined), await middle(0.4)];
      expect(open[0]).toBeCloseTo(2 * 0.282095, 2);
      expect(occluded[0]).toBeCloseTo(0.4 * open[0], 3);
      expect(occluded[1]).toBeCloseTo(open[1], 5);
    }, 60_000);

    it('an environment picture stands as the server has it', async () => {
      // −Z red, +X green, −X blue, and white behind: u = ½ + atan2(x, −z) / 2π.
      const uri = hdr([WHITE, BLUE, RED, GREEN]);
      const axes: [number, number, number][] = [
        [0, 0, -1],
        [1, 0, 0],
        [-1, 0, 0],
        [0, 0, 1],
      ];
      const turned = (rotation: number) =>
        page.evaluate(([kind, environment, axes]) => window.measure!.environment(kind, environment, axes), [
          kind,
          { type: 'image' as const, uri, intensity: 2, rotation },
          axes,
        ] as const);
      expect((await turned(0)).map(strongest)).toEqual(['r', 'g', 'b', 'w']);
      // What was ahead is to the left after a quarter turn about +Y.
      expect((await turned(Math.PI / 2)).map(strongest)).toEqual(['g', 'w', 'r', 'b']);
      const [red] = await turned(0);
      expect(red[0]).toBeCloseTo(2, 1);
    }, 60_000);

    it('a sky is linear in the sine of the elevation', async () => {
      const sky = {
        type: 'sky' as const,
        zenith: [0, 0, 8] as const,
        horizon: [4, 4, 4] as const,
        ground: [2, 0, 0] as const,
      };
      const seen = await page.evaluate(
        ([kind, sky]) =>
          window.measure!.environment(kind, sky as never, [
            [0, 0.6, -0.8],
            [0, -0.6, -0.8],
          ]),
        [kind, sky] as const,
      );
      [1.6, 1.6, 6.4].forEach((value, channel) => expect(seen[0][channel]).toBeCloseTo(value, 1));
      [2.8, 1.6, 1.6].forEach((value, channel) => expect(seen[1][channel]).toBeCloseTo(value, 1));
    }, 60_000);
  });
});

type Rgbe = readonly [number, number, number, number];
// 128 · 2^(129−136) = 1.
const [RED, GREEN, BLUE, WHITE]: Rgbe[] = [
  [128, 0, 0, 129],
  [0, 128, 0, 129],
  [0, 0, 128, 129],
  [128, 128, 128, 129],
];

/** A Radiance picture of vertical stripes, each centred on a multiple of a quarter of its width, as data URL. */
function hdr(quarters: readonly Rgbe[]): string {
  const [width, height] = [64, 32];
  const header = `#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y ${height} +X ${width}\n`;
  const row = Array.from({ length: width }, (_, x) => quarters[Math.floor(x / 16 + 0.5) % 4]);
  // Old, flat encoding: rows as they are.
  const bytes = [...Buffer.from(header), ...Array.from({ length: height }, () => row.flat()).flat()];
  return `data:application/octet-stream;base64,${Buffer.from(bytes).toString('base64')}`;
}

function strongest([r, g, b]: readonly number[]): string {
  if (Math.min(r, g, b) > 0.9) return 'w';
  return 'rgb'[[r, g, b].indexOf(Math.max(r, g, b))];
}
