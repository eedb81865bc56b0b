/** Pictures of lumels that travel as video, decoded by a browser: codes come out as they went in. */
import { resolve } from 'node:path';
import type { VideoCoding } from '@lumencast/client';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { type ServedPages, servePages } from '../../testing/page.js';

let pages: ServedPages;
let browser: Browser;

beforeAll(async () => {
  pages = await servePages(resolve(import.meta.dirname, 'video'));
  browser = await launchBrowser('--host-resolver-rules=MAP page.test 127.0.0.1');
}, 120_000);

afterAll(async () => {
  await browser?.close();
  await pages?.close();
}, 30_000);

async function open(host = 'localhost', script = () => {}): Promise<Page> {
  const page = await browser.newPage();
  await page.addInitScript(script);
  await page.goto(`http://${host}:${pages.port}/`);
  await page.waitForFunction(() => window.cast);
  return page;
}

/** What comes of ten updates. */
function cast(page: Page, coding: VideoCoding, pageSize: number) {
  return page.evaluate(([coding, pageSize]) => window.cast!(coding, pageSize, 10), [
    coding,
    pageSize,
  ] as const);
}

describe('video', () => {
  it.each([
    ['h264', 256, 0.5],
    ['h264', 41, 21 / 41],
    ['h264_stacked', 256, 1],
    ['h264_stacked', 40, 1],
  ] as const)('as %s, of pages of %i lumels, comes out as it went in', async (coding, pageSize, chroma) => {
    const page = await open();
    const outcome = (await cast(page, coding, pageSize))!;
    expect(outcome).toMatchObject({ pictures: 10, chroma });
    // What the coding costs at so many bits a picture.
    expect(outcome.error).toBeLessThan(8);
    outcome.middle.forEach((value, i) => {
      expect(value / outcome.wanted[i]).toBeGreaterThan(0.75);
      expect(value / outcome.wanted[i]).toBeLessThan(1.33);
    });
    // In a worker, which ends with the session.
    expect(page.workers().length).toBe(1);
    await page.evaluate(() => window.end!());
    await expect.poll(() => page.workers().length).toBe(0);
    await page.close();
  });

  it('is decoded in the page where workers are forbidden', async () => {
    const page = await open('localhost', () => {
      window.Worker = class {
        constructor() {
          throw new DOMException('workers are forbidden', 'SecurityError');
        }
      } as unknown as typeof Worker;
    });
    expect(await cast(page, 'h264', 64)).toMatchObject({ pictures: 10 });
    expect(page.workers()).toEqual([]);
    await page.close();
  });

  it('is not shown in pages that are not secure, and the session says so', async () => {
    const page = await open('page.test');
    expect(await cast(page, 'h264', 64)).toBeUndefined();
    await page.close();
  });
});
