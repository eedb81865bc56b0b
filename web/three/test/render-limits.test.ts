/**
 * What both renderers draw at the limits of a device: of its texture units, and of half floats. Skipped,
 * in words, where there is no Chromium.
 */
import { afterAll, beforeAll, beforeEach, describe, expect, it } from 'vitest';
import { chromiumProgram } from '../../testing/chromium.js';
import type { Crowd, Part } from './render/crowded.js';
import type { Source } from './render/bright.js';
import { openRenderPage, type RenderPage } from './support/render-page.js';

if (!chromiumProgram) console.log('skipped: no Chromium');

describe.skipIf(!chromiumProgram)('drawn by', () => {
  let opened: RenderPage;

  beforeAll(async () => {
    opened = await openRenderPage();
  }, 90_000);

  afterAll(() => opened?.close(), 30_000);

  beforeEach(() => void (opened.complaints.length = 0));

  describe.each(['webgl', 'webgpu'] as const)('%s,', (kind) => {
    const crowded = (parts: readonly Part[], volumes: number): Promise<Crowd> =>
      opened.page.evaluate(([kind, parts, volumes]) => window.measure!.crowded(kind, parts, volumes), [
        kind,
        parts,
        volumes,
      ] as const);

    it.each([
      { parts: [] },
      { parts: ['gltf'] },
      { parts: ['gltf', 'specular', 'clearcoat'] },
      { parts: ['glass'] },
      { parts: ['gltf', 'shadow'] },
      { parts: ['environment', 'clearcoat'] },
      { parts: ['morphs', 'specular'] },
      { parts: ['lumels', 'gltf', 'shadow'] },
    ] satisfies { parts: Part[] }[])(
      'a material of $parts takes the units that are counted',
      async ({ parts }) => {
        const { bound, counted } = await crowded(parts, 2);
        expect(counted).toBe(bound);
        expect(opened.complaints).toEqual([]);
      },
      60_000,
    );

    it('volumes share grids where a material leaves few units', async () => {
      const parts: Part[] = ['gltf', 'specular', 'clearcoat', 'glass', 'shadow'];
      const one = await crowded(parts, 1);
      const many = await crowded(parts, one.limit);
      expect(opened.complaints).toEqual([]);
      expect(one.warnings).toEqual([]);
      expect(many.warnings.join()).toMatch(/texture units are short/);
      expect(many.bound).toBe(one.limit);
      // The same light in all volumes: the picture is that of one.
      many.row.forEach((pixel, i) => expect(pixel[1]).toBeCloseTo(one.row[i][1], 2));
      expect(many.row[32][1]).toBeGreaterThan(0.1);
    }, 60_000);

    const sources: Source[] = ['sun', 'volume', 'emission', 'unlit', 'background', 'light map'];
    describe.each(sources)('%s of more than half floats hold', (source) => {
      it.each([false, true])(
        'is shown right where it is pre-exposed; through glass: %s',
        async (throughGlass) => {
          const { dim, preExposed, plain } = await opened.page.evaluate(
            ([kind, source, throughGlass]) => window.measure!.bright(kind, source, throughGlass),
            [kind, source, throughGlass] as const,
          );
          preExposed.forEach((value, i) => expect(Math.abs(value - dim[i])).toBeLessThanOrEqual(1));
          expect(dim[0]).toBeGreaterThan(120);
          expect(dim[0]).toBeLessThan(200);
          // Without it, what is drawn by way of halves is burnt out, or nothing; this test can tell.
          const byHalves = kind === 'webgpu' || throughGlass;
          if (byHalves) expect(Math.abs(plain[0] - dim[0])).toBeGreaterThan(20);
          else expect(Math.abs(plain[0] - dim[0])).toBeLessThanOrEqual(1);
        },
        60_000,
      );
    });
  });
});
