/** Lamps that pages add to a server's scene: how many there are after reloads, and when pages have gone. */
import { resolve } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { type ServedPages, servePages } from '../../testing/page.js';
import { freePort, lumencastProgram, Server } from './server.js';

describe('a lamp of a page’s own', () => {
  let pages: ServedPages;
  let browser: Browser;
  let server: Server;
  /** A page that adds nothing. */
  let watcher: Page;

  beforeAll(async () => {
    pages = await servePages(resolve(import.meta.dirname, 'lamps'));
    browser = await launchBrowser();
    server = await Server.start(lumencastProgram(), 'cornell', await freePort(), ['--samples', '4']);
    watcher = await open();
  }, 120_000);

  afterAll(async () => {
    await browser?.close();
    await server?.kill();
    await pages?.close();
  }, 30_000);

  async function open(...lamps: string[]): Promise<Page> {
    const page = await browser.newPage();
    const query = new URLSearchParams({ server: `http://localhost:${server.port}/cornell` });
    for (const lamp of lamps) query.append('lamp', lamp);
    await page.goto(`http://localhost:${pages.port}/?${query}`);
    await lit(page);
    return page;
  }

  /** Waits until the server has all lamps of a page; returns their nodes. */
  async function lit(page: Page): Promise<(number | undefined)[]> {
    await page.waitForFunction(() => window.lamps?.nodes().every((node) => node !== undefined), undefined, {
      timeout: 60_000,
    });
    return page.evaluate(() => window.lamps!.nodes());
  }

  const shown = (page: Page) => page.evaluate(() => window.lamps!.lights());

  it('is one, however often the page is reloaded, and goes with its light', async () => {
    const page = await open('lamp');
    const nodes = await lit(page);
    await expect.poll(() => shown(watcher), { timeout: 60_000 }).toBe(1);
    // An edit of the watcher's keeps it, however long a reload takes.
    await watcher.evaluate(
      (node) => window.lamps!.light.edit({ edit: 'set_light', node, intensity: 2 }),
      nodes[0]!,
    );
    for (let times = 0; times < 3; times++) {
      await page.reload();
      expect(await lit(page)).toEqual(nodes);
      expect(await shown(page)).toBe(1);
    }
    expect(await shown(watcher)).toBe(1);
    await page.evaluate(() => window.lamps!.light.dispose());
    await expect.poll(() => shown(watcher), { timeout: 60_000 }).toBe(0);
    await page.close();
  }, 180_000);

  it('goes after a page that is closed, also without a name', async () => {
    const page = await open('lamp', '');
    await expect.poll(() => shown(watcher), { timeout: 60_000 }).toBe(2);
    await page.close();
    await expect.poll(() => shown(watcher), { timeout: 60_000 }).toBe(0);
  }, 180_000);
});
