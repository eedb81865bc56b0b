/**
 * A column of the built-in scene `tomb`, dragged away by hand and put down: on every page it leaves its
 * lumels and comes back to them, without a jump, and its shadow of indirect light goes with it.
 */
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, expect, it, vi } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import {
  buildPage,
  difference,
  look,
  onScreen,
  openPage,
  PATIENCE,
  type Pixel,
  settle,
  shoot,
} from './browser.js';
import { lit, settled } from './lumels.js';
import { freePort, lumencastProgram, Server } from './server.js';

type Point = [x: number, y: number, z: number];

/** Small: every pixel is drawn by the processor. */
const VIEWPORT = { width: 560, height: 280 };
/** The room, eight columns and four pedestals stand still. */
const STILL = 13;
/** Where the column stands that is dragged, how thick its foot is, and how far along z it is moved. */
const HOME: Point = [-3.2, 0, -1.3];
const FOOT = 0.4;
const AWAY = -1.2;
/** Milliseconds between two pictures, and pictures in which a surface passes from probes to lumels. */
const FRAME = 50;
const PASSAGE = 10;
/** All of tomb's lumels, computed beside two pages that are drawn by the processor, take their time. */
const PATIENT = { timeout: PATIENCE };
const LONG = { timeout: 4 * PATIENCE };
/** Codes by which a picture may change more than evenly: 2 a frame at 60 Hz. */
const UNEVEN = 6;

let folder: string;
let browser: Browser;
let server: Server;
let page: Page;
let other: Page;
const errors: string[] = [];

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), 'lumencast-tomb-'));
  await buildPage(folder);
  browser = await launchBrowser();
  const few = ['--samples', '4..16', '--volume', '6x3x8', '--lightmap', '512'];
  server = await Server.start(lumencastProgram(), 'tomb', await freePort(), ['--page', folder, ...few]);
  page = await open('webgpu');
  other = await open('webgl');
  await settle(page, 75);
});

afterAll(async () => {
  await browser?.close();
  await server?.kill();
  rmSync(folder, { recursive: true, force: true });
});

/** The page with its indirect light alone, and without sculptures: they move, and have most triangles. */
async function open(renderer: 'webgl' | 'webgpu'): Promise<Page> {
  const page = await openPage(browser, server.address, VIEWPORT, { renderer }, errors);
  await page.evaluate(async () => {
    const { light, scene, viewer, setMode } = window.lumencast!;
    for (const name of ['knot', 'star', 'idol', 'shell']) scene.getObjectByName(name)!.visible = false;
    for (const animation of light.content.animations.keys()) {
      await light.edit({ edit: 'set_animation', animation, playing: false, time: 0 });
    }
    viewer.exposure = 2 ** 4;
    setMode('indirect');
  });
  await vi.waitFor(async () => expect(await lit(page)).toBe(STILL), { timeout: PATIENCE, interval: 100 });
  return page;
}

const brightness = (pixels: readonly Pixel[]) =>
  pixels.flat().reduce((sum, value) => sum + value, 0) / (3 * pixels.length);

/** The floor close around the foot of the column, as it is seen where this stands so far along z from home. */
async function floorAround(along: number): Promise<number> {
  const [x, y, z] = HOME;
  const radius = 1.1 * FOOT;
  const around = Array.from({ length: 9 }, (_, i): Point => {
    // In front of it and to its left: its back is hidden.
    const angle = Math.PI * (0.5 + i / 12);
    return [x + radius * Math.cos(angle), y, z + along + radius * Math.sin(angle)];
  });
  const at = await Promise.all(around.map((point) => onScreen(page, point)));
  await settled(page);
  return brightness(await page.evaluate((at) => window.lumencast!.pixels(at), at));
}

/** Where the column stands along z from home. */
const place = (on: Page) =>
  on.evaluate((z) => window.lumencast!.scene.getObjectByName('column_2')!.position.z - z, HOME[2]);

/** The column's light by probes alone, none where it has lumels, and how many meshes have them then. */
async function byProbes(along: number): Promise<[light: number, meshes: number]> {
  const [x, y, z] = HOME;
  const at = await onScreen(page, [x, y + 1.5, z + along + 0.3]);
  const [seen, meshes] = await page.evaluate((at) => {
    const { light, pixels } = window.lumencast!;
    light.strengths.static = 0;
    const seen = pixels([at]);
    light.strengths.static = 1;
    return [seen, light.lumelMeshes] as const;
  }, at);
  return [brightness(seen), meshes];
}

/** A hand on the column's handle for the z axis, which stands for it `away` from home. */
async function handleAt(away: number): Promise<[x: number, y: number]> {
  const [x, y, z] = HOME;
  const reach = await page.evaluate((home) => {
    const { camera } = window.lumencast!;
    const distance = camera.position.distanceTo(camera.position.clone().fromArray(home));
    // As TransformControls sizes it; of its arrow, the middle.
    return 0.3 * distance * 1.9 * Math.tan((camera.fov * Math.PI) / 360) * 0.2;
  }, HOME);
  return onScreen(page, [x, y, z + away + reach]);
}

/** Does something by hand, with a picture after it as the hand would see it. */
async function gesture(act: () => Promise<unknown>): Promise<void> {
  await act();
  await page.evaluate(() => window.lumencast!.viewer.draw());
}

it('leaves its lumels in the hand, and has them where it is put down, on every page', LONG, async () => {
  const [here, there] = [await floorAround(0), await floorAround(AWAY)];
  expect((await byProbes(0))[0]).toBeLessThan(4);
  await shoot(page, 'tomb-home.png');

  const [x, y, z] = HOME;
  const [middle, handle] = [await onScreen(page, [x, y + 1.5, z]), await handleAt(0)];
  const { mouse } = page;
  await gesture(() => mouse.click(...middle));
  expect(await page.evaluate(() => window.lumencast!.viewer.selection.selected?.name)).toBe('column_2');
  await gesture(() => mouse.move(...handle));
  await gesture(() => mouse.down());
  let steps = 0;
  const dragged = async () => {
    // It is moved about until it has lost its lumels, however late that shows.
    const along = AWAY + 0.1 * (++steps % 2);
    await mouse.move(...(await handleAt(along)));
    const lights = await Promise.all([lit(page), lit(other)]);
    if (lights.some((count) => count !== STILL - 1)) return lights;
    // Both at once: while a picture is drawn it rests, and after two seconds it has lumels again.
    const [[light, ofPicture], ofOther] = await Promise.all([byProbes(along), lit(other)]);
    return [ofPicture, ofOther, light > 20];
  };
  await expect.poll(dragged, PATIENT).toEqual([STILL - 1, STILL - 1, true]);
  const end = await handleAt(AWAY);
  await gesture(() => mouse.move(...end));
  // A hand may rest before it lets go: what it holds then has its lumels already.
  await expect.poll(() => lit(page), PATIENT).toBe(STILL);
  await gesture(() => mouse.up());
  await page.keyboard.press('Escape');

  await expect.poll(() => lit(other), PATIENT).toBe(STILL);
  await settle(page, 50);
  expect([await lit(page), await lit(other)]).toEqual([STILL, STILL]);
  expect((await byProbes(AWAY))[0]).toBeLessThan(4);
  expect(await place(page)).toBeCloseTo(AWAY, 1);
  expect(await place(other)).toBeCloseTo(await place(page), 5);
  await expect.poll(() => floorAround(0), PATIENT).toBeGreaterThan(1.15 * here);
  await expect.poll(() => floorAround(AWAY), PATIENT).toBeLessThan(0.9 * there);
  const apart = async () => difference(await look(page, 'indirect'), await look(other, 'indirect'));
  await expect.poll(apart, PATIENT).toBeLessThan(0.03);
  await shoot(page, 'tomb-away.png');
  await shoot(other, 'tomb-away-webgl.png');
  expect(errors).toEqual([]);
});

it('passes from probes to lumels without a jump', async () => {
  const pictures = await page.evaluate(
    async ([still, home, frame, frames]) => {
      const { light, pixels, renderer, scene, viewer } = window.lumencast!;
      const { clientWidth, clientHeight } = renderer.domElement;
      const points: [number, number][] = [];
      for (let y = 5; y < clientHeight; y += 10)
        for (let x = 5; x < clientWidth; x += 10) points.push([x, y]);
      const column = scene.getObjectByName('column_2')!;
      const node = light.content.nodeOf(column)!;
      const [x, y, z] = home;
      const move = (along: number) => light.edit({ edit: 'move_node', node, translation: [x, y, z + along] });
      for (let steps = 0; light.lumelMeshes === still; steps++) {
        await move(0.1 * (1 + (steps % 2)));
        viewer.draw();
      }
      await move(0);
      // What is drawn before the first picture of the passage shows probes alone.
      let [now, pictures] = [0, [] as Pixel[][]];
      while (light.lumelMeshes < still) {
        await new Promise((resolve) => setTimeout(resolve));
        now = performance.now();
        pictures = [pixels(points, now)];
      }
      for (let i = 1; i <= frames; i++) pictures.push(pixels(points, now + i * frame));
      return pictures;
    },
    [STILL, HOME, FRAME, PASSAGE] as const,
  );
  const [first, last] = [pictures[0].flat(), pictures.at(-1)!.flat()];
  // Probes and lumels show another light, so that there is something to pass.
  const most = Math.max(...first.map((value, i) => Math.abs(value - last[i])));
  expect(most).toBeGreaterThan(5);
  pictures.slice(1).forEach((picture, frame) => {
    const before = pictures[frame].flat();
    picture.flat().forEach((value, i) => {
      const step = Math.abs(value - before[i]);
      expect(step, `frame ${frame}`).toBeLessThanOrEqual(Math.abs(last[i] - first[i]) / PASSAGE + UNEVEN);
    });
  });
});
