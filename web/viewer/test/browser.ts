import { resolve } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { build } from 'vite';

/** Builds the page into a folder, for `lumencast serve --page`. */
export async function buildPage(folder: string): Promise<void> {
  await build({
    root: resolve(import.meta.dirname, '..'),
    logLevel: 'error',
    build: { outDir: folder, emptyOutDir: true },
  });
}

/**
 * Opens the page and waits for its first light, at a fixed exposure. From then on it draws when asked
 * to: a page that draws without pause in software leaves the server no processor, and never comes to
 * rest for a screenshot.
 */
export async function openPage(
  browser: Browser,
  address: string,
  viewport: { width: number; height: number },
  query: Readonly<Record<string, string>> = {},
): Promise<Page> {
  const page = await browser.newPage({ viewport });
  const errors: string[] = [];
  page.on('pageerror', (error) => errors.push(String(error)));
  page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  try {
    await page.goto(`${address}/?${new URLSearchParams({ scale: '1', ...query })}`);
    await page.waitForFunction(() => window.lumencast, undefined, { timeout: 60_000 });
    await page.evaluate(() => window.lumencast!.ready);
    await page.waitForSelector('.curtain', { state: 'detached', timeout: 20_000 });
    await page.evaluate(() => {
      const { viewer } = window.lumencast!;
      viewer.autoExposure = false;
      viewer.stop();
      return viewer.meter();
    });
    return page;
  } catch (error) {
    const shown = await page.innerText('body').catch(() => '');
    throw new Error(`the page did not come up; it says: ${shown.slice(0, 300)}\n${errors.join('\n')}`, {
      cause: error,
    });
  }
}
