/**
 * Pictures of the page for the documents: scenes whose indirect light is that of probes alone, and that of
 * lumels, at the same exposure.
 *
 *     LUMENCAST_BIN=target/release/lumencast npm run pictures
 *
 * They go to docs/pictures, or into the folder that LUMENCAST_SHOTS names.
 */
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import type { Browser } from 'playwright-core';
import { afterAll, beforeAll, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { buildPage, draw, openPage, SHOTS } from './browser.js';
import { freePort, lumencastProgram, Server, sharedScene } from './server.js';

const VIEWPORT = { width: 560, height: 315 };
/**
 * Scene time until which light settles, seconds: of lumels, and of probes, which are fewer. The ball of
 * cornell is at the same place then.
 */
const SETTLED = { lumels: 184, probes: 64 };
/** Frames in which the page makes all geometries that lumels need. */
const FRAMES = 30;

const out = SHOTS ?? resolve(import.meta.dirname, '../../../docs/pictures');
const sponza = sharedScene('sponza/Sponza.glb');
const scenes = { cornell: 'cornell', door: 'door', tomb: 'tomb', ...(sponza ? { sponza } : {}) };

let folder: string;
let browser: Browser;

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), 'lumencast-pictures-'));
  await buildPage(folder);
  mkdirSync(out, { recursive: true });
  browser = await launchBrowser();
});

afterAll(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

it.each(Object.entries(scenes))(
  '%s by probes and by lumels',
  async (name, scene) => {
    const lumels = await picture(scene, 'lightmap,volume', SETTLED.lumels);
    const probes = await picture(scene, 'volume', SETTLED.probes, lumels.exposure);
    expect(probes.bytes).not.toEqual(lumels.bytes);
    writeFileSync(join(out, `lumels-${name}.jpg`), lumels.bytes);
    writeFileSync(join(out, `probes-${name}.jpg`), probes.bytes);
  },
  1_200_000,
);

/** What the page shows of a scene at a time of it, at an exposure or the one that suits it. */
async function picture(
  scene: string,
  fields: string,
  time: number,
  exposure?: number,
): Promise<{ bytes: Buffer; exposure: number }> {
  const options = ['--page', folder, '--fields', fields];
  const server = await Server.start(lumencastProgram(), scene, await freePort(), options);
  try {
    const page = await openPage(browser, server.address, VIEWPORT);
    for (let i = 0; i < FRAMES; i++) await draw(page);
    const isTime = (time: number) => (window.lumencast!.session.sceneTime() ?? 0) >= time;
    await page.waitForFunction(isTime, time, { polling: 20, timeout: 0 });
    const shown = await page.evaluate(async (exposure) => {
      const { renderer, viewer } = window.lumencast!;
      if (exposure === undefined) await viewer.meter();
      else viewer.exposure = exposure;
      viewer.draw();
      return { url: renderer.domElement.toDataURL('image/jpeg', 0.9), exposure: viewer.exposure };
    }, exposure);
    await page.close();
    return { bytes: Buffer.from(shown.url.split(',')[1], 'base64'), exposure: shown.exposure };
  } finally {
    await server.kill();
  }
}
