import { describe, expect, it } from 'vitest';

import { Cache, type CacheEvent } from '../src/cache.js';
import { isVolume } from '../src/codec/catalog.js';
import type { Edit } from '../src/edit.js';
import { WireError } from '../src/wire-error.js';
import { FakeServer, json, type SentFrame, TICK } from './support/fake-server.js';
import { lightFile, record } from './support/light-file.js';
import { join } from './support/probe-encoder.js';
import { random } from './support/random.js';
import { SimulatedLink } from './support/simulated-link.js';
import { volumeOf } from './support/volumes.js';

const ME = 'me';

function joined(server: FakeServer): Cache {
  const cache = new Cache(ME);
  cache.addCatalog(server.catalog, 0);
  cache.events();
  return cache;
}

function feed(cache: Cache, frames: { state?: Uint8Array; probes?: SentFrame[] }, now: number): void {
  if (frames.state) cache.addState(frames.state, now);
  for (const { track, bytes } of frames.probes ?? []) addLight(cache, track, bytes, now);
}

function addLight(cache: Cache, track: string, bytes: Uint8Array, now: number): void {
  const [field, region, layer] = track.match(/\d+/g)!.map(Number);
  cache.addLight(field, region, layer, bytes, now);
}

/** Red of the first probe's c0. */
function shown(cache: Cache, now: number): number {
  return volumeOf(cache.light(now)).coefficients[0];
}

/** How many regions each volume that is shown has. */
function regionCounts(cache: Cache, now: number): number[] {
  const volumes = cache.light(now).fields.filter(isVolume);
  return volumes.map(({ field }) => field.shape.regions.length);
}

function move(node: number, x: number): Edit {
  return { edit: 'move_node', node, translation: [x, 0, 0] };
}

describe('light', () => {
  it('shows the first update at once and blends to each next one over the interval between them', () => {
    const server = new FakeServer();
    const cache = joined(server);
    expect(cache.light(0).fields).toEqual([]);
    feed(cache, server.step(), 10);
    expect(shown(cache, 10)).toBeCloseTo(1, 3);
    feed(cache, server.step(), 10.04);
    expect(shown(cache, 10.04)).toBeCloseTo(1, 3);
    expect(shown(cache, 10.06)).toBeCloseTo(1.5, 3);
    expect(shown(cache, 10.08)).toBeCloseTo(2, 3);
    // Overdue: it holds.
    expect(shown(cache, 11)).toBeCloseTo(2, 3);
    // Early: it goes on from what is shown.
    feed(cache, server.step(), 11.04);
    const midway = shown(cache, 11.06);
    feed(cache, server.step(), 11.06);
    expect(shown(cache, 11.06)).toBeCloseTo(midway, 5);
  });

  it('tells by the revision whether anything changed', () => {
    const server = new FakeServer();
    const cache = joined(server);
    feed(cache, server.step(), 0);
    feed(cache, server.step(), 0.04);
    const revision = (now: number) => volumeOf(cache.light(now)).revision;
    expect(revision(0.05)).not.toBe(revision(0.06));
    expect(revision(0.1)).toBe(revision(0.2));
    expect(revision(0.2)).toBe(revision(5));
  });

  it('never jumps and ends at the newest update, over a link that loses, delays and reorders', () => {
    const server = new FakeServer({ brightness: (update) => 10 + 5 * Math.sin(update / 5) });
    const cache = joined(server);
    const link = new SimulatedLink<SentFrame>({ loss: 0.1, delay: [0.005, 0.15], seed: 4 });
    const refused = new Map<string, number>();
    let before: number | undefined;
    for (let now = 0; now < 20; now += 0.005) {
      if (now >= (server.tick + 1) * TICK && now < 19) {
        const { state, probes } = server.step();
        cache.addState(state, now);
        for (const frame of probes) link.send(frame, now);
      }
      for (const { what } of link.arrived(now)) {
        try {
          addLight(cache, what.track, what.bytes, now);
        } catch (error) {
          const kind = (error as WireError).kind;
          refused.set(kind, (refused.get(kind) ?? 0) + 1);
        }
      }
      if (cache.light(now).fields.length === 0) continue;
      const value = shown(cache, now);
      expect(value).toBeGreaterThan(4.9);
      expect(value).toBeLessThan(15.1);
      // The light moves by at most 1 a tick; after gaps it catches up within the blend.
      if (before !== undefined) expect(Math.abs(value - before)).toBeLessThan(1.3);
      before = value;
    }
    const newest = cache.light(20).fields[0].tick;
    // A lost frame of layer 0 costs all until the next keyframe, 40 updates later.
    expect(newest).toBeGreaterThan(server.tick - 48);
    expect(shown(cache, 20)).toBeCloseTo(server.brightness(newest ?? NaN), 2);
    // The link must have done its worst, or this has shown nothing.
    expect(link.lost).toBeGreaterThan(10);
    expect(link.reordered).toBeGreaterThan(10);
    expect([...refused.keys()]).toEqual(['missing_base']);
  });

  it('does not go back to an older or doubled update', () => {
    const server = new FakeServer();
    const cache = joined(server);
    const frames = Array.from({ length: 3 }, () => server.step());
    feed(cache, frames[0], 0);
    feed(cache, frames[2], 0.08);
    feed(cache, { probes: frames[1].probes }, 0.09);
    feed(cache, { probes: frames[2].probes }, 0.09);
    expect(shown(cache, 1)).toBeCloseTo(3, 3);
    expect(cache.light(1).fields[0].tick).toBe(2);
  });

  it('passes over a group that is sent again from its beginning', () => {
    const server = new FakeServer();
    const cache = joined(server);
    const group = Array.from({ length: 40 }, () => server.step().probes).flat();
    for (const { track, bytes } of group) addLight(cache, track, bytes, 0);
    const revision = () => volumeOf(cache.light(2)).revision;
    const before = revision();
    for (const { track, bytes } of group) addLight(cache, track, bytes, 1);
    expect(revision()).toBe(before);
    expect(shown(cache, 2)).toBeCloseTo(40, 3);
    // The next group follows, far later.
    server.tick += 400;
    feed(cache, server.step(), 20);
    expect(shown(cache, 20.1)).toBeLessThan(440);
    expect(shown(cache, 21)).toBeCloseTo(441, 1);
  });

  it('tells its age by the server’s clock', () => {
    const server = new FakeServer({ clock: 77 });
    const cache = joined(server);
    const delay = 0.02;
    for (let tick = 0; tick < 10; tick++) {
      const { state, probes } = server.step();
      const now = 5 + tick * TICK + delay;
      cache.addState(state, now);
      // Light of a tick comes another 30 ms later.
      if (tick < 8) feed(cache, { probes }, now + 0.03);
    }
    const now = 5 + 10 * TICK;
    // Tick 7 ended 3 ticks ago; the least delay of the way cannot be seen.
    expect(cache.age(now)).toBeCloseTo(3 * TICK - delay, 6);
    expect(cache.light(now).fields[0].age).toBeCloseTo(3 * TICK - delay, 6);
  });

  it('tells the age of the newest light, and of each field’s oldest region', () => {
    const server = new FakeServer({ regions: 2 });
    const cache = joined(server);
    feed(cache, server.step(), 0);
    const { state, probes } = server.step();
    feed(cache, { state, probes: probes.filter(({ track }) => track.includes('r1')) }, TICK);
    expect(cache.light(0.1).age).toBeCloseTo(0.06, 6);
    expect(cache.light(0.1).fields[0]).toMatchObject({
      age: expect.closeTo(0.1, 6),
      tick: 0,
      sceneVersion: 0,
    });
  });

  it('passes over fields and regions that it does not know', () => {
    const server = new FakeServer();
    const cache = joined(server);
    const { probes } = server.step();
    expect(cache.addLight(9, 0, 0, probes[0].bytes, 0)).toBeUndefined();
    expect(cache.addLight(0, 7, 0, probes[0].bytes, 0)).toBeUndefined();
    expect(cache.light(0).fields).toEqual([]);
  });

  it('refuses frames on the track of another layer', () => {
    const server = new FakeServer();
    const cache = joined(server);
    const [{ bytes }] = server.step().probes;
    const malformed = expect.objectContaining({ kind: 'malformed' });
    for (const layer of [1, 2, 3]) expect(() => cache.addLight(0, 0, layer, bytes, 0)).toThrow(malformed);
    expect(cache.light(0).fields).toEqual([]);
    expect(cache.addLight(0, 0, 0, bytes, 0)).toMatchObject({ head: { update: 0, tick: 0 }, news: true });
  });

  it('is told of where it is newer than what was there', () => {
    const server = new FakeServer({ regions: 2 });
    const cache = joined(server);
    const { probes } = server.step();
    feed(cache, { probes }, 0);
    feed(cache, { probes }, 1);
    expect(cache.events()).toEqual([
      { kind: 'light', light: { field: 0, region: 0, tick: 0 } },
      { kind: 'light', light: { field: 0, region: 1, tick: 0 } },
    ]);
  });

  it('goes on where the catalog changes but the field’s shape', () => {
    const server = new FakeServer();
    const cache = joined(server);
    feed(cache, server.step(), 0);
    feed(cache, server.step(), TICK);
    const changed = JSON.parse(new TextDecoder().decode(server.catalog));
    Object.assign(changed.fields[0], { use: 'static', source: 'another' });
    expect(cache.addCatalog(json(changed), 1)).toBe(true);
    expect(cache.light(1).fields).toMatchObject([{ field: { use: 'static' }, tick: 1 }]);
    // A delta that builds on what came before.
    feed(cache, { probes: server.step().probes }, 1);
    expect(shown(cache, 2)).toBeCloseTo(3, 3);
  });

  it('of a field’s former shape is shown until its own is there, or the field is gone', () => {
    const server = new FakeServer();
    const cache = joined(server);
    feed(cache, server.step(), 0);
    const changed = JSON.parse(new TextDecoder().decode(server.catalog));
    changed.fields[0].shape.layers = 1;
    cache.addCatalog(json(changed), 1);
    const before = { field: { shape: { layers: 3 } }, tick: undefined, age: undefined };
    expect(cache.light(1).fields).toMatchObject([before]);
    expect(() => feed(cache, { probes: server.step().probes }, 1)).toThrow('not at hand');
    expect(cache.light(1).fields).toMatchObject([before]);
    const key = new FakeServer({ brightness: () => 80 }).step();
    feed(cache, { probes: key.probes }, 2);
    expect(cache.light(2).fields).toMatchObject([{ field: { shape: { layers: 1 } }, tick: 0 }]);
    expect(shown(cache, 2)).toBeCloseTo(80, 2);

    cache.addCatalog(server.catalog, 3);
    expect(cache.light(3).fields).toHaveLength(1);
    cache.addCatalog(json({ ...changed, fields: [] }), 4);
    expect(cache.light(4).fields).toEqual([]);
  });

  it('is unmoved by bad frames', () => {
    const server = new FakeServer();
    const cache = joined(server);
    for (let i = 0; i < 3; i++) feed(cache, server.step(), i * TICK);
    const before = shown(cache, 1);
    const { state, probes } = server.step();
    const next = random(3);
    for (let round = 0; round < 500; round++) {
      const noise = Uint8Array.from({ length: next() * 80 }, () => next() * 256);
      expect(() => cache.addCatalog(noise, 0)).toThrow(WireError);
      expect(() => cache.addState(noise, 1)).toThrow(WireError);
      expect(() => cache.addLight(0, 0, 0, noise, 1)).toThrow(WireError);
    }
    expect(shown(cache, 1)).toBe(before);
    feed(cache, { state, probes }, 1);
    expect(shown(cache, 2)).toBeCloseTo(4, 3);
  });
});

describe('time', () => {
  it('follows the server’s clock by its fastest frames', () => {
    const server = new FakeServer({ clock: 500 });
    const cache = joined(server);
    const link = new SimulatedLink<Uint8Array>({ delay: [0.01, 0.2], seed: 9 });
    let worst = 0;
    for (let now = 0; now < 30; now += 0.01) {
      if (now >= (server.tick + 1) * TICK) link.send(server.step().state, now);
      for (const { at, what } of link.arrived(now)) cache.addState(what, at);
      if (now < 5) continue;
      const time = cache.serverTime(now) ?? NaN;
      // Late by the least delay, about 10 ms, and never early.
      expect(time).toBeLessThan(500 + now - 0.0099);
      worst = Math.max(worst, 500 + now - time);
      const scene = cache.sceneTime(now) ?? NaN;
      expect(Math.abs(scene - (time - 500))).toBeLessThan(0.01);
    }
    expect(worst).toBeLessThan(0.02);
  });

  it('stands still when the server is silent', () => {
    const server = new FakeServer();
    const cache = joined(server);
    expect(cache.sceneTime(0)).toBeUndefined();
    cache.addState(server.step().state, 0);
    expect(cache.sceneTime(0.5)).toBeCloseTo(0.5);
    expect(cache.sceneTime(60)).toBeCloseTo(1);
  });
});

describe('the scene', () => {
  /** Applies what a cache passes on, as a page would. */
  class Page {
    scene = new Map<number, Edit>();
    snapshots = 0;

    take(events: CacheEvent[]): void {
      for (const event of events) {
        if (event.kind === 'snapshot') {
          this.snapshots++;
          this.scene = new Map();
          event.edits.forEach((edit) => this.apply(edit));
        } else if (event.kind === 'edit') {
          this.apply(event.accepted.edit);
        }
      }
    }

    private apply(edit: Edit): void {
      if ('node' in edit && edit.node !== undefined) this.scene.set(edit.node, edit);
    }
  }

  it('is followed edit by edit, and taken up again only where ticks are missing', () => {
    const server = new FakeServer();
    const cache = joined(server);
    const page = new Page();
    const next = random(5);
    for (let tick = 0; tick < 400; tick++) {
      // Edits fall into ticks with snapshots too.
      server.accept(move(Math.floor(next() * 9), tick));
      const { state } = server.step();
      // Ticks 100 to 109 are lost.
      if (tick < 100 || tick > 109) cache.addState(state, tick * TICK);
      page.take(cache.events());
      // From the loss to the next snapshot (128) the page knows that it cannot know.
      if (tick < 100 || tick >= 128) expect(page.scene).toEqual(server.scene);
    }
    expect(page.snapshots).toBe(2);
  });

  it('comes out right over a link that loses, delays and reorders', () => {
    const server = new FakeServer();
    const cache = joined(server);
    const page = new Page();
    const link = new SimulatedLink<Uint8Array>({ loss: 0.02, delay: [0, 0.1], seed: 6 });
    const next = random(7);
    for (let now = 0; now < 60; now += TICK) {
      if (now < 50) server.accept(move(Math.floor(next() * 9), now));
      link.send(server.step().state, now);
      for (const { at, what } of link.arrived(now)) cache.addState(what, at);
      page.take(cache.events());
    }
    expect(page.scene).toEqual(server.scene);
    expect(page.snapshots).toBeGreaterThan(3);
    expect(link.lost).toBeGreaterThan(5);
  });

  it('skips edits that it does not know and keeps the rest', () => {
    const cache = joined(new FakeServer());
    const tick = { time: 0, clock: 0, version: 0, tick_ms: 1, samples: 1 };
    cache.addState(json({ snapshot: [{ edit: 'explode' }, move(1, 2)], ...tick, tick: 0 }), 0);
    cache.addState(
      json({ edits: [{ edit: { edit: 'explode' } }, { edit: move(1, 3) }], ...tick, tick: 1 }),
      0,
    );
    expect(cache.events()).toEqual([
      { kind: 'snapshot', edits: [move(1, 2)] },
      { kind: 'edit', accepted: { edit: move(1, 3), own: false } },
    ]);
  });
});

describe('own edits', () => {
  it('wait until they are accepted, refused, or covered by a snapshot', () => {
    const server = new FakeServer();
    const cache = joined(server);
    cache.addState(server.step().state, 0);
    cache.events();
    const [a, b, c] = [1, 2, 3].map((x) => cache.edit(move(1, x)));
    expect([a.seq, b.seq, c.seq]).toEqual([1, 2, 3]);
    expect(JSON.parse(new TextDecoder().decode(b.bytes))).toEqual({ seq: 2, edit: move(1, 2) });

    server.accept(move(1, 1), ME, 1);
    server.accept(move(8, 8), 'another', 1);
    server.refuse(ME, 2, 'node 1 does not exist');
    cache.addState(server.step().state, 0.04);
    expect(cache.events()).toEqual([
      { kind: 'edit', accepted: { edit: move(1, 1), client: ME, seq: 1, own: true } },
      { kind: 'edit', accepted: { edit: move(8, 8), client: 'another', seq: 1, own: false } },
      { kind: 'acknowledged', seq: 1 },
      { kind: 'refused', refused: { seq: 2, edit: move(1, 2), reason: 'node 1 does not exist' } },
    ]);
    expect(cache.pending.map(({ seq }) => seq)).toEqual([3]);

    // The answer to the third is lost with its tick; the next snapshot has it.
    server.accept(move(1, 3), ME, 3);
    server.step();
    while (server.tick < 63) server.step();
    cache.addState(server.step().state, 3);
    expect(cache.events().map(({ kind }) => kind)).toEqual(['snapshot', 'acknowledged']);
    expect(cache.pending).toEqual([]);
  });

  it('are at most so many at once', () => {
    const cache = new Cache(ME);
    for (let i = 0; i < 4096; i++) cache.edit(move(1, i));
    expect(() => cache.edit(move(1, 0))).toThrow('4096');
  });
});

describe('a restarted server', () => {
  it('is known by its epoch: the light stays, the rest begins anew', () => {
    const old = new FakeServer({ clock: 5000 });
    const cache = joined(old);
    for (let i = 0; i < 50; i++) feed(cache, old.step(), i * TICK);
    cache.edit(move(1, 1));
    cache.events();

    const fresh = new FakeServer({ epoch: '00000000000000bb', clock: 3, brightness: () => 80 });
    cache.addCatalog(fresh.catalog, 0);
    expect(cache.events().map(({ kind }) => kind)).toEqual(['lost', 'catalog']);
    expect(shown(cache, 3)).toBeCloseTo(50, 2);
    expect(cache.age(3)).toBeUndefined();
    // Update 0 is news again, and fades in.
    feed(cache, fresh.step(), 3);
    expect(cache.events().map(({ kind }) => kind)).toEqual(['snapshot', 'light']);
    expect(shown(cache, 3)).toBeCloseTo(50, 2);
    expect(shown(cache, 4)).toBeCloseTo(80, 2);
    expect(cache.serverTime(4)).toBeCloseTo(4, 6);
    expect(cache.edit(move(1, 2)).seq).toBe(1);
  });

  it('with other fields shows the old light until there is new light', () => {
    const old = new FakeServer();
    const cache = joined(old);
    feed(cache, old.step(), 0);
    const fresh = new FakeServer({ epoch: '00000000000000bb', regions: 2, brightness: () => 80 });
    cache.addCatalog(fresh.catalog, 0);
    expect(regionCounts(cache, 1)).toEqual([1]);
    expect(cache.light(1).fields[0].tick).toBeUndefined();
    feed(cache, fresh.step(), 1);
    expect(regionCounts(cache, 1)).toEqual([2]);
  });

  it('without a field that it had shows that one too until there is new light', () => {
    const old = new FakeServer();
    const cache = joined(old);
    feed(cache, old.step(), 0);
    const fresh = new FakeServer({ epoch: '00000000000000bb' });
    const renumbered = JSON.parse(new TextDecoder().decode(fresh.catalog));
    renumbered.fields[0].id = 4;
    cache.addCatalog(json(renumbered), 0);
    expect(cache.light(1).fields).toMatchObject([{ field: { id: 0 }, tick: undefined, age: undefined }]);
    for (const { bytes } of fresh.step().probes) cache.addLight(4, 0, 0, bytes, 1);
    expect(cache.light(1).fields).toMatchObject([{ field: { id: 4 }, tick: 0 }]);
  });

  it('that changes its fields without restarting has those forgotten that are gone', () => {
    const server = new FakeServer({ regions: 2 });
    const cache = joined(server);
    feed(cache, server.step(), 0);
    const catalog = JSON.parse(new TextDecoder().decode(server.catalog));
    catalog.fields = [];
    cache.addCatalog(json(catalog), 0);
    expect(cache.light(1).fields).toEqual([]);
  });
});

describe('a field with an epoch of its own', () => {
  const own = { epoch: '00000000000000aa', fieldEpoch: '00000000000000f1' };

  it('goes on when the server of the catalog restarts', () => {
    const server = new FakeServer(own);
    const cache = joined(server);
    for (let i = 0; i < 50; i++) feed(cache, server.step(), i * TICK);
    // Its ticks are not those of the state track: age counts from arrival.
    expect(cache.age(3)).toBeCloseTo(3 - 49 * TICK, 9);
    expect(cache.delayOf(0, 49, 3)).toBeUndefined();
    const catalog = new FakeServer({ ...own, epoch: '00000000000000bb' }).catalog;
    cache.addCatalog(catalog, 0);
    expect(cache.events().at(-1)).toMatchObject({ kind: 'catalog', restarted: true });
    expect(cache.serverTime(3)).toBeUndefined();
    expect(cache.age(3)).toBeCloseTo(3 - 49 * TICK, 9);
    // A delta that builds on what came before.
    feed(cache, { probes: server.step().probes }, 3);
    expect(shown(cache, 4)).toBeCloseTo(51, 2);
  });

  it('begins anew when its own server restarts', () => {
    const server = new FakeServer(own);
    const cache = joined(server);
    for (let i = 0; i < 50; i++) feed(cache, server.step(), i * TICK);
    cache.events();
    const fresh = new FakeServer({ ...own, fieldEpoch: '00000000000000f2', brightness: () => 80 });
    cache.addCatalog(fresh.catalog, 0);
    expect(cache.events()).toMatchObject([{ kind: 'catalog', restarted: false }]);
    expect(cache.serverTime(3)).toBeDefined();
    expect(cache.age(3)).toBeUndefined();
    expect(shown(cache, 3)).toBeCloseTo(50, 2);
    feed(cache, { probes: fresh.step().probes }, 3);
    expect(shown(cache, 4)).toBeCloseTo(80, 2);
  });

  it('in another shape shows the old light until its own new light is there', () => {
    const server = new FakeServer(own);
    const cache = joined(server);
    feed(cache, server.step(), 0);
    const fresh = new FakeServer({ ...own, fieldEpoch: '00000000000000f2', regions: 2 });
    cache.addCatalog(fresh.catalog, 0);
    expect(regionCounts(cache, 1)).toEqual([1]);
    expect(cache.light(1).fields[0].tick).toBeUndefined();
    feed(cache, { probes: fresh.step().probes }, 1);
    expect(regionCounts(cache, 1)).toEqual([2]);
  });

  it('keeps one old light, however often its shape changes', () => {
    const shaped = (i: number) =>
      new FakeServer({
        epoch: `00000000000000${10 + i}`,
        fieldEpoch: `00000000000001${10 + i}`,
        regions: 1 + (i % 3),
      });
    const cache = joined(shaped(0));
    feed(cache, shaped(0).step(), 0);
    for (let i = 1; i < 50; i++) cache.addCatalog(shaped(i).catalog, 0);
    expect(regionCounts(cache, 1)).toEqual([1]);
    // Shapes that never had light are not kept.
    expect(cache['leftover'].length).toBe(1);
    // Where each shape had light, the last is shown.
    for (let i = 50; i < 80; i++) {
      cache.addCatalog(shaped(i).catalog, 0);
      feed(cache, { probes: shaped(i).step().probes }, i);
    }
    cache.addCatalog(shaped(80).catalog, 0);
    expect(regionCounts(cache, 81)).toEqual([1 + (79 % 3)]);
  });
});

describe('saved light', () => {
  it('is shown until the server’s light comes', () => {
    const cache = new Cache(ME);
    cache.load(lightFile(new FakeServer({ brightness: () => 7 })), 0);
    expect(shown(cache, 0)).toBeCloseTo(7, 2);
    expect(cache.age(100)).toBeUndefined();
    const { seq } = cache.edit(move(1, 1));
    const server = new FakeServer({ brightness: () => 9 });
    cache.addCatalog(server.catalog, 0);
    expect(shown(cache, 1)).toBeCloseTo(7, 2);
    // Made before there was a server, the edit is still to be sent.
    expect(cache.pending.map((edit) => edit.seq)).toEqual([seq]);
    feed(cache, server.step(), 1);
    expect(shown(cache, 2)).toBeCloseTo(9, 2);
  });

  it('that is damaged is refused', () => {
    const good = lightFile(new FakeServer({ regions: 2 }));
    for (let length = 0; length < good.length; length++) {
      // Cut between two records it is a whole file with less in it.
      try {
        new Cache(ME).load(good.subarray(0, length), 0);
      } catch (error) {
        expect(error).toBeInstanceOf(WireError);
      }
    }
    const wrong = good.slice();
    wrong[0]++;
    expect(() => new Cache(ME).load(wrong, 0)).toThrow('not a light file');
  });

  it('changes nothing where it is damaged late, or comes late', () => {
    const good = lightFile(new FakeServer({ brightness: () => 7, regions: 2 }));
    const broken = good.slice();
    broken.fill(0xff, broken.length - 8);
    const cache = new Cache(ME);
    expect(() => cache.load(broken, 0)).toThrow(WireError);
    expect([cache.catalog, cache.light(0).fields, cache.events()]).toEqual([undefined, [], []]);
    const server = new FakeServer({ brightness: () => 9 });
    cache.addCatalog(server.catalog, 0);
    expect(() => cache.load(good, 0)).toThrow('light of a server');
    feed(cache, server.step(), 0);
    expect(shown(cache, 0)).toBeCloseTo(9, 2);
  });

  it('gives back what it keeps of its scene', () => {
    const edit = { edit: 'set_environment', environment: { type: 'image', uri: 'sky/a%20b.hdr' } };
    const edits = [{ edit: 'turn_to_gold' }, edit];
    const file = lightFile(new FakeServer(), { edits, files: { 'sky/a b.hdr': new Uint8Array([1, 2]) } });
    const later = join(file, record(99, [1, 2, 3]));
    const kept = new Cache(ME).load(later, 0);
    expect(kept.edits).toMatchObject([edit]);
    expect([...kept.files]).toEqual([['sky/a b.hdr', new Uint8Array([1, 2])]]);
    const nameless = join(file, record(3, [2, 0xff, 0xff]));
    expect(() => new Cache(ME).load(nameless, 0)).toThrow('name of a file');
    const headless = join(file.subarray(0, 9), record(3, [1, 97]));
    expect(() => new Cache(ME).load(headless, 0)).toThrow('without a catalog');
  });
});
