/**
 * Who gets in, and by which way: a page that no authority vouches for, and one behind a certificate
 * and a token. Chromium is told that the server's name is this machine.
 */
import { execFileSync } from 'node:child_process';
import { createHash, X509Certificate } from 'node:crypto';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, describe, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { buildPage, openPage, PATIENCE } from './browser.js';
import { freePort, lumencastProgram, Server } from './server.js';

const NAME = 'lumencast.test';
const VIEWPORT = { width: 640, height: 480 };
const RESOLVE = `--host-resolver-rules=MAP ${NAME} 127.0.0.1`;

const program = lumencastProgram();

describe('a page on another machine', () => {
  let folder: string;
  let browser: Browser | undefined;
  let server: Server | undefined;

  const file = (name: string) => join(folder, name);
  const start = async (...options: string[]) => {
    const page = ['--page', file('page'), '--samples', '4..16', '--allow-host', NAME];
    server = await Server.start(program, 'cornell', await freePort(), [...page, ...options]);
    return server;
  };

  beforeAll(async () => {
    folder = mkdtempSync(join(tmpdir(), 'lumencast-access-'));
    await buildPage(file('page'));
  });

  afterEach(async () => {
    await browser?.close();
    await server?.kill();
    browser = server = undefined;
  });

  afterAll(() => rmSync(folder, { recursive: true, force: true }));

  it('says what plain http costs, and gets its light over a WebSocket', async () => {
    const { port } = await start();
    browser = await launchBrowser(RESOLVE);
    const page = await openPage(browser, `http://${NAME}:${port}`, VIEWPORT);
    expect(await page.evaluate(() => isSecureContext)).toBe(false);
    expect(await transportOf(page)).toBe('websocket');
    const said = await page.innerText('body');
    expect(said).toContain('WebTransport only to secure pages');
    expect(said).toContain('WebCodecs only to secure pages');
    expect(await moveLamp(page)).toBe('accepted');
  });

  it('has WebTransport by https, and edits with a token only', async () => {
    const spki = selfSigned(file('cert.pem'), file('key.pem'));
    const token = execFileSync(program, ['token', 'cornell', '--token-key', file('key.jwk'), '--generate'], {
      encoding: 'utf8',
    }).trim();
    const { port } = await start(
      ...['--tls-cert', file('cert.pem'), '--tls-key', file('key.pem')],
      ...['--token-key', file('key.jwk')],
    );
    browser = await launchBrowser(
      RESOLVE,
      // Stand for an authority that the browser knows; WebTransport takes no other.
      `--ignore-certificate-errors-spki-list=${spki}`,
      '--webtransport-developer-mode',
    );
    const address = `https://${NAME}:${port}`;

    const owner = await openPage(browser, address, VIEWPORT, { jwt: token });
    expect(await owner.evaluate(() => isSecureContext)).toBe(true);
    expect(await transportOf(owner)).toBe('webtransport');
    expect(await owner.innerText('body')).not.toContain('secure pages');
    expect(await moveLamp(owner)).toBe('accepted');
    await owner.close();

    const guest = await openPage(browser, address, VIEWPORT);
    expect(await moveLamp(guest)).toContain('token');
    await guest.close();

    const forger = await browser.newPage({ viewport: VIEWPORT });
    forger.setDefaultTimeout(PATIENCE);
    await forger.goto(`${address}/?jwt=${token.slice(0, -8)}AAAAAAAA`);
    await forger.getByText('the token may be wrong or have expired').waitFor();
    await forger.waitForFunction(() => window.lumencast, undefined);
    expect(await transportOf(forger)).toBeUndefined();
  });
});

function transportOf(page: Page): Promise<string | undefined> {
  return page.evaluate(() => {
    const { status } = window.lumencast!.session;
    return status.state === 'connected' ? status.transport : undefined;
  });
}

/** What the server answers to an edit. */
function moveLamp(page: Page): Promise<string> {
  return page.evaluate(async () => {
    const { light, viewer } = window.lumencast!;
    const node = light.content.nodeOf(viewer.lights[0])!;
    return light.edit({ edit: 'move_node', node, translation: [0.5, 0.5, 0.5] }).then(
      () => 'accepted',
      (error: Error) => error.message,
    );
  });
}

/** Writes a certificate for {@link NAME} with its key; the hash of its public key in base64. */
function selfSigned(cert: string, key: string): string {
  const subject = ['-subj', `/CN=${NAME}`, '-addext', `subjectAltName=DNS:${NAME}`];
  const made = ['-newkey', 'ec', '-pkeyopt', 'ec_paramgen_curve:P-256', '-nodes', '-days', '2'];
  execFileSync('openssl', ['req', '-x509', ...made, ...subject, '-keyout', key, '-out', cert], {
    stdio: 'ignore',
  });
  const { publicKey } = new X509Certificate(readFileSync(cert));
  return createHash('sha256')
    .update(publicKey.export({ type: 'spki', format: 'der' }))
    .digest('base64');
}
