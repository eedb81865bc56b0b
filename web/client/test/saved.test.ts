/** Saved light without a server. */
import { createServer, type Server } from 'node:http';
import type { AddressInfo } from 'node:net';
import { afterEach, describe, expect, it, vi } from 'vitest';

import type { Status } from '../src/api.js';
import { isLightmap } from '../src/codec/catalog.js';
import { fetchLight, openLight } from '../src/saved.js';
import { FakeServer } from './support/fake-server.js';
import { lightFile, lightmapFile, record } from './support/light-file.js';
import { LightmapServer } from './support/lightmap-server.js';
import { join, varint } from './support/probe-encoder.js';
import { volumeOf } from './support/volumes.js';

const saved = lightFile(new FakeServer({ brightness: () => 7 }));
const servers: Server[] = [];

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
  for (const server of servers.splice(0)) server.close();
});

describe('opened light', () => {
  it('has its light and connects to nothing', async () => {
    vi.useFakeTimers();
    const fetch = vi.fn();
    vi.stubGlobal('fetch', fetch);
    const session = openLight(saved, { files: 'https://host/shop/room.glb' });
    await session.ready;
    expect(session.status).toEqual({ state: 'saved' });
    expect([session.scene, session.files]).toEqual(['test', 'https://host/shop/']);
    expect(volumeOf(session.light()).coefficients[0]).toBeCloseTo(7, 1);
    expect(session.light().age).toBeUndefined();
    expect(session.stats).toMatchObject({ updateRate: 0, bandwidth: 0, pending: 0 });
    expect([fetch.mock.calls.length, vi.getTimerCount()]).toEqual([0, 0]);
  });

  it('passes over frames and records that it does not know', async () => {
    const server = new FakeServer({ brightness: () => 7 });
    // The fake server's field 9 is of a kind that nobody knows.
    const file = join(lightFile(server), record(1, varint(9), varint(0), [255, 255]), record(200, [1]));
    const session = openLight(file);
    await session.ready;
    expect(session.light().fields.map(({ field }) => field.id)).toEqual([0]);
  });

  it('may hold a lightmap', () => {
    const session = openLight(lightmapFile(new LightmapServer(), 4));
    const [{ layout, regions }] = session.light().fields.filter(isLightmap);
    expect([layout?.surfaces.length, regions.length, session.unshown]).toEqual([2, 2, []]);
  });

  it('refuses edits, and can be closed', async () => {
    const session = openLight(saved);
    const edit = session.edit({ edit: 'remove_node', node: 1 });
    await expect(edit).rejects.toMatchObject({
      kind: 'saved',
      message: expect.stringContaining('no server'),
    });
    const statuses: Status[] = [];
    session.on('status', (status) => statuses.push(status));
    session.close();
    session.close();
    expect(statuses).toEqual([{ state: 'closed', reason: 'the session was closed' }]);
  });

  it('must be one', () => {
    expect(() => openLight(new Uint8Array(20))).toThrow('not a light file');
  });
});

describe('fetching', () => {
  async function serve(status: number, type: string, body: Uint8Array): Promise<string> {
    const server = createServer((_, response) => {
      response.writeHead(status, { 'content-type': type }).end(body);
    });
    servers.push(server);
    await new Promise<void>((resolve) => server.listen(0, '127.0.0.1', resolve));
    return `http://127.0.0.1:${(server.address() as AddressInfo).port}/room.light`;
  }

  it('gives the bytes', async () => {
    const address = await serve(200, 'application/octet-stream', saved);
    expect(await fetchLight(address)).toEqual(saved);
  });

  it('names a file that is not there', async () => {
    const missing = await serve(404, 'text/plain', new Uint8Array());
    await expect(fetchLight(missing)).rejects.toThrow(`${missing} is missing (HTTP 404)`);
    const page = await serve(200, 'text/html', new Uint8Array());
    await expect(fetchLight(page)).rejects.toThrow(`${page} is missing`);
    await expect(fetchLight('http://127.0.0.1:1/room.light')).rejects.toThrow('cannot be read');
  });
});
