/** What is found out about servers that give no connection; a browser's part is tested in one. */
import { createServer, type Server } from 'node:http';
import type { AddressInfo } from 'node:net';
import { afterEach, expect, it } from 'vitest';

import { diagnose } from '../src/transport/diagnosis.js';

const servers: Server[] = [];

afterEach(() => {
  for (const server of servers.splice(0)) server.close();
});

async function serve(status: number, body: string): Promise<URL> {
  const server = createServer((request, response) => {
    response.writeHead(request.url === '/lumencast.json' ? status : 404).end(body);
  });
  servers.push(server);
  await new Promise<void>((resolve) => server.listen(0, '127.0.0.1', resolve));
  return new URL(`http://127.0.0.1:${(server.address() as AddressInfo).port}/`);
}

async function found(base: URL, token?: string) {
  const target = { base, scene: 'cornell', client: 'c', key: 'k', token, certificateHash: undefined };
  const { problem, message, cause } = await diagnose({ ...target, transport: 'auto' }, base, 'no socket');
  expect(cause).toBe('no socket');
  return { problem, message };
}

it('nobody answers', async () => {
  const { problem, message } = await found(new URL('http://127.0.0.1:1/'));
  expect(problem).toBe('unreachable');
  expect(message).toContain('lumencast serve');
});

it('a proxy answers for a server that does not run', async () => {
  const { problem, message } = await found(await serve(502, '<h1>Bad Gateway</h1>'));
  expect(problem).toBe('unreachable');
  expect(message).toContain('(502)');
});

it.each([
  [200, '<!doctype html>'],
  [404, '{}'],
])('another program answers: %d %s', async (status, body) => {
  const { problem, message } = await found(await serve(status, body));
  expect(problem).toBe('stranger');
  expect(message).toContain(`(${status})`);
});

it('a server has another scene', async () => {
  const base = await serve(200, '{"broadcast":"sponza"}');
  const { problem, message } = await found(base);
  expect(problem).toBe('scene');
  expect(message).toContain(`connect to ${base}sponza`);
});

it('a server takes no session', async () => {
  const base = await serve(200, '{"broadcast":"cornell"}');
  expect(await found(base)).toMatchObject({
    problem: 'refused',
    message: expect.stringContaining('--token-to-read'),
  });
  expect((await found(base, 'x.y.z')).message).toContain('the token may be wrong or have expired');
});
