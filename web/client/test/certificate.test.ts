import { createServer, type Server } from 'node:http';
import type { AddressInfo } from 'node:net';
import { afterEach, expect, it } from 'vitest';

import { developmentServer } from '../src/transport/certificate.js';

const HASH = 'ab'.repeat(32);
const servers: Server[] = [];

afterEach(() => {
  for (const server of servers.splice(0)) server.close();
});

async function serve(status: number, body: string): Promise<URL> {
  const server = createServer((request, response) => {
    response.writeHead(request.url === '/certificate.sha256' ? status : 404).end(body);
  });
  servers.push(server);
  await new Promise<void>((resolve) => server.listen(0, '127.0.0.1', resolve));
  return new URL(`https://127.0.0.1:${(server.address() as AddressInfo).port}/`);
}

const never = new AbortController().signal;

it('is taken from a server on this machine that offers it', async () => {
  const url = await serve(200, `${HASH}\n`);
  const found = await developmentServer(url, never);
  expect(found?.hash).toBe(HASH);
  expect(found?.base.href).toBe(`http://${url.host}/`);
});

it('is not taken where there is none, or something else', async () => {
  expect(await developmentServer(await serve(404, HASH), never)).toBeUndefined();
  expect(await developmentServer(await serve(200, '<html>'), never)).toBeUndefined();
  expect(await developmentServer(new URL('https://127.0.0.1:1/'), never)).toBeUndefined();
});

it('is not asked from other machines', async () => {
  expect(await developmentServer(new URL('https://light.example/'), never)).toBeUndefined();
});

it('is asked for at plain addresses, but not of a proxy', async () => {
  const url = await serve(200, HASH);
  url.protocol = 'http:';
  expect((await developmentServer(url, never))?.base.href).toBe(url.href);
  expect(await developmentServer(new URL('light/', url), never)).toBeUndefined();
});

it('is given up when the attempt is', async () => {
  const url = await serve(200, HASH);
  expect(await developmentServer(url, AbortSignal.abort())).toBeUndefined();
});
