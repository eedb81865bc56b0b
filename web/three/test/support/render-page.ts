import { resolve } from 'node:path';
import type { Page } from 'playwright-core';
import { launchBrowser } from '../../../testing/chromium.js';
import { servePages } from '../../../testing/page.js';

/** The page of `test/render` in a headless browser. */
export interface RenderPage {
  readonly page: Page;
  /** Errors and warnings in its console, shaders that do not link among them. */
  readonly complaints: string[];
  close(): Promise<void>;
}

export async function openRenderPage(): Promise<RenderPage> {
  const pages = await servePages(resolve(import.meta.dirname, '../render'));
  const browser = await launchBrowser();
  const page = await browser.newPage();
  const complaints: string[] = [];
  page.on('pageerror', (error) => console.error(error));
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type())) complaints.push(message.text());
  });
  await page.goto(`http://127.0.0.1:${pages.port}/`);
  await page.waitForFunction(() => window.measure);
  return {
    page,
    complaints,
    async close() {
      await browser.close();
      await pages.close();
    },
  };
}
