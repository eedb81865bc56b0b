/** Light that changes under a scene that stands still, drawn by WebGPURenderer on both of its backends. */
import { afterAll, beforeAll, describe, expect, it } from 'vitest';
import { chromiumProgram } from '../../testing/chromium.js';
import { openRenderPage, type RenderPage } from './support/render-page.js';

if (!chromiumProgram) console.log('skipped: no Chromium');

describe.skipIf(!chromiumProgram)('WebGPURenderer', () => {
  let opened: RenderPage;

  beforeAll(async () => {
    opened = await openRenderPage();
  }, 90_000);

  afterAll(() => opened?.close(), 30_000);

  it.each(['webgpu', 'webgl'] as const)(
    'draws each change of light on its %s backend, with one texture a grid',
    async (backend) => {
      const radiances = [undefined, 2, 4, 1, 0];
      const drawn = await opened.page.evaluate(
        ([forceWebGL, radiances]) => window.measure!.changing(forceWebGL, radiances),
        [backend === 'webgl', radiances] as const,
      );
      expect(drawn.backend).toBe(backend);
      radiances.forEach((radiance = 0, i) => expect(drawn.seen[i]).toBeCloseTo(radiance, 2));
      expect(new Set(drawn.textures).size).toBe(1);
      expect(drawn.left).toBeLessThan(drawn.textures[0]);
    },
    60_000,
  );
});
