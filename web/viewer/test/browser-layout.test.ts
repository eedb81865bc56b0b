/** Where the page stands: nothing covers the picture at the sizes that people have, and no path is its own. */
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { buildPage, cutOff, draw, look, onScreen, openPage, PATIENCE, shoot } from './browser.js';
import { freePort, lumencastProgram, Server } from './server.js';

const SIZES = [
  [1280, 720],
  [1920, 1080],
  [640, 400],
  [390, 844],
  [844, 390],
  [360, 640],
] as const;

let folder: string;
let browser: Browser;
let server: Server;
let page: Page;

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), 'lumencast-layout-'));
  await buildPage(folder);
  browser = await launchBrowser();
  const options = ['--page', folder, '--samples', '4..16'];
  server = await Server.start(lumencastProgram(), 'cornell', await freePort(), options);
  page = await openPage(browser, server.address, { width: 800, height: 600 }, { scale: '0.25' });
});

afterAll(async () => {
  await browser?.close();
  await server?.kill();
  rmSync(folder, { recursive: true, force: true });
});

it.each(SIZES)('shows the whole picture beside the bar at %i by %i', async (width, height) => {
  await page.setViewportSize({ width, height });
  await draw(page);
  const { canvas, bar } = await page.evaluate(() => {
    const rect = (selector: string) => {
      const { left, top, right, bottom } = document.querySelector(selector)!.getBoundingClientRect();
      return { left, top, right, bottom };
    };
    return { canvas: rect('canvas.view'), bar: rect('.dock') };
  });
  expect(canvas.bottom <= bar.top || canvas.right <= bar.left).toBe(true);
  const share = (canvas.right * canvas.bottom) / (width * height);
  expect(share).toBeGreaterThan(0.8);
  // The corners of the room's opening, towards the camera.
  for (const x of [-1, 1]) {
    for (const y of [0, 2]) {
      const [left, top] = await onScreen(page, [x, y, 1]);
      expect(Math.min(left, top), `${x}, ${y}`).toBeGreaterThanOrEqual(0);
      expect(left).toBeLessThanOrEqual(canvas.right);
      expect(top).toBeLessThanOrEqual(canvas.bottom);
    }
  }
  expect((await look(page, 'both')).some(([r, g, b]) => r + g + b > 60)).toBe(true);
  await shoot(page, `layout-${width}x${height}.png`);
  expect(await cutOff(page)).toEqual([]);
  if (!(await page.isVisible('.dock .open'))) return;
  await page.click('.dock .open');
  await shoot(page, `settings-${width}x${height}.png`);
  expect(await cutOff(page)).toEqual([]);
  await page.keyboard.press('Escape');
  expect(await page.isVisible('.settings')).toBe(false);
});

it('finds all that it is made of beside itself, wherever a proxy has it', async () => {
  const { origin } = new URL(server.address);
  const base = `${origin}/light/`;
  const proxied = await browser.newPage();
  proxied.setDefaultTimeout(PATIENCE);
  try {
    const root: string[] = [];
    const asked: string[] = [];
    proxied.on('request', (request) => {
      const { pathname, protocol } = new URL(request.url());
      // The session's own requests are the client's matter.
      if (!/^http/.test(protocol) || pathname.endsWith('/certificate.sha256')) return;
      if (request.url().startsWith(base)) asked.push(request.url().slice(base.length));
      else root.push(pathname);
    });
    await proxied.route(`${base}**`, (route) =>
      route.continue({ url: route.request().url().replace(base, `${origin}/`) }),
    );
    await proxied.goto(`${base}?scale=0.25&transport=websocket`);
    await proxied.waitForFunction(() => window.lumencast, undefined);
    expect(asked).toContain('lumencast.json');
    expect(asked).toContain('scene/cornell.glb');
    expect(asked.some((path) => path.startsWith('assets/'))).toBe(true);
    expect(root).toEqual([]);
  } finally {
    await proxied.close();
  }
});
