/**
 * WebGPURenderer in a browser without WebGPU: three.js draws with WebGL 2 in its place, and light that
 * changes on the server must change in the picture.
 */
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, it } from 'vitest';
import { launchWithoutWebGPU } from '../../testing/chromium.js';
import { buildPage, look, openPage, type Pixel, shoot } from './browser.js';
import { freePort, lumencastProgram, Server } from './server.js';

const VIEWPORT = { width: 400, height: 300 };
/** A picture that is so many times as bright shows another light. */
const CHANGED = 1.5;

const program = lumencastProgram();

describe('WebGPURenderer without WebGPU', () => {
  let folder: string;
  let browser: Browser;
  let server: Server;
  let page: Page;

  beforeAll(async () => {
    folder = mkdtempSync(join(tmpdir(), 'lumencast-fallback-'));
    await buildPage(folder);
    browser = await launchWithoutWebGPU();
    const options = ['--page', folder, '--samples', '4..16'];
    server = await Server.start(program, 'cornell', await freePort(), options);
    page = await openPage(browser, server.address, VIEWPORT, { renderer: 'webgpu' });
    await page.evaluate(() => {
      const { light, viewer } = window.lumencast!;
      // Dark enough for brighter light to show.
      viewer.exposure /= 8;
      // Objects that stand still are those that the renderer does not look at anew.
      return light.edit({ edit: 'set_animation', animation: 0, playing: false });
    });
  }, 180_000);

  afterAll(async () => {
    await browser?.close();
    await server?.kill();
    rmSync(folder, { recursive: true, force: true });
  }, 30_000);

  it('shows each change of the light', async () => {
    const onWebGL = await page.evaluate(() => {
      const { renderer } = window.lumencast!;
      return 'backend' in renderer && 'isWebGLBackend' in renderer.backend;
    });
    expect(onWebGL).toBe(true);
    const first = await look(page, 'indirect');
    await multiplyLamp(16);
    const bright = await once((picture) => brightness(picture) > CHANGED * brightness(first));
    await shoot(page, 'fallback-bright.png');
    await multiplyLamp(1 / 16);
    await once((picture) => brightness(bright) > CHANGED * brightness(picture));
    await shoot(page, 'fallback.png');
  }, 120_000);

  function multiplyLamp(factor: number): Promise<void> {
    return page.evaluate((factor) => {
      const { light, viewer } = window.lumencast!;
      const [lamp] = viewer.lights;
      const node = light.content.nodeOf(lamp)!;
      return light.edit({ edit: 'set_light', node, intensity: lamp.intensity * factor });
    }, factor);
  }

  /** The picture, once it shows another light. */
  async function once(has: (picture: readonly Pixel[]) => boolean): Promise<Pixel[]> {
    let picture: Pixel[] = [];
    const changed = async () => has((picture = await look(page, 'indirect')));
    await expect.poll(changed, { timeout: 80_000 }).toBe(true);
    return picture;
  }
});

function brightness(picture: readonly Pixel[]): number {
  return picture.flat().reduce((sum, value) => sum + value, 0);
}
