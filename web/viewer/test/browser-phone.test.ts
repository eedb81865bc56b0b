/** The page under a thumb: what is pressed is large enough and says what it is, and gestures do what help says. */
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, CDPSession, Page } from 'playwright-core';
import { afterAll, beforeAll, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { buildPage, cutOff, draw, onScreen, openPage, shoot } from './browser.js';
import { freePort, lumencastProgram, Server } from './server.js';

/** CSS pixels that a thumb needs. */
const THUMB = 44;
const UPRIGHT = { width: 360, height: 640 };
const SIZES = [
  UPRIGHT,
  { width: 390, height: 844 },
  { width: 844, height: 390 },
  { width: 640, height: 360 },
];

let folder: string;
let browser: Browser;
let server: Server;
let page: Page;
let fingers: CDPSession;

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), 'lumencast-phone-'));
  await buildPage(folder);
  browser = await launchBrowser();
  const options = ['--page', folder, '--samples', '4..16'];
  server = await Server.start(lumencastProgram(), 'cornell', await freePort(), options);
  page = await openPage(browser, server.address, { ...UPRIGHT, touch: true }, { scale: '0.5' });
  fingers = await page.context().newCDPSession(page);
});

afterAll(async () => {
  await browser?.close();
  await server?.kill();
  rmSync(folder, { recursive: true, force: true });
});

/** What a thumb cannot hit, or what says nothing of itself. */
function tooSmall(): Promise<string[]> {
  return page.evaluate((thumb) => {
    const pressed = document.querySelectorAll<HTMLElement>('button, select, input');
    return [...pressed]
      .filter((element) => element.checkVisibility())
      .filter((element) => {
        const { width, height } = element.getBoundingClientRect();
        const says = element.innerText || element.closest('label')?.innerText;
        return Math.min(width, height) < thumb || !says;
      })
      .map(
        (element) => `${element.tagName} ${element.title} ${JSON.stringify(element.getBoundingClientRect())}`,
      );
  }, THUMB);
}

it.each(SIZES)('has room for a thumb and for words at $width by $height', async (size) => {
  await page.setViewportSize(size);
  await draw(page);
  expect(await tooSmall()).toEqual([]);
  expect(await cutOff(page)).toEqual([]);
  await page.tap('.dock .open');
  await draw(page);
  await shoot(page, `phone-settings-${size.width}.png`);
  expect(await tooSmall()).toEqual([]);
  expect(await cutOff(page)).toEqual([]);
  await page.tap('[title^="Keys and gestures"]');
  await draw(page);
  await shoot(page, `phone-help-${size.width}.png`);
  expect(await page.isVisible('.guide .keys')).toBe(false);
  expect(await page.innerText('.guide')).toMatch(/one finger[^]*two fingers[^]*tap/);
  expect(await tooSmall()).toEqual([]);
  expect(await cutOff(page)).toEqual([]);
  await page.tap('.guide button');
  expect(await page.isVisible('.guide')).toBe(false);
  expect(await page.isVisible('.settings')).toBe(false);
  await page.evaluate(() => window.lumencast!.viewer.selection.select(window.lumencast!.viewer.lights[0]));
  await draw(page);
  await shoot(page, `phone-inspector-${size.width}.png`);
  expect(await tooSmall()).toEqual([]);
  expect(await cutOff(page)).toEqual([]);
  await page.tap('.inspector [title^="Close"]');
});

/** Drags as many fingers as there are paths, with a picture after every step. */
async function drag(...paths: (readonly [number, number])[][]): Promise<void> {
  for (const [step] of paths[0].entries()) {
    const touchPoints = paths.map((path, id) => ({ x: path[step][0], y: path[step][1], id }));
    await fingers.send('Input.dispatchTouchEvent', {
      type: step === 0 ? 'touchStart' : 'touchMove',
      touchPoints,
    });
    await draw(page);
  }
  await fingers.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
  await draw(page);
}

const camera = () => page.evaluate(() => window.lumencast!.camera.position.toArray());
const rotation = () => page.evaluate(() => window.lumencast!.camera.quaternion.toArray() as number[]);
const moved = (a: number[], b: number[]) => Math.hypot(...a.map((value, i) => value - b[i]));

it('aims the flashlight by one finger, and moves the camera by two', async () => {
  await page.setViewportSize(UPRIGHT);
  await draw(page);
  const aim = () =>
    page.evaluate(() => {
      const { camera, viewer } = window.lumencast!;
      return viewer.flashlight.spot?.getWorldDirection(camera.position.clone()).toArray() ?? [];
    });
  await page.tap('[title^="Take the flashlight"]');
  await expect.poll(() => page.innerText('.notices')).toContain('Point with one finger');
  await draw(page);
  await shoot(page, 'phone-flashlight.png');
  const home = await camera();
  const [x, y] = await onScreen(page, [0, 1, 0]);
  await drag([
    [x, y],
    [x + 20, y],
    [x + 60, y - 40],
  ]);
  const aimed = await aim();
  await drag([
    [x, y],
    [x - 20, y],
    [x - 60, y + 40],
  ]);
  expect(moved(aimed, await aim())).toBeGreaterThan(0.1);
  expect(await camera()).toEqual(home);
  await drag(
    [
      [x - 20, y],
      [x - 40, y],
      [x - 80, y],
    ],
    [
      [x + 20, y],
      [x + 40, y],
      [x + 80, y],
    ],
  );
  expect(moved(home, await camera())).toBeGreaterThan(0.1);
  await page.tap('[title^="Take the flashlight"]');
  await draw(page);
  // Two fingers have not turned the camera, one does.
  const before = await rotation();
  await drag([
    [x, y],
    [x + 20, y],
    [x + 60, y],
  ]);
  await expect.poll(async () => (await draw(page), moved(before, await rotation()))).toBeGreaterThan(0.03);
});

it('flies by two fingers', async () => {
  await page.evaluate(() => (window.lumencast!.viewer.rig.mode = 'fly'));
  const [x, y] = [180, 300];
  const before = await camera();
  await drag(
    [
      [x - 20, y],
      [x - 40, y],
      [x - 80, y],
    ],
    [
      [x + 20, y],
      [x + 40, y],
      [x + 80, y],
    ],
  );
  const ahead = await page.evaluate((before) => {
    const { camera } = window.lumencast!;
    const way = camera.position.clone().sub(camera.position.clone().fromArray(before));
    return way.dot(camera.getWorldDirection(camera.position.clone()));
  }, before);
  expect(ahead).toBeGreaterThan(0.1);
});
