/** The examples, each with what it asks for: they must run as they are. */
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, describe, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { type ServedPages, servePages } from '../../testing/page.js';
import { type Pixel, SHOTS } from './browser.js';
import { freePort, lumencastProgram, Server } from './server.js';

const ROOT = resolve(import.meta.dirname, '../../examples');
const EXAMPLES = ['own-scene', 'saved', 'webgpu'];
const VIEWPORT = { width: 320, height: 240 };

const program = lumencastProgram();

describe('the example', () => {
  let folder: string;
  let pages: ServedPages;
  let browser: Browser;
  let server: Server | undefined;
  let page: Page;
  let errors: string[];

  beforeAll(async () => {
    folder = mkdtempSync(join(tmpdir(), 'lumencast-examples-'));
    pages = await servePages(
      ROOT,
      EXAMPLES.map((name) => `${name}/index.html`),
    );
    browser = await launchBrowser();
  }, 120_000);

  afterEach(async () => {
    await page.close();
    await server?.kill();
    server = undefined;
  }, 30_000);

  afterAll(async () => {
    await browser?.close();
    await pages?.close();
    rmSync(folder, { recursive: true, force: true });
  }, 30_000);

  const start = async (scene: string, port: number) =>
    (server = await Server.start(program, scene, port, ['--samples', '4..16']));

  async function open(path: string): Promise<void> {
    page = await browser.newPage({ viewport: VIEWPORT });
    errors = [];
    page.on('pageerror', (error) => errors.push(String(error)));
    await page.goto(`http://localhost:${pages.port}/${path}`);
    await page.waitForSelector('canvas', { timeout: 30_000 });
  }

  it('own-scene is drawn at once, and lit when a server comes that has its file', async () => {
    const port = await freePort();
    await open(`own-scene/?server=http://localhost:${port}`);
    await page.getByText('nobody answers').waitFor({ timeout: 30_000 });
    const dark = await shadow(page);
    const file = await page.evaluate(async () => {
      const bytes = await (await fetch(document.querySelector('a')!.href)).bytes();
      return [...bytes];
    });
    // The saved light is of this file.
    expect(Buffer.from(file).equals(readFileSync(join(ROOT, 'public/room.glb')))).toBe(true);
    writeFileSync(join(folder, 'room.glb'), Buffer.from(file));
    await start(join(folder, 'room.glb'), port);
    await expect.poll(() => shadow(page), { timeout: 60_000 }).toBeGreaterThan(dark + 20);
    await page.getByText('connected to the server').waitFor();
    expect(await page.innerText('p')).not.toContain('added to it');
    await shootExample(page, 'own-scene');
    expect(errors).toEqual([]);
  }, 180_000);

  it('saved is lit without a server, and names what is missing', async () => {
    const asked: string[] = [];
    await open('saved/');
    page.on('request', (request) => asked.push(request.url()));
    await expect.poll(() => shadow(page), { timeout: 60_000 }).toBeGreaterThan(20);
    // Its own two files may still be on their way when the page has opened.
    expect(asked.filter((url) => !/\/room\.(glb|light)$/.test(url))).toEqual([]);
    await shootExample(page, 'saved');
    expect(errors).toEqual([]);
    await page.route('**/room.light', (route) => route.fulfill({ status: 404 }));
    await page.reload();
    await page.getByText('/room.light is missing (HTTP 404)').waitFor({ timeout: 30_000 });
  }, 120_000);

  it('webgpu draws the server’s scene', async () => {
    const { port } = await start('cornell', await freePort());
    await open(`webgpu/?address=http://localhost:${port}/cornell`);
    await expect.poll(async () => mean(await picture(page)), { timeout: 60_000 }).toBeGreaterThan(30);
    await shootExample(page, 'webgpu');
    expect(errors).toEqual([]);
  }, 120_000);
});

/** What is seen of the page. */
async function picture(page: Page): Promise<Pixel[]> {
  const png = (await page.screenshot({ animations: 'disabled', timeout: 60_000 })).toString('base64');
  return page.evaluate(async (png) => {
    const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d')!;
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    return Array.from({ length: data.length / 4 }, (_, i): [number, number, number] => [
      data[4 * i],
      data[4 * i + 1],
      data[4 * i + 2],
    ]);
  }, png);
}

/** Brightness of the screen in the middle of the room, of whose front no lamp is seen. */
async function shadow(page: Page): Promise<number> {
  const { width, height } = VIEWPORT;
  const pixels = await picture(page);
  const rows = [0.6, 0.63, 0.66].map((part) => Math.floor(part * height));
  return mean(rows.flatMap((row) => pixels.slice(row * width + 0.45 * width, row * width + 0.55 * width)));
}

function mean(pixels: readonly Pixel[]): number {
  return pixels.flat().reduce((sum, value) => sum + value, 0) / (3 * pixels.length);
}

async function shootExample(page: Page, name: string): Promise<void> {
  if (SHOTS) await page.screenshot({ path: join(SHOTS, `example-${name}.png`) });
}
