/** Light at lumels on the page: saved light with a lightmap, drawn by both renderers. */
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, it } from 'vitest';
import { preview, type PreviewServer } from 'vite';
import { launchBrowser } from '../../testing/chromium.js';
import { buildPage, difference, draw, look, onScreen, openPage, type Pixel, shoot } from './browser.js';
import { lit, POINTS, seen, setStrengths, settled, STILL, SURFACES } from './lumels.js';
import { freePort, lumencastProgram, Server } from './server.js';

const VIEWPORT = { width: 760, height: 560 };
/** What lumels can be shown as, in the page's words. */
const LOOKS = { light: 'Light', lumels: 'Lumels, one square each', age: 'Age, green to red' };

let folder: string;
let browser: Browser;
let files: PreviewServer;
let address: string;
const errors: string[] = [];

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), 'lumencast-lumels-'));
  await buildPage(folder);
  const program = lumencastProgram();
  const bake = (name: string, ...options: string[]) =>
    execFileSync(program, ['bake', 'cornell', '-o', join(folder, name), '--samples', '64', ...options]);
  bake('lumels.light');
  bake('probes.light', '--fields', 'volume');
  const server = await Server.start(program, 'cornell', await freePort(), ['--page', folder]);
  const { root } = (await (await fetch(`${server.address}/lumencast.json`)).json()) as { root: string };
  const scene = await fetch(`${server.address}/scene/${encodeURIComponent(root)}`);
  writeFileSync(join(folder, 'cornell.glb'), new Uint8Array(await scene.arrayBuffer()));
  await server.kill();
  files = await preview({
    configFile: false,
    root: resolve(import.meta.dirname, '..'),
    build: { outDir: folder },
    preview: { host: '127.0.0.1', port: 0 },
  });
  address = files.resolvedUrls!.local[0].replace(/\/$/, '');
  browser = await launchBrowser();
});

afterAll(async () => {
  await browser?.close();
  await files?.close();
  rmSync(folder, { recursive: true, force: true });
});

/** The page with a saved file, at the exposure that suits direct light and lumels. */
async function open(light: string, renderer: 'webgl' | 'webgpu'): Promise<Page> {
  const page = await openPage(browser, address, VIEWPORT, { light, gltf: 'cornell.glb', renderer }, errors);
  await page.evaluate(() => (window.lumencast!.viewer.exposure = 2 ** -1));
  // Geometries are made a few a frame.
  for (let i = 0; i < 20; i++) await draw(page);
  return page;
}

const brightness = (pixels: readonly Pixel[]) => pixels.flat().reduce((sum, value) => sum + value, 0);

/** Points all over the picture, with one part of the light shown. */
async function seenAll(page: Page, shown: 'both' | 'indirect'): Promise<Pixel[]> {
  await page.evaluate((shown) => window.lumencast!.setMode(shown), shown);
  await settled(page);
  return look(page, shown);
}

describe.each(['webgl', 'webgpu'] as const)('drawn by %s, a room', (renderer) => {
  let page: Page;

  beforeAll(async () => {
    page = await open('lumels.light', renderer);
  });

  afterAll(() => page?.close());

  it('is lit by lumels, and what has none by probes', async () => {
    // Indirect light alone, without that of lumels, and without that of probes.
    await page.evaluate(() => window.lumencast!.setMode('indirect'));
    const all = await seen(page);
    await setStrengths(page, 0, 1);
    const dark = await seen(page);
    const byProbes = await seenAll(page, 'indirect');
    await setStrengths(page, 1, 0);
    expect(await seen(page)).toEqual(all);
    const byLumels = await seenAll(page, 'indirect');
    await setStrengths(page, 1, 1);
    SURFACES.forEach(([name], i) => {
      expect(Math.max(...all[i]), name).toBeGreaterThan(40);
      expect(Math.max(...dark[i]), name).toBeLessThan(4);
    });
    // The ball moves.
    expect(brightness(byProbes)).toBeGreaterThan(1000);
    expect(brightness(byLumels)).toBeGreaterThan(brightness(byProbes));
    expect(errors).toEqual([]);
  });

  it('stands still where its light is the same by lumels and by probes, but for leaks', async () => {
    const other = await open('probes.light', renderer);
    for (const at of [page, other]) await at.evaluate(() => window.lumencast!.setMode('both'));
    const [lumels, probes] = [await seen(page), await seen(other)];
    await shoot(page, `lumels-${renderer}.png`);
    await shoot(other, `probes-${renderer}.png`);
    expect(difference(lumels, probes)).toBeLessThan(0.15);
    const [whole, coarse] = [await seenAll(page, 'both'), await seenAll(other, 'both')];
    expect(difference(whole, coarse)).toBeGreaterThan(0.01);
    await other.close();
  });

  it('shows its lumels as squares, and by their age', async () => {
    await page.keyboard.press('l');
    await draw(page);
    const rows = async (what: keyof typeof LOOKS) => {
      await page.selectOption('.lumels [aria-label="Show"]', LOOKS[what]);
      expect(await page.evaluate(() => window.lumencast!.light.look)).toBe(what);
      await draw(page);
      await shoot(page, `look-${what}-${renderer}.png`);
      const [x, y] = await onScreen(page, [0.5, 1.6, -1]);
      const line = Array.from({ length: 40 }, (_, i) => [x + i, y] as const);
      return page.evaluate((line) => window.lumencast!.pixels(line), line);
    };
    const roughness = (line: readonly Pixel[]) =>
      line.slice(1).reduce((sum, [, green], i) => sum + Math.abs(green - line[i][1]), 0);
    const [light, squares, age] = [await rows('light'), await rows('lumels'), await rows('age')];
    expect(roughness(squares)).toBeGreaterThan(5 * roughness(light));
    // From green by yellow to red.
    const [red, green, blue] = age[0];
    expect(Math.max(red, green)).toBeGreaterThan(2 * blue);
    expect(await rows('light')).toEqual(light);
    await page.keyboard.press('l');
  });

  it('shows its pages', async () => {
    const middle = () => page.evaluate(() => window.lumencast!.pixel(380, 240));
    const before = await middle();
    await page.keyboard.press('l');
    // Figures are written four times a second.
    await page.waitForTimeout(300);
    await draw(page);
    expect(await page.innerText('.lumels')).toMatch(/On one page of \d+ × \d+; they light 4 meshes/);
    expect(await page.innerText('.stats')).toMatch(/pages\s+1 × 256²\s+lit\s+4/);
    await page.click('.lumels >> text=Pages');
    await draw(page);
    await shoot(page, `pages-${renderer}.png`);
    expect(await middle()).not.toEqual(before);
    await page.click('.lumels >> text=Pages');
    await page.keyboard.press('l');
    expect(await middle()).toEqual(before);
  });

  it('has strengths on sliders', async () => {
    await page.keyboard.press('l');
    await draw(page);
    const wall = POINTS.slice(0, 1);
    const [[bright]] = await seen(page, wall);
    const slide = (name: string, value: string) => page.fill(`.lumels [aria-label="${name}"]`, value);
    await slide('Static', '0.5');
    await draw(page);
    expect(await page.innerText('.lumels')).toContain('50 %');
    const [[dim]] = await seen(page, wall);
    expect(dim).toBeLessThan(0.9 * bright);
    await slide('Dynamic', '0.1');
    const [[same]] = await seen(page, wall);
    expect(same).toBe(dim);
    await slide('Static', '0');
    const faint = brightness(await seenAll(page, 'indirect'));
    await slide('Dynamic', '0');
    // What shines by itself is left.
    const dark = brightness(await seenAll(page, 'indirect'));
    await slide('Dynamic', '1');
    const whole = brightness(await seenAll(page, 'indirect'));
    expect(whole - dark).toBeGreaterThan(2 * (faint - dark));
    expect(faint).toBeGreaterThan(dark);
    await page.evaluate(() => window.lumencast!.setMode('both'));
    await slide('Static', '1');
    await page.keyboard.press('l');
  });

  it('gives what is moved by hand to probes, and its lumels back', async () => {
    const move = (by: number) =>
      page.evaluate((by) => {
        const box = window.lumencast!.scene.getObjectByName('tall_box')!;
        box.position.x += by;
        box.updateMatrixWorld(true);
      }, by);
    expect(await lit(page)).toBe(STILL);
    await move(0.2);
    await expect.poll(() => lit(page)).toBe(STILL - 1);
    await move(-0.2);
    expect(await lit(page)).toBe(STILL);
  });

  it('goes without them when the light does', async () => {
    const charted = await page.evaluate(() => {
      const { light, scene } = window.lumencast!;
      const count = () => {
        let count = 0;
        scene.traverse((object) => {
          const { geometry } = object as { geometry?: { attributes: object } };
          if (geometry && 'lumels' in geometry.attributes) count++;
        });
        return count;
      };
      const before = count();
      light.dispose();
      return [before, count()];
    });
    expect(charted).toEqual([STILL, 0]);
    expect(errors).toEqual([]);
  });
});

it('both renderers draw the same room', async () => {
  const pictures: Pixel[][] = [];
  for (const renderer of ['webgl', 'webgpu'] as const) {
    const page = await open('lumels.light', renderer);
    pictures.push(await seenAll(page, 'both'));
    await page.close();
  }
  expect(difference(pictures[0], pictures[1])).toBeLessThan(0.02);
});
