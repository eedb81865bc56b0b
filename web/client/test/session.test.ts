import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';

import {
  type AcceptedEdit,
  ConnectError,
  EditError,
  type RefusedEdit,
  type Session,
  type Status,
} from '../src/api.js';
import type { Edit } from '../src/edit.js';
import { connect, type ConnectOptions } from '../src/session.js';
import { FakeNet } from './support/fake-link.js';
import { FakeServer, json, TICK } from './support/fake-server.js';
import { lightFile } from './support/light-file.js';
import { volumeOf } from './support/volumes.js';

const MOVE: Edit = { edit: 'move_node', node: 1, translation: [1, 2, 3] };
const sessions: Session[] = [];

beforeEach(() => {
  vi.useFakeTimers();
});

afterEach(() => {
  for (const session of sessions.splice(0)) session.close();
  vi.useRealTimers();
});

function open(net: FakeNet, options: ConnectOptions = {}): { session: Session; statuses: Status[] } {
  const session = connect('https://localhost:4443/test', { connector: net.connector, ...options });
  sessions.push(session);
  const statuses: Status[] = [session.status];
  session.on('status', (status) => statuses.push(status));
  return { session, statuses };
}

async function pass(seconds: number): Promise<void> {
  await vi.advanceTimersByTimeAsync(1000 * seconds);
}

/** Connects a session to a server. */
async function joined(server = new FakeServer(), options: ConnectOptions = {}) {
  const net = new FakeNet();
  const opened = open(net, options);
  await pass(0);
  net.link.deliver('catalog', server.catalog);
  net.link.tick(server);
  return { net, server, ...opened };
}

/** Lets a server tick for some seconds. */
async function run(net: FakeNet, server: FakeServer, seconds: number): Promise<void> {
  for (let time = 0; time < seconds; time += TICK) {
    await pass(TICK);
    net.link.tick(server);
  }
}

describe('connecting', () => {
  it('takes the scene, the token and the origin from the address', async () => {
    const net = new FakeNet();
    const session = connect('https://host:4443/a/b/?jwt=x.y.z', { connector: net.connector });
    sessions.push(session);
    await pass(0);
    expect([session.origin, session.scene]).toEqual(['https://host:4443', 'b']);
    expect(session.files).toBe('https://host:4443/a/scene/');
    expect(net.link.target).toMatchObject({ scene: 'b', token: 'x.y.z', client: session.client });
    expect(session.client).toMatch(/^[0-9a-f]{32}$/);
  });

  it('refuses addresses that name no scene or are none', () => {
    for (const url of ['https://host', 'https://host/', 'ws://host/scene', 'file:///scene', 'scene']) {
      expect(() => connect(url, { connector: new FakeNet().connector }), url).toThrow(TypeError);
    }
  });

  it('is ready once the server has said what it offers', async () => {
    const { session, statuses, net } = await joined();
    await session.ready;
    expect(statuses.map(({ state }) => state)).toEqual(['connecting', 'connected']);
    expect(session.catalog?.scene.name).toBe('test');
    expect([...net.link.readers.keys()].sort()).toEqual(
      ['catalog', 'f0/r0/l0', 'f0/r0/l1', 'f0/r0/l2', 'state'].sort(),
    );
    expect(volumeOf(session.light()).coefficients[0]).toBeCloseTo(1, 3);
  });

  it('goes on when the catalog tells another scale', async () => {
    const { net, server, session } = await joined();
    const told = vi.fn();
    session.on('catalog', told);
    await run(net, server, 1);
    const readers = new Map(net.link.readers);
    const { updateRate, layers } = session.stats;
    server.scaleLog2 = 7;
    net.link.deliver('catalog', server.catalog);
    expect(session.catalog?.fields[0].scale).toBe(128);
    expect(session.light().fields[0].field.scale).toBe(128);
    expect(net.link.readers).toEqual(readers);
    for (const [track, reader] of readers) expect(net.link.readers.get(track), track).toBe(reader);
    expect(session.stats).toMatchObject({ updateRate, layers, dropped: 0 });
    expect(told).not.toHaveBeenCalled();
    await run(net, server, 0.2);
    expect(session.stats.dropped).toBe(0);
  });

  it('reads anew when the catalog offers something else', async () => {
    const { net, session } = await joined();
    const told = vi.fn();
    session.on('catalog', told);
    net.link.deliver('catalog', new FakeServer({ regions: 2 }).catalog);
    expect([...net.link.readers.keys()]).toContain('f0/r1/l0');
    expect(told).toHaveBeenCalledOnce();
  });

  it('tries again, ever more slowly, and says why', async () => {
    const net = new FakeNet();
    net.refuse = 'connection refused';
    const { statuses } = open(net);
    await pass(8);
    const lost = statuses.filter((status) => status.state === 'lost');
    expect(lost.map(({ retryIn }) => retryIn)).toEqual([0.25, 0.5, 1, 2, 2, 2, 2]);
    expect(lost[0].reason).toContain('connection refused');
    net.refuse = undefined;
    await pass(2);
    net.link.deliver('catalog', new FakeServer().catalog);
    expect(statuses.at(-1)?.state).toBe('connected');
  });

  it('says so when the server has no such scene', async () => {
    const { statuses } = open(new FakeNet());
    await pass(6);
    const lost = statuses.find((status) => status.state === 'lost');
    expect(lost).toMatchObject({ problem: 'scene', reason: expect.stringContaining('no scene named test') });
  });

  it.each([
    {
      casts: 'cornell',
      problem: 'scene',
      reason: 'it casts cornell: connect to https://localhost:4443/cornell',
    },
    { casts: 'test', problem: 'silent', reason: 'sends no light' },
  ])('asks a server that sends no catalog: it casts $casts', async ({ casts, problem, reason }) => {
    const net = new FakeNet();
    const { statuses } = open(net);
    await pass(0);
    net.link.scene = casts;
    await pass(6);
    const lost = statuses.find((status) => status.state === 'lost');
    expect(lost).toMatchObject({ problem, reason: expect.stringContaining(reason) });
  });

  it('says what its connector knows, and that a connection broke', async () => {
    const net = new FakeNet();
    net.refuse = new ConnectError('origin', 'not from there');
    const { statuses } = open(net);
    await pass(0.1);
    expect(statuses.at(-1)).toMatchObject({ state: 'lost', problem: 'origin', reason: 'not from there' });
    net.refuse = undefined;
    await pass(0.5);
    net.link.deliver('catalog', new FakeServer().catalog);
    net.link.break('gone');
    await pass(0);
    expect(statuses.at(-1)).toEqual({ state: 'lost', reason: 'gone', retryIn: expect.any(Number) });
  });

  it('stops for good at a server of another wire version', async () => {
    const net = new FakeNet();
    const { session, statuses } = open(net);
    await pass(0);
    net.link.deliver('catalog', json({ lumencast: 2 }));
    expect(statuses.at(-1)).toMatchObject({ state: 'closed', problem: 'version' });
    await expect(session.ready).rejects.toThrow('version 2');
    await pass(60);
    expect(net.links.length).toBe(1);
    expect(net.link.closed).toBe(true);
  });
});

describe('saved light', () => {
  const saved = () => lightFile(new FakeServer({ brightness: () => 7 }));
  const red = (session: Session) => volumeOf(session.light()).coefficients[0];

  it('is shown with no server, while one is looked for', async () => {
    const net = new FakeNet();
    net.refuse = 'connection refused';
    const { session, statuses } = open(net, { saved: saved() });
    expect(session.catalog).toMatchObject({ scene: { name: 'test', root: 'test.glb' } });
    expect(red(session)).toBeCloseTo(7, 2);
    expect([session.light().age, session.sceneTime()]).toEqual([undefined, 0]);
    const ready = vi.fn();
    void session.ready.then(ready, () => {});
    await pass(3);
    expect(statuses.at(-1)?.state).toBe('lost');
    expect(red(session)).toBeCloseTo(7, 2);
    expect(ready).not.toHaveBeenCalled();
  });

  it('gives way to the server’s light, and says so once', async () => {
    const net = new FakeNet();
    const { session } = open(net, { saved: saved() });
    const [catalogs, snapshots] = [vi.fn(), vi.fn()];
    session.on('catalog', catalogs);
    session.on('snapshot', snapshots);
    await pass(0);
    const server = new FakeServer({ brightness: () => 9 });
    net.link.deliver('catalog', server.catalog);
    await session.ready;
    expect(red(session)).toBeCloseTo(7, 2);
    net.link.tick(server);
    await run(net, server, 1);
    expect(red(session)).toBeCloseTo(9, 2);
    expect(session.light().age).toBeLessThan(TICK);
    expect(catalogs).toHaveBeenCalledOnce();
    expect(snapshots).toHaveBeenCalledOnce();
  });

  it('stays when the session ends, and edits say why it did', async () => {
    const net = new FakeNet();
    const { session } = open(net, { saved: saved() });
    session.close('there is no server');
    expect(session.status).toEqual({ state: 'closed', reason: 'there is no server' });
    expect(red(session)).toBeCloseTo(7, 2);
    await expect(session.edit(MOVE)).rejects.toMatchObject({ kind: 'closed', message: 'there is no server' });
  });

  it('that is none fails where it is given', () => {
    const net = new FakeNet();
    expect(() => open(net, { saved: new Uint8Array(20) })).toThrow('not a light file');
    expect(net.links).toEqual([]);
  });
});

describe('after a loss', () => {
  it('keeps the light, connects again and goes on without a new snapshot', async () => {
    const { net, server, session, statuses } = await joined();
    const snapshots = vi.fn();
    session.on('snapshot', snapshots);
    await run(net, server, 1);
    const before = volumeOf(session.light()).coefficients[0];
    net.link.break('the cable was pulled');
    await pass(0.1);
    expect(statuses.at(-1)).toEqual({ state: 'lost', reason: 'the cable was pulled', retryIn: 0.25 });
    expect(volumeOf(session.light()).coefficients[0]).toBeGreaterThanOrEqual(before);
    await pass(0.3);
    expect(net.links.length).toBe(2);
    net.link.deliver('catalog', server.catalog);
    expect(statuses.at(-1)?.state).toBe('connected');
    net.link.tick(server);
    expect(snapshots).not.toHaveBeenCalled();
  });

  it('notices silence', async () => {
    const { net, server, statuses } = await joined();
    await run(net, server, 1);
    await pass(2.9);
    expect(statuses.at(-1)?.state).toBe('connected');
    await pass(0.5);
    expect(statuses.find(({ state }) => state === 'lost')).toMatchObject({
      reason: expect.stringMatching(/^nothing/),
    });
    expect(net.links[0].closed).toBe(true);
  });

  it('does not take its own sleep for silence', async () => {
    const { net, server, statuses } = await joined();
    await run(net, server, 1);
    // As when the page drew for a minute, or was a tab in the background.
    const now = performance.now.bind(performance);
    const clock = vi.spyOn(performance, 'now').mockImplementation(() => now() + 60_000);
    await pass(0.5);
    net.link.tick(server);
    await run(net, server, 1);
    clock.mockRestore();
    expect(statuses.at(-1)?.state).toBe('connected');
    expect(net.links.length).toBe(1);
  });

  it('knows a restarted server: scene anew, tracks anew, edits on their way rejected', async () => {
    const { net, server, session } = await joined();
    await run(net, server, 1);
    const snapshots = vi.fn();
    session.on('snapshot', snapshots);
    const edit = session.edit(MOVE);
    edit.catch(() => {});
    net.link.break('gone');
    await pass(0.3);
    const fresh = new FakeServer({ epoch: '00000000000000bb' });
    net.link.deliver('catalog', fresh.catalog);
    await expect(edit).rejects.toMatchObject({ kind: 'restarted' });
    net.link.tick(fresh);
    expect(snapshots).toHaveBeenCalledOnce();
    const next = session.edit(MOVE);
    expect(net.link.edits).toEqual([{ seq: 1, edit: MOVE }]);
    fresh.accept(MOVE, session.client, 1);
    net.link.tick(fresh);
    await next;
  });
});

describe('edits', () => {
  it('resolve once accepted and come back in the server’s order', async () => {
    const { net, server, session } = await joined();
    const edits: AcceptedEdit[] = [];
    session.on('edit', (edit) => edits.push(edit));
    const edit = session.edit(MOVE);
    await pass(0.01);
    expect(net.link.edits).toEqual([{ seq: 1, edit: MOVE }]);
    expect(session.pending).toEqual([MOVE]);
    server.accept({ ...MOVE, node: 2 } as Edit, 'another', 5);
    server.accept(MOVE, session.client, 1);
    net.link.tick(server);
    await edit;
    expect(edits.map(({ own }) => own)).toEqual([false, true]);
    expect(session.stats.pending).toBe(0);
  });

  it('reject with the reason when refused', async () => {
    const { net, server, session } = await joined();
    const refused: RefusedEdit[] = [];
    session.on('refused', (edit) => refused.push(edit));
    const edit = session.edit(MOVE);
    edit.catch(() => {});
    await pass(0.01);
    server.refuse(session.client, 1, 'node 1 does not exist');
    net.link.tick(server);
    await expect(edit).rejects.toEqual(new EditError('refused', 'node 1 does not exist'));
    expect(refused).toEqual([{ seq: 1, edit: MOVE, reason: 'node 1 does not exist' }]);
  });

  it('made before there is a connection, or while it is lost, are sent when there is one', async () => {
    const net = new FakeNet();
    const { session } = open(net);
    const server = new FakeServer();
    const first = session.edit(MOVE);
    await pass(0);
    expect(net.link.edits).toEqual([]);
    net.link.deliver('catalog', server.catalog);
    expect(net.link.edits.map(({ seq }) => seq)).toEqual([1]);
    net.link.break('gone');
    const second = session.edit(MOVE);
    await pass(0.3);
    net.link.deliver('catalog', server.catalog);
    expect(net.link.edits.map(({ seq }) => seq)).toEqual([1, 2]);
    server.accept(MOVE, session.client, 1);
    server.accept(MOVE, session.client, 2);
    net.link.tick(server);
    await Promise.all([first, second]);
  });

  it('are sent again without an answer, and given up in the end', async () => {
    const { net, server, session } = await joined();
    const edit = session.edit(MOVE);
    edit.catch(() => {});
    await run(net, server, 7);
    expect(net.link.edits.map(({ seq }) => seq)).toEqual([1, 1, 1]);
    await run(net, server, 4);
    await expect(edit).rejects.toMatchObject({ kind: 'unanswered' });
    expect(session.pending).toEqual([]);
  });

  it('wait longer while the server may be reading a file', async () => {
    const { net, server, session } = await joined();
    const before = session.edit(MOVE);
    const add = session.edit({ edit: 'add_instance', source: { file: 'large.glb' } });
    const after = session.edit(MOVE);
    before.catch(() => {});
    await run(net, server, 20);
    await expect(before).rejects.toMatchObject({ kind: 'unanswered' });
    expect(session.pending.map(({ edit }) => edit)).toEqual(['add_instance', 'move_node']);
    server.accept({ edit: 'add_instance', source: { file: 'large.glb' }, node: 9 }, session.client, 2);
    server.accept(MOVE, session.client, 3);
    net.link.tick(server);
    await Promise.all([add, after]);
  });

  it('reject when the session is closed', async () => {
    const { session, net } = await joined();
    const edit = session.edit(MOVE);
    edit.catch(() => {});
    await pass(0.01);
    session.close();
    await expect(edit).rejects.toMatchObject({ kind: 'closed' });
    await expect(session.edit(MOVE)).rejects.toMatchObject({ kind: 'closed' });
    expect(net.link.closed).toBe(true);
    expect(session.status.state).toBe('closed');
  });

  it('are temporary where a program says so, also when they are sent again', async () => {
    const { net, server, session } = await joined();
    const lamp: Edit = { edit: 'add_light', name: 'lamp', light: { type: 'point' } };
    const edits = [session.edit(lamp, { temporary: true }), session.edit(lamp, { temporary: false })];
    await pass(0.01);
    const first = { seq: 1, edit: lamp, temporary: true };
    expect(net.link.edits).toEqual([first, { seq: 2, edit: lamp }]);
    net.link.break('gone');
    await pass(0.3);
    net.link.deliver('catalog', server.catalog);
    expect(net.link.edits).toEqual([first, { seq: 2, edit: lamp }]);
    for (const seq of [1, 2]) server.accept({ ...lamp, node: 8 + seq }, session.client, seq);
    net.link.tick(server);
    await Promise.all(edits);
    await expect(session.edit(MOVE, { temporary: true })).rejects.toThrow('move_node adds nothing');
  });

  it('that are none fail where they were made', async () => {
    const { session, net } = await joined();
    await expect(session.edit({ edit: 'move_node', node: 1, translation: [NaN, 0, 0] })).rejects.toThrow(
      TypeError,
    );
    await expect(session.edit({ edit: 'remove_node' } as unknown as Edit)).rejects.toThrow(TypeError);
    expect(net.link.edits).toEqual([]);
  });
});

describe('reading', () => {
  it('puts near regions and low layers first', async () => {
    const server = new FakeServer({ regions: 3 });
    const { net, session } = await joined(server);
    // The volume runs from x = −3 to 3: region 2 is nearest.
    session.setCamera([5, 0, 0]);
    await pass(0.3);
    const byPriority = [...net.link.readers].sort(([, a], [, b]) => b.priority - a.priority);
    expect(byPriority.map(([track]) => track)).toEqual([
      ...['catalog', 'state', 'f0/r2/l0', 'f0/r1/l0', 'f0/r0/l0'],
      ...['f0/r2/l1', 'f0/r1/l1', 'f0/r0/l1', 'f0/r2/l2', 'f0/r1/l2', 'f0/r0/l2'],
    ]);
    session.setCamera([-5, 0, 0]);
    await pass(0.3);
    const priority = (track: string) => net.link.readers.get(track)?.priority ?? NaN;
    expect(priority('f0/r0/l0')).toBeGreaterThan(priority('f0/r2/l0'));
  });

  it('counts frames that are of no use and goes on', async () => {
    const { net, server, session } = await joined();
    net.link.deliver('state', new Uint8Array([1, 2, 3]));
    net.link.deliver('catalog', new Uint8Array());
    net.link.deliver('f0/r0/l0', new Uint8Array([9]));
    expect(session.stats.dropped).toBe(3);
    await run(net, server, 1);
    expect(session.stats.dropped).toBe(3);
    expect(session.light().fields[0].tick).toBe(server.tick);
  });

  it('survives a listener that throws', async () => {
    const { net, server, session } = await joined();
    const uncaught = vi.fn();
    process.once('uncaughtException', uncaught);
    const heard = vi.fn();
    session.on('light', () => {
      throw new Error('a slip in the page');
    });
    session.on('light', heard);
    net.link.tick(server);
    expect(heard).toHaveBeenCalledOnce();
    await pass(0);
    await vi.waitFor(() => expect(uncaught).toHaveBeenCalled());
  });

  it('measures', async () => {
    const { net, server, session } = await joined();
    await run(net, server, 4);
    const { tickRate, updateRate, bandwidth, bandwidthByTrack, tickMs, samples, layers, age } = session.stats;
    expect(tickRate).toBeCloseTo(25, -0.5);
    expect(updateRate).toBeCloseTo(25, -0.5);
    expect([tickMs, samples, layers]).toEqual([20, 16, 3]);
    expect(age).toBeLessThan(TICK);
    const sum = [...bandwidthByTrack.values()].reduce((a, b) => a + b);
    expect(sum / bandwidth).toBeCloseTo(1, 1);
    const timings = session.timings();
    expect(timings.length).toBe(101);
    for (const { tick, clock, arrived, decoded } of timings) {
      expect(clock).toBe(server.clockOf(tick));
      expect(decoded).toBeGreaterThanOrEqual(arrived);
    }
    expect(timings[100].arrived - timings[0].arrived).toBeCloseTo(4000, 3);
  });

  it('does not take tracks that it does not read for lost ones', async () => {
    // 100 regions: more tracks than a connection carries.
    const { net, server, session } = await joined(new FakeServer({ regions: 100 }));
    expect(net.link.readers.size).toBe(82);
    await run(net, server, 4);
    expect(session.stats.layers).toBe(3);
  });

  it('brings light to more regions than it can read at once, again and again', async () => {
    const regions = 112;
    const { net, server, session } = await joined(new FakeServer({ regions }));
    const ticks = new Map<number, number>();
    session.on('light', ({ region, tick }) => ticks.set(region, tick));
    // The fake server has a keyframe every 1.6 s, no matter who begins to read: so long a turn may take.
    const round = 3 * 1.6 + 1;
    await run(net, server, 2 * round);
    expect(session.light().fields[0].regions).toEqual({ lit: regions, all: regions });
    expect(ticks.size).toBe(regions);
    expect(Math.min(...ticks.values())).toBeGreaterThan(server.tick - round / TICK);
    expect(net.link.readers.size).toBeLessThanOrEqual(82);
    expect(session.stats.layers).toBe(3);
  });

  it('drops layers on a link that is too slow, and takes them back when it recovers', async () => {
    const { net, server, session } = await joined();
    await run(net, server, 2);
    // From here the link carries the state and layer 0, and only a third of the rest.
    const tick = (slow: boolean) => {
      const { state, probes } = server.step();
      net.link.deliver('state', state);
      const carried = probes.filter(({ track }) => !slow || track.endsWith('l0') || server.tick % 3 === 0);
      net.link.deliverAll(carried);
    };
    for (let time = 0; time < 8; time += TICK) {
      await pass(TICK);
      tick(true);
    }
    expect(session.stats.layers).toBe(1);
    expect([...net.link.readers.keys()].sort()).toEqual(['catalog', 'f0/r0/l0', 'state']);
    for (let time = 0; time < 30; time += TICK) {
      await pass(TICK);
      tick(false);
    }
    expect(session.stats.layers).toBe(3);
  });
});
