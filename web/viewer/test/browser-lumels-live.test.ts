/**
 * Light at lumels, live: a real server casts it as video, real pages decode and draw it, also while things
 * are moved and after the server's death.
 */
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, expect, it, vi } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { buildPage, difference, draw, look, openPage, PATIENCE, settle, shoot } from './browser.js';
import { lit, seen, setStrengths, STILL, SURFACES } from './lumels.js';
import { freePort, lumencastProgram, Server } from './server.js';

/** Small: every pixel is drawn by the processor. */
const VIEWPORT = { width: 400, height: 300 };

const program = lumencastProgram();

let folder: string;
let browser: Browser;
let server: Server;
let page: Page;
const errors: string[] = [];

/** Few probes, lumels and samples leave some of the processor to the pages. */
const start = (port: number, ...options: string[]) =>
  Server.start(program, 'cornell', port, [
    ...['--page', folder, '--samples', '4..16', '--volume', '4x4x4', '--lightmap', '64', ...options],
  ]);

/** The page at an exposure that suits lumels, and all that stands still lit by these. */
async function open(renderer: 'webgl' | 'webgpu', { address } = server): Promise<Page> {
  const page = await openPage(browser, address, VIEWPORT, { renderer }, errors);
  await page.evaluate(() => (window.lumencast!.viewer.exposure = 2 ** -1));
  await vi.waitFor(async () => expect(await lit(page)).toBe(STILL), { timeout: PATIENCE, interval: 100 });
  return page;
}

/** Pictures are compared with each other: nothing is to move by itself. */
const stopTheBall = () =>
  page.evaluate(() =>
    window.lumencast!.light.edit({ edit: 'set_animation', animation: 0, playing: false, time: 0 }),
  );

/** Kinds of the pictures of lumels, and how many there have been. */
const pictures = () =>
  page.evaluate(() => {
    const { fields } = window.lumencast!.session.light();
    const regions = fields.flatMap((field) => (field.kind === 'lightmap' ? field.regions : []));
    return {
      kinds: regions.map(({ picture }) => picture.kind),
      revision: Math.max(0, ...regions.map(({ revision }) => revision)),
    };
  });

/** Brightness of the walls' indirect light. */
async function lumelsOnWalls(): Promise<number> {
  await page.evaluate(() => window.lumencast!.setMode('indirect'));
  const walls = await seen(page);
  await page.evaluate(() => window.lumencast!.setMode('both'));
  return walls.flat().reduce((sum, value) => sum + value, 0);
}

/** Checks that the walls' indirect light is that of lumels. */
async function expectLumelsOnWalls(): Promise<void> {
  await page.evaluate(() => window.lumencast!.setMode('indirect'));
  const bright = await seen(page);
  await setStrengths(page, 0, 1);
  const dark = await seen(page);
  await setStrengths(page, 1, 1);
  await page.evaluate(() => window.lumencast!.setMode('both'));
  SURFACES.forEach(([name], i) => {
    expect(Math.max(...bright[i]), name).toBeGreaterThan(40);
    expect(Math.max(...dark[i]), name).toBeLessThan(4);
  });
}

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), 'lumencast-lumels-live-'));
  await buildPage(folder);
  browser = await launchBrowser();
  server = await start(await freePort());
  page = await open('webgl');
  await stopTheBall();
});

afterAll(async () => {
  await browser?.close();
  await server?.kill();
  rmSync(folder, { recursive: true, force: true });
});

it('comes as video, and lights what stands still', async () => {
  const first = await pictures();
  expect(first.kinds).toEqual(['planes']);
  await expectLumelsOnWalls();
  await expect.poll(async () => (await pictures()).revision).toBeGreaterThan(first.revision);
  expect(errors).toEqual([]);
});

it('is the same on two pages, whatever draws them', async () => {
  const other = await open('webgpu');
  await settle(page, 75);
  await expect.poll(async () => difference(await seen(page), await seen(other))).toBeLessThan(0.03);
  // Edges of what is drawn differ by renderer; one page is looked at after the other, while light goes on.
  const apart = async () => difference(await look(page, 'both'), await look(other, 'both'));
  await expect.poll(apart).toBeLessThan(0.05);
  await shoot(page, 'lumels-live-webgl.png');
  await shoot(other, 'lumels-live-webgpu.png');
  await other.close();
});

it('leaves what is moved, and comes back where it is put down', async () => {
  const [node, home] = await page.evaluate(() => {
    const { light, scene } = window.lumencast!;
    const box = scene.getObjectByName('tall_box')!;
    return [light.content.nodeOf(box)!, box.position.toArray()] as const;
  });
  const move = (by: number) =>
    page.evaluate(
      ([node, [x, y, z], by]) =>
        window.lumencast!.light.edit({ edit: 'move_node', node, translation: [x + by, y, z] }),
      [node, home, by] as const,
    );
  for (const by of [0.15, 0]) {
    // It is moved about until it has lost its lumels, however late that shows.
    let steps = 0;
    const moved = async () => {
      await move(0.05 + 0.05 * (steps++ % 2));
      return lit(page);
    };
    await expect.poll(moved).toBe(STILL - 1);
    await move(by);
    await expect.poll(() => lit(page)).toBe(STILL);
  }
  expect(errors).toEqual([]);
});

it('tells normal maps where light comes from, when asked to', async () => {
  const directional = await start(await freePort(), '--directional');
  const other = await open('webgl', directional);
  try {
    // Codes of the slopes' picture: some lumels have light from one side, others from another.
    const codes = () =>
      other.evaluate(() => {
        const { fields } = window.lumencast!.session.light();
        const regions = fields.flatMap((field) => (field.kind === 'lightmap' ? field.regions : []));
        const slopes = regions.filter(({ slopes }) => slopes).map(({ picture }) => picture);
        return slopes.map((picture) => (picture.kind === 'planes' ? new Set(picture.y).size : 0));
      });
    await expect.poll(async () => Math.max(...(await codes()))).toBeGreaterThan(20);
    expect(await codes()).toHaveLength(1);
    // Without normal maps the light is the same.
    await expect.poll(async () => difference(await seen(page), await seen(other))).toBeLessThan(0.03);
    expect(errors).toEqual([]);
  } finally {
    await other.close();
    await directional.kill();
  }
});

it('stays when the server dies, and goes on when it is back', async () => {
  await settle(page, 75);
  const before = await look(page, 'both');
  const { port } = server;
  const epoch = () => page.evaluate(() => window.lumencast!.session.catalog!.epoch);
  const [former, { revision }] = [await epoch(), await pictures()];
  await server.kill();
  await page.waitForSelector('.notice.standing');
  expect(difference(before, await look(page, 'both'))).toBeLessThan(0.05);
  expect(await lit(page)).toBe(STILL);
  await expectLumelsOnWalls();

  server = await start(port);
  await expect.poll(epoch).not.toBe(former);
  await stopTheBall();
  await expect.poll(async () => (await pictures()).revision).toBeGreaterThan(revision);
  await expect.poll(() => lit(page)).toBe(STILL);
  await settle(page, 75);
  expect((await pictures()).kinds).toEqual(['planes']);
  await expectLumelsOnWalls();
  expect(difference(before, await look(page, 'both'))).toBeLessThan(0.25);

  // It is that server's light which they show.
  const dim = await lumelsOnWalls();
  await page.evaluate(() => {
    const { light, viewer } = window.lumencast!;
    const [lamp] = viewer.lights;
    return light.edit({
      edit: 'set_light',
      node: light.content.nodeOf(lamp)!,
      intensity: 16 * lamp.intensity,
    });
  });
  await expect.poll(lumelsOnWalls).toBeGreaterThan(1.3 * dim);
});

it('is lit by probes alone where the browser decodes no video, and the page says so', async () => {
  const old = {
    newPage: async (options: object) => {
      const page = await browser.newPage(options);
      await page.addInitScript(() => delete (window as { VideoDecoder?: unknown }).VideoDecoder);
      return page;
    },
  } as unknown as Browser;
  const own: string[] = [];
  const page = await openPage(old, server.address, VIEWPORT, { renderer: 'webgl' }, own);
  await page.evaluate(() => {
    window.lumencast!.viewer.exposure = 2 ** -1;
    window.lumencast!.setMode('indirect');
  });
  await vi.waitFor(
    async () => {
      for (const pixel of await seen(page)) expect(Math.max(...pixel)).toBeGreaterThan(20);
    },
    { timeout: PATIENCE, interval: 200 },
  );
  expect(await lit(page)).toBe(0);
  await page.keyboard.press('l');
  await page.waitForTimeout(300);
  await draw(page);
  expect(await page.innerText('.lumels')).toContain('which this browser does not decode for pages');
  await page.close();
  expect(own).toEqual([]);
});

it('stays on all meshes while what is added takes another page', async () => {
  const former = errors.length;
  const [least, most] = await page.evaluate(async () => {
    const { camera, light, session } = window.lumencast!;
    const pages = () =>
      session.catalog!.fields.reduce(
        (sum, field) => sum + (field.kind === 'lightmap' ? field.shape.pages : 0),
        0,
      );
    const before = pages();
    let [least, most] = [light.lumelMeshes, light.lumelMeshes];
    // Another room as large as all, in the middle of it.
    await light.edit({ edit: 'add_instance', source: { mesh: 0 }, transform: { scale: [0.9, 0.9, 0.9] } });
    while (pages() === before || most === least) {
      await new Promise(requestAnimationFrame);
      light.update(camera);
      least = Math.min(least, light.lumelMeshes);
      most = Math.max(most, light.lumelMeshes);
    }
    return [least, most] as const;
  });
  expect(least).toBe(STILL);
  expect(most).toBeGreaterThan(STILL);
  expect(errors.slice(former)).toEqual([]);
});
