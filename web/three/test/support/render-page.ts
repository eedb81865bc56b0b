import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import type { Page } from 'playwright-core';
import { build, preview } from 'vite';
import { launchBrowser } from '../../../testing/chromium.js';

/** The page of `test/render` in a headless browser. */
export interface RenderPage {
  readonly page: Page;
  /** Errors and warnings in its console, shaders that do not link among them. */
  readonly complaints: string[];
  close(): Promise<void>;
}

export async function openRenderPage(): Promise<RenderPage> {
  const folder = mkdtempSync(join(tmpdir(), 'lumencast-render-'));
  const root = resolve(import.meta.dirname, '../render');
  await build({
    configFile: false,
    root,
    logLevel: 'error',
    mode: 'production',
    resolve: { conditions: ['lumencast-source', 'module', 'browser', 'import', 'default'] },
    build: {
      outDir: folder,
      emptyOutDir: true,
      target: 'es2023',
      minify: false,
      chunkSizeWarningLimit: 5000,
    },
  });
  const vite = await preview({
    configFile: false,
    root,
    build: { outDir: folder },
    preview: { host: '127.0.0.1', port: 0 },
  });
  const browser = await launchBrowser();
  const page = await browser.newPage();
  const complaints: string[] = [];
  page.on('pageerror', (error) => console.error(error));
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type())) complaints.push(message.text());
  });
  await page.goto(vite.resolvedUrls!.local[0]);
  await page.waitForFunction(() => window.measure);
  return {
    page,
    complaints,
    async close() {
      await browser.close();
      await vite.close();
      rmSync(folder, { recursive: true, force: true });
    },
  };
}
