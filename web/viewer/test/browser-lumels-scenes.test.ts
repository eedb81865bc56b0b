/** Light at lumels in larger scenes: a building with a gap to the light, and one of many pages of lumels. */
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { buildPage, look, openPage, PATIENCE, type Pixel, settle, sum } from './browser.js';
import { lit, setStrengths } from './lumels.js';
import { freePort, lumencastProgram, Server, sharedScene } from './server.js';

const VIEWPORT = { width: 480, height: 270 };
/** What is as bright as this, of 255 a channel and in sum, is not dark. */
const BRIGHT = 24;

const sponza = sharedScene('sponza/Sponza.glb');
/** `seen`: the meshes with lumels, all that stand still. */
const scenes = [
  { name: 'door', scene: 'door', pages: 1, seen: 10 },
  ...(sponza ? [{ name: 'Sponza', scene: sponza, pages: 3, seen: 25 }] : []),
];

let folder: string;
let browser: Browser;

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), 'lumencast-lumels-scenes-'));
  await buildPage(folder);
  browser = await launchBrowser();
});

afterAll(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

/** The part of pixels that are bright in one picture, of those that are in another. */
function shareLeft(before: readonly Pixel[], after: readonly Pixel[]): number {
  const bright = [...before.keys()].filter((i) => sum(before[i]) > BRIGHT);
  expect(bright.length).toBeGreaterThan(before.length / 3);
  return bright.filter((i) => sum(after[i]) > BRIGHT).length / bright.length;
}

/** The indirect light of a picture, with strengths of static and of dynamic surfaces. */
async function indirect(page: Page, still: number, moving: number): Promise<Pixel[]> {
  await setStrengths(page, still, moving);
  return look(page, 'indirect');
}

/** The light of a page, by the fields that the server is to have, at an exposure or the one that suits. */
async function opened<T>(
  scene: string,
  fields: string,
  judge: (page: Page) => Promise<T>,
  exposure?: number,
): Promise<T> {
  const options = ['--page', folder, '--fields', fields];
  const server = await Server.start(lumencastProgram(), scene, await freePort(), options);
  try {
    const errors: string[] = [];
    const page = await openPage(browser, server.address, VIEWPORT, {}, errors);
    await settle(page, 50);
    if (exposure) await page.evaluate((it) => (window.lumencast!.viewer.exposure = it), exposure);
    else await page.evaluate(() => window.lumencast!.viewer.meter());
    const judged = await judge(page);
    expect(errors).toEqual([]);
    await page.close();
    return judged;
  } finally {
    await server.kill();
  }
}

it.each(scenes)(
  '$name has the light of lumels on what stands still, nearly wherever probes have some',
  async ({ scene, pages, seen }) => {
    const byLumels = await opened(scene, 'lightmap,volume', async (page) => {
      await expect.poll(() => lit(page), { timeout: PATIENCE }).toBe(seen);
      const had = await page.evaluate(() => window.lumencast!.stats().lumels?.pages);
      expect(had).toBe(pages);
      const all = await indirect(page, 1, 1);
      expect(shareLeft(all, await indirect(page, 0, 1))).toBeLessThan(0.15);
      const exposure = await page.evaluate(() => window.lumencast!.viewer.exposure);
      return { all, exposure };
    });
    const byProbes = await opened(scene, 'volume', (page) => indirect(page, 1, 1), byLumels.exposure);
    expect(shareLeft(byProbes, byLumels.all)).toBeGreaterThan(0.8);
  },
  600_000,
);
