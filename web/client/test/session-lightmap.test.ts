/** A session that reads lightmaps: what it subscribes to, and what it fetches. */
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';

import { isLightmap } from '../src/codec/catalog.js';
import { connect, type ConnectOptions } from '../src/session.js';
import type { Session } from '../src/api.js';
import { FakeDecoders } from './support/fake-decoder.js';
import { FakeNet } from './support/fake-link.js';
import { FakeServer, json, TICK } from './support/fake-server.js';
import { lightmapFile } from './support/light-file.js';
import { FIELD, LightmapServer } from './support/lightmap-server.js';
import { triangle } from './support/resource-writer.js';

const sessions: Session[] = [];
/** What the server has, by address; `undefined` where nobody answers. */
let offered: Map<string, Uint8Array | number | undefined>;
let asked: string[];

beforeEach(() => {
  vi.useFakeTimers();
  offered = new Map();
  asked = [];
  vi.stubGlobal('fetch', (address: URL, { signal }: RequestInit) => {
    asked.push(address.href);
    signal?.throwIfAborted();
    const answer = offered.get(address.href);
    if (answer === undefined) return Promise.reject(new TypeError('nobody answers'));
    if (typeof answer === 'number') return Promise.resolve(new Response(null, { status: answer }));
    return Promise.resolve(new Response(answer.slice()));
  });
});

afterEach(() => {
  for (const session of sessions.splice(0)) session.close();
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

async function pass(seconds: number): Promise<void> {
  await vi.advanceTimersByTimeAsync(1000 * seconds);
}

function addressOf(hash: string): string {
  return `https://localhost:4443/base/resources/${hash}`;
}

/** The server has its resources, but for some. */
function offer(server: LightmapServer, except: readonly string[] = []): void {
  for (const { hash, bytes } of server.resources) {
    if (!except.includes(hash)) offered.set(addressOf(hash), bytes);
  }
}

async function joined(server: LightmapServer, options: ConnectOptions = {}) {
  const net = new FakeNet();
  const session = connect('https://localhost:4443/base/test', { connector: net.connector, ...options });
  sessions.push(session);
  await pass(0);
  net.link.deliver('catalog', server.catalog);
  step(net, server, 1);
  await pass(0);
  return { net, session };
}

function step(net: FakeNet, server: LightmapServer, value: number): void {
  const frames = server.step(value);
  net.link.deliver('state', server.state());
  net.link.deliverAll(frames);
}

function lightOf(session: Session) {
  return session.light().fields.filter(isLightmap)[0];
}

function nodes(session: Session): number[] | undefined {
  return lightOf(session).layout?.surfaces.map(({ node }) => node);
}

describe('resources', () => {
  it('are fetched from the server’s address: layouts, then their charts', async () => {
    const server = new LightmapServer();
    offer(server);
    const { session } = await joined(server);
    await pass(0.1);
    expect(asked).toEqual(server.resources.map(({ hash }) => addressOf(hash)));
    expect(nodes(session)).toEqual([1, 2]);
    expect(session.stats.dropped).toBe(0);
    await pass(60);
    expect(asked.length).toBe(3);
  });

  it('that cannot be had are asked for again, ever more seldom', async () => {
    const server = new LightmapServer();
    const [, first, last] = server.resources;
    offer(server, [last.hash]);
    offered.set(addressOf(last.hash), 404);
    const { session } = await joined(server);
    const times = () => asked.filter((address) => address === addressOf(last.hash)).length;
    const counts = [];
    for (const seconds of [0.5, 1, 2, 4, 8, 16, 16]) {
      await pass(seconds);
      counts.push(times());
    }
    expect(counts).toEqual([1, 2, 3, 4, 5, 6, 7]);
    expect(nodes(session)).toEqual([1]);
    offered.set(addressOf(last.hash), last.bytes);
    await pass(16);
    expect(nodes(session)).toEqual([1, 2]);
    expect(asked.filter((address) => address === addressOf(first.hash)).length).toBe(1);
  });

  it('of another hash, or without end, are refused and asked for again', async () => {
    const server = new LightmapServer();
    offered.set(addressOf(server.layout.hash), triangle(4).bytes);
    const { session } = await joined(server);
    await pass(0.5);
    expect([nodes(session), asked.length]).toEqual([undefined, 1]);
    offered.set(addressOf(server.layout.hash), new Uint8Array((64 << 20) + 1));
    await pass(1);
    expect([nodes(session), asked.length]).toEqual([undefined, 2]);
    offer(server);
    await pass(2);
    expect(nodes(session)).toEqual([1, 2]);
  });

  it('that make no sense are dropped, and not asked for again', async () => {
    const server = new LightmapServer();
    server.shape.layout = triangle(4).hash;
    offered.set(addressOf(triangle(4).hash), triangle(4).bytes);
    const { session } = await joined(server);
    await pass(60);
    expect([asked.length, session.stats.dropped]).toEqual([1, 1]);
  });

  it('of another layout are fetched while the light goes on', async () => {
    const server = new LightmapServer();
    offer(server);
    const { net, session } = await joined(server);
    await pass(0.1);
    const readers = new Map(net.link.readers);
    const told = vi.fn();
    session.on('catalog', told);
    const moved = new LightmapServer({ surfaces: [{ node: 1, charts: triangle(4) }] });
    offer(moved);
    net.link.deliver('catalog', moved.catalog);
    step(net, server, 2);
    await pass(0.1);
    expect(nodes(session)).toEqual([1]);
    expect(asked.slice(3)).toEqual([addressOf(moved.layout.hash)]);
    expect(session.stats.dropped).toBe(0);
    expect(told).not.toHaveBeenCalled();
    for (const [track, reader] of readers) expect(net.link.readers.get(track), track).toBe(reader);
  });

  it('are fetched a few at a time, and no more once the session has ended', async () => {
    const surfaces = Array.from({ length: 20 }, (_, node) => ({ node, charts: triangle(2 + node), y: 0 }));
    const server = new LightmapServer({ pageSize: 64, surfaces });
    offered.set(addressOf(server.layout.hash), server.layout.bytes);
    const { session } = await joined(server);
    await pass(0);
    // All charts fail and rest, six at a time.
    expect(new Set(asked).size).toBe(21);
    session.close();
    const before = asked.length;
    await pass(60);
    expect([asked.length, vi.getTimerCount()]).toEqual([before, 0]);
  });
});

describe('a lightmap', () => {
  it('is read at one layer', async () => {
    const { net } = await joined(new LightmapServer({ pages: 3 }));
    expect([...net.link.readers.keys()].sort()).toEqual(
      ['catalog', 'state', ...[0, 1, 2].map((region) => `f${FIELD}/r${region}/l0`)].sort(),
    );
  });

  it('tells nothing of how many layers of volumes the link carries', async () => {
    const [volumes, lumels] = [new FakeServer(), new LightmapServer({ pages: 1 })];
    const net = new FakeNet();
    const session = connect('https://localhost:4443/test', { connector: net.connector });
    sessions.push(session);
    await pass(0);
    const [catalog, other] = [volumes, lumels].map((server) =>
      JSON.parse(new TextDecoder().decode(server.catalog)),
    );
    catalog.fields.push(...other.fields);
    net.link.deliver('catalog', json(catalog));
    // Its updates are seldom, late, and numbered otherwise.
    lumels.update = 5999;
    for (let tick = 0; tick < 500; tick++) {
      await pass(TICK);
      net.link.tick(volumes);
      if (tick % 10 === 9) net.link.deliverAll(lumels.step(tick));
    }
    expect(session.stats).toMatchObject({ layers: 3, dropped: 0 });
    expect(session.stats.updateRate).toBeGreaterThan(20);
    expect(lightOf(session).regions.length).toBe(1);
  });

  it('from a file stays until the server’s light comes', async () => {
    const server = new LightmapServer();
    const saved = lightmapFile(new LightmapServer(), 4);
    const { net, session } = await joined(server, { saved });
    expect(asked).toEqual([]);
    expect(nodes(session)).toEqual([1, 2]);
    step(net, server, 2);
    expect(lightOf(session).tick).toBe(1);
  });

  it('that travels as video is told when its picture comes', async () => {
    const decoders = new FakeDecoders();
    const server = new LightmapServer({ coding: 'h264', pages: 1 });
    const { session } = await joined(server, { openDecoder: decoders.open });
    const told = vi.fn();
    session.on('light', told);
    expect(session.light().fields).toEqual([]);
    await decoders.answer();
    expect(told).toHaveBeenCalledExactlyOnceWith({ field: FIELD, region: 0, tick: 0 });
    expect(lightOf(session).regions[0].picture.kind).toBe('planes');
    session.close();
    expect(decoders.closed).toEqual([0]);
  });

  it('that travels as video is not read where nobody decodes it, and volumes are', async () => {
    const server = new LightmapServer({ coding: 'h264_stacked' });
    const { net, session } = await joined(server);
    expect(session.unshown.map(({ id }) => id)).toEqual([FIELD]);
    expect([...net.link.readers.keys()].sort()).toEqual(['catalog', 'state']);
    expect([session.stats.dropped, session.status.state]).toEqual([0, 'connected']);
    const catalog = JSON.parse(new TextDecoder().decode(server.catalog));
    const grid = { center: [0, 0, 0], rotation: [0, 0, 0, 1], size: [1, 1, 1], resolution: [1, 1, 1] };
    const regions = [{ id: 0, min: [0, 0, 0], size: [1, 1, 1] }];
    const shape = { basis: 'sh', order: 1, grid, regions, layers: 1 };
    catalog.fields.push({ id: 1, use: 'all', kind: 'volume', shape });
    net.link.deliver('catalog', json(catalog));
    expect([...net.link.readers.keys()].sort()).toEqual(['catalog', 'f1/r0/l0', 'state']);
  });
});
