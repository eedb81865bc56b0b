/** A page of one's own, on a server of its own: what `connect` of the plugin says of each way to fail. */
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import type { Browser } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { type ServedPages, servePages } from '../../testing/page.js';
import { startProxy } from '../../testing/proxy.js';
import type { Outcome } from './own/own.js';
import { freePort, lumencastProgram, Server } from './server.js';

const program = lumencastProgram();
/** Stands for a page on another machine. */
const ELSEWHERE = 'page.test';

describe('a page of one’s own', () => {
  let folder: string;
  let pages: ServedPages;
  let browser: Browser;
  let server: Server;
  let guarded: Server;

  beforeAll(async () => {
    folder = mkdtempSync(join(tmpdir(), 'lumencast-own-'));
    pages = await servePages(resolve(import.meta.dirname, 'own'));
    browser = await launchBrowser(`--host-resolver-rules=MAP ${ELSEWHERE} 127.0.0.1`);
    server = await Server.start(program, 'cornell', await freePort(), ['--samples', '4']);
  }, 120_000);

  afterAll(async () => {
    await browser?.close();
    await server?.kill();
    await guarded?.kill();
    await pages?.close();
    rmSync(folder, { recursive: true, force: true });
  }, 30_000);

  /** What comes of it when a page at `host` connects to an address. */
  async function connected(address: string, host = 'localhost'): Promise<Outcome> {
    const page = await browser.newPage();
    try {
      await page.goto(`http://${host}:${pages.port}/`);
      await page.waitForFunction(() => window.own);
      return await page.evaluate((address) => window.own!(address), address);
    } finally {
      await page.close();
    }
  }

  it.each(['http', 'https'])(
    'on this machine is let in by %s',
    async (scheme) => {
      const outcome = await connected(`${scheme}://localhost:${server.port}/cornell`);
      expect(outcome).toMatchObject({ transport: 'webtransport', isLit: true });
      expect(outcome.objects).toBeGreaterThan(1);
    },
    60_000,
  );

  it('gets in through a reverse proxy that has the server under a path', async () => {
    const proxy = await startProxy('/light', server.port);
    try {
      const outcome = await connected(`http://localhost:${proxy.port}/light/cornell`);
      expect(outcome).toMatchObject({ transport: 'websocket', isLit: true });
      expect(proxy.asked).toContain('/light/scene/cornell.glb');
      expect(proxy.asked).toContain('websocket /light/');
      const wrong = await connected(`http://localhost:${proxy.port}/light/sponza`);
      expect(wrong).toMatchObject({ problem: 'scene', message: expect.stringContaining('/light/cornell') });
      const outside = await connected(`http://localhost:${proxy.port}/cornell`);
      expect(outside.problem).toBe('origin');
    } finally {
      await proxy.close();
    }
  }, 120_000);

  it('elsewhere is told how to be let in', async () => {
    const outcome = await connected(`http://127.0.0.1:${server.port}/cornell`, ELSEWHERE);
    expect(outcome.problem).toBe('origin');
    expect(outcome.message).toContain(`--allow-origin http://${ELSEWHERE}:${pages.port}`);
  }, 60_000);

  it('hears that nobody answers', async () => {
    const outcome = await connected(`http://localhost:${await freePort()}/cornell`);
    expect(outcome.problem).toBe('unreachable');
    expect(outcome.message).toContain('lumencast serve');
  }, 60_000);

  it('hears that another program answers', async () => {
    const outcome = await connected(`http://localhost:${pages.port}/cornell`);
    expect(outcome).toMatchObject({ problem: 'stranger', message: expect.stringContaining('port') });
  }, 60_000);

  it('hears which scene there is', async () => {
    const outcome = await connected(`http://localhost:${server.port}/sponza`);
    expect(outcome.problem).toBe('scene');
    expect(outcome.message).toContain(`connect to http://localhost:${server.port}/cornell`);
  }, 60_000);

  it('hears that it needs a token', async () => {
    const key = join(folder, 'key.jwk');
    execFileSync(program, ['token', 'cornell', '--token-key', key, '--generate']);
    const options = ['--samples', '4', '--token-to-read', '--token-key', key];
    guarded = await Server.start(program, 'cornell', await freePort(), options);
    const address = `http://localhost:${guarded.port}/cornell`;
    const without = await connected(address);
    expect(without).toMatchObject({ problem: 'refused', message: expect.stringContaining('token') });
    const wrong = await connected(`${address}?jwt=x.y.z`);
    expect(wrong).toMatchObject({
      problem: 'refused',
      message: expect.stringContaining('the token may be wrong or have expired'),
    });
  }, 90_000);
});
