/** Lightmaps in a cache: regions on their way, lost updates, other runs, layouts that come late. */
import { describe, expect, it } from 'vitest';

import type { HalvesPicture, LightmapLight } from '../src/api.js';
import { Cache } from '../src/cache.js';
import { isLightmap } from '../src/codec/catalog.js';
import { halfValue } from '../src/codec/half.js';
import { type SentFrame, TICK } from './support/fake-server.js';
import { lightmapFile, record } from './support/light-file.js';
import { FIELD, LightmapServer } from './support/lightmap-server.js';
import { join } from './support/probe-encoder.js';
import { resource, triangle } from './support/resource-writer.js';

function joined(server: LightmapServer): Cache {
  const cache = new Cache('me');
  cache.addCatalog(server.catalog, 0);
  cache.events();
  return cache;
}

function add(cache: Cache, { track, bytes }: SentFrame, now: number): boolean | undefined {
  const [field, region, layer] = track.match(/\d+/g)!.map(Number);
  return cache.addLight(field, region, layer, bytes, now)?.news;
}

function addAll(cache: Cache, frames: readonly SentFrame[], now: number): void {
  for (const frame of frames) expect(add(cache, frame, now)).toBe(true);
}

function lightOf(cache: Cache, now: number): LightmapLight {
  return cache.light(now).fields.filter(isLightmap)[0];
}

/** Red of each region's picture, and how far along it is. */
function shown(cache: Cache, now: number): [red: number, share: number][] {
  return lightOf(cache, now).regions.map(({ picture, shown }) => {
    const { texels, scale } = picture as HalvesPicture;
    return [halfValue(texels[0]) * scale, shown];
  });
}

/** Nodes of the surfaces that the layout has. */
function nodes(cache: Cache, now = 1e3): number[] | undefined {
  return lightOf(cache, now).layout?.surfaces.map(({ node }) => node);
}

describe('pictures', () => {
  it('pass from update to update, each region by itself', () => {
    const server = new LightmapServer();
    const cache = joined(server);
    expect(cache.light(0).fields).toEqual([]);
    addAll(cache, server.step(1), 0);
    expect(shown(cache, 0)).toEqual([
      [1, 1],
      [1, 1],
    ]);
    const [first, second] = server.step(3);
    add(cache, first, 0.4);
    add(cache, second, 0.2);
    const at = (now: number) => shown(cache, now).map(([red, share]) => [red, +share.toFixed(6)]);
    expect(at(0.4)).toEqual([
      [3, 0],
      [3, 1],
    ]);
    expect(at(0.6)[0]).toEqual([3, 0.5]);
    expect(at(0.9)[0]).toEqual([3, 1]);
  });

  it('take half a second at most, and as long as bursts were made', () => {
    const server = new LightmapServer({ pages: 1 });
    const cache = joined(server);
    for (const [value, now] of [
      [1, 0],
      [2, 5],
    ]) {
      addAll(cache, server.step(value), now);
    }
    expect(shown(cache, 5.25)[0][1]).toBeCloseTo(0.5, 6);
    server.step(3);
    server.update = 6;
    // Five ticks after the last, and it comes at once.
    const burst = new LightmapServer({ pages: 1, keyframeEvery: 1 });
    burst.update = 5;
    addAll(cache, burst.step(4), 5.25);
    expect(shown(cache, 5.25 + 2.5 * TICK)[0][1]).toBeCloseTo((2.5 * TICK) / 0.25, 6);
  });

  it('have revisions that tell whether an upload is needed', () => {
    const server = new LightmapServer();
    const cache = joined(server);
    const revisions = () => lightOf(cache, 9).regions.map(({ revision }) => revision);
    addAll(cache, server.step(1), 0);
    const first = revisions();
    expect(new Set(first).size).toBe(2);
    expect(revisions()).toEqual(first);
    // An update in which nothing has changed needs none, and is news all the same.
    addAll(cache, server.step(1), 1);
    expect(revisions()).toEqual(first);
    expect(lightOf(cache, 9).tick).toBe(1);
    addAll(cache, server.step(2), 2);
    const second = revisions();
    second.forEach((revision, i) => expect(revision).toBeGreaterThan(first[i]));
    // Those of a field that comes anew are others.
    const again = joined(server);
    addAll(again, new LightmapServer().step(1), 0);
    for (const { revision } of lightOf(again, 0).regions)
      expect([...first, ...second]).not.toContain(revision);
  });

  it('stay while pages are added, and light comes to these', () => {
    const server = new LightmapServer({ pages: 1 });
    const cache = joined(server);
    for (const { bytes } of server.resources) cache.addResource(bytes);
    addAll(cache, server.step(2), 0);
    const revision = lightOf(cache, 1).regions[0].revision;
    const longer = new LightmapServer({ pages: 2 });
    cache.addCatalog(longer.catalog, 1);
    // The former layout stands until the new one is here.
    expect([shown(cache, 1), nodes(cache, 1)]).toEqual([[[2, 1]], [1, 2]]);
    expect(lightOf(cache, 1).field.shape.pages).toBe(2);
    expect(lightOf(cache, 1).regions[0].revision).toBe(revision);
    const [, added] = new LightmapServer({ pages: 2, keyframeEvery: 1 }).step(3);
    addAll(cache, [added], 1);
    expect(shown(cache, 2)).toEqual([
      [2, 1],
      [3, 1],
    ]);
  });

  it('stay on their way when an update brings nothing new', () => {
    const server = new LightmapServer({ pages: 1 });
    const cache = joined(server);
    addAll(cache, server.step(1), 0);
    addAll(cache, server.step(2), 0.4);
    addAll(cache, server.step(2), 0.5);
    expect(shown(cache, 0.6)[0][1]).toBeCloseTo(0.5, 6);
  });

  it('tell the largest scale, their age and their place', () => {
    const server = new LightmapServer({ pageSize: 16, pages: 2 });
    const cache = joined(server);
    const [first] = server.step(1);
    cache.addState(server.state(), 0);
    server.scaleLog2 = 6;
    const louder = new LightmapServer({ keyframeEvery: 1 });
    louder.scaleLog2 = 6;
    louder.update = 3;
    add(cache, first, 0);
    add(cache, louder.step(1)[1], 0);
    const light = lightOf(cache, 0.5);
    expect([light.scale, light.tick, light.sceneVersion]).toEqual([64, 0, 5]);
    expect(light.age).toBeCloseTo(0.5, 6);
    expect(light.regions.map(({ region, page, min, size }) => [region, page, min, size])).toEqual([
      [0, 0, [0, 0], [16, 16]],
      [1, 1, [0, 0], [16, 16]],
    ]);
  });

  it('wait for a keyframe where a base was lost', () => {
    const server = new LightmapServer({ keyframeEvery: 4 });
    const cache = joined(server);
    addAll(cache, server.step(1), 0);
    server.step(1.25);
    const late = server.step(1.5);
    expect(() => add(cache, late[0], 1)).toThrow(expect.objectContaining({ kind: 'missing_base' }));
    expect(shown(cache, 2)[0]).toEqual([1, 1]);
    server.step(1.75);
    const keyframes = server.step(2);
    expect(add(cache, keyframes[0], 3)).toBe(true);
    expect(shown(cache, 9).map(([red]) => red)).toEqual([2, 1]);
    // What came late is no news, and changes nothing.
    const before = lightOf(cache, 9).regions[0].revision;
    expect([add(cache, keyframes[0], 4), add(cache, late[0], 4)]).toEqual([false, false]);
    expect(lightOf(cache, 9).regions[0].revision).toBe(before);
  });

  it('are of regions and of the layer that there are', () => {
    const server = new LightmapServer();
    const cache = joined(server);
    const [{ bytes }] = server.step(1);
    expect(cache.addLight(FIELD, 2, 0, bytes, 0)).toBeUndefined();
    expect(() => cache.addLight(FIELD, 0, 1, bytes, 0)).toThrow(
      expect.objectContaining({ kind: 'malformed' }),
    );
    expect(cache.light(0).fields).toEqual([]);
  });
});

describe('another run of the server', () => {
  it('begins anew, and what is shown stays until it passes into what comes', () => {
    const first = new LightmapServer();
    const cache = joined(first);
    for (const value of [1, 2, 3]) addAll(cache, first.step(value), 0);
    const second = new LightmapServer({ epoch: '00000000000000bb' });
    cache.addCatalog(second.catalog, 5);
    expect(shown(cache, 5)).toEqual([
      [3, 1],
      [3, 1],
    ]);
    expect([lightOf(cache, 5).age, lightOf(cache, 5).tick]).toEqual([undefined, undefined]);
    addAll(cache, second.step(0.5), 5);
    expect(shown(cache, 5.25)[0]).toEqual([0.5, 0.5]);
    expect(lightOf(cache, 9).tick).toBe(0);
  });

  it('with other pages shows the old ones until there is new light', () => {
    const first = new LightmapServer();
    const cache = joined(first);
    addAll(cache, first.step(1), 0);
    for (const { bytes } of first.resources) cache.addResource(bytes);
    expect(nodes(cache)).toEqual([1, 2]);
    const second = new LightmapServer({ pageSize: 32, pages: 1 });
    cache.addCatalog(second.catalog, 1);
    expect([lightOf(cache, 1).field.shape.pageSize, nodes(cache)]).toEqual([16, [1, 2]]);
    addAll(cache, second.step(2), 1);
    expect([lightOf(cache, 1).field.shape.pageSize, nodes(cache)]).toEqual([32, undefined]);
  });
});

describe('surfaces', () => {
  it('are there as their resources come', () => {
    const server = new LightmapServer();
    const cache = joined(server);
    addAll(cache, server.step(2), 0);
    const names = server.resources.map(({ hash }) => hash);
    const [layout, ...charts] = server.resources.map(({ bytes }) => bytes);
    expect(cache.wantedResources).toEqual(names.slice(0, 1));
    expect(nodes(cache)).toBeUndefined();

    // Charts that nobody names yet, bytes that are cut short, and nothing at all.
    for (const bytes of [charts[0], layout.subarray(1), new Uint8Array()]) {
      expect(cache.addResource(bytes)).toBe(false);
    }
    expect(cache.addResource(layout)).toBe(true);
    expect(cache.wantedResources).toEqual(names.slice(1));
    expect(nodes(cache)).toEqual([]);
    const before = lightOf(cache, 1).layout;
    expect(lightOf(cache, 2).layout).toBe(before);
    expect(cache.addResource(charts[1])).toBe(true);
    expect(nodes(cache)).toEqual([2]);
    expect(lightOf(cache, 2).layout).not.toBe(before);
    cache.addResource(charts[0]);
    expect([nodes(cache), cache.wantedResources]).toEqual([[1, 2], []]);
    expect(cache.addResource(layout)).toBe(false);

    // At another scale the layout is the same: nothing is asked for, and nothing is laid out again.
    const laid = lightOf(cache, 2).layout;
    server.scaleLog2 = 5;
    expect(cache.addCatalog(server.catalog, 3)).toBe(false);
    expect(lightOf(cache, 3).layout).toBe(laid);
    expect(lightOf(cache, 3).field.scale).toBe(32);
  });

  it('change with the layout, while updates go on', () => {
    const first = new LightmapServer();
    const cache = joined(first);
    addAll(cache, first.step(2), 0);
    for (const { bytes } of first.resources) cache.addResource(bytes);
    cache.events();

    // Surface 3 has the charts of surface 1, which are there already; those of surface 2 go.
    const second = new LightmapServer({ surfaces: [{ node: 3, charts: triangle(4), x: 8 }] });
    expect(cache.addCatalog(second.catalog, 1)).toBe(false);
    expect([nodes(cache), cache.wantedResources]).toEqual([[1, 2], [second.layout.hash]]);
    expect(lightOf(cache, 1).field.shape.layout).toBe(second.layout.hash);
    cache.addResource(second.layout.bytes);
    expect([nodes(cache), cache.wantedResources]).toEqual([[3], []]);
    expect(cache.addResource(first.layout.bytes)).toBe(false);
    // The server codes pages anew; frames that were on their way still count.
    addAll(cache, first.step(3), 1.5);
    expect(shown(cache, 9)[0][0]).toBe(3);
    expect(cache.events().map(({ kind }) => kind)).toEqual(['light', 'light']);
  });

  it('are not asked for again where they cannot be read', () => {
    const server = new LightmapServer();
    const rubbish = resource(new Uint8Array([9, 9, 9]));
    server.shape.layout = rubbish.hash;
    const cache = joined(server);
    addAll(cache, server.step(1), 0);
    expect(cache.wantedResources).toEqual([rubbish.hash]);
    expect(() => cache.addResource(rubbish.bytes)).toThrow(expect.objectContaining({ kind: 'version' }));
    expect([cache.wantedResources, nodes(cache)]).toEqual([[], undefined]);
  });

  it('are none of a layout of other pages', () => {
    const server = new LightmapServer();
    const other = new LightmapServer({ pages: 3 });
    server.shape.layout = other.layout.hash;
    const cache = joined(server);
    addAll(cache, server.step(1), 0);
    expect(cache.addResource(other.layout.bytes)).toBe(true);
    expect(nodes(cache)).toBeUndefined();
  });
});

describe('a file', () => {
  it('brings its layout and charts, in any order', () => {
    const server = new LightmapServer();
    for (const resources of [server.resources, server.resources.toReversed()]) {
      const cache = new Cache('me');
      cache.load(lightmapFile(new LightmapServer(), 4, resources), 0);
      expect([nodes(cache), cache.wantedResources]).toEqual([[1, 2], []]);
      expect(shown(cache, 0)).toEqual([
        [4, 1],
        [4, 1],
      ]);
      // A server with the same layout need not send it again, and its light takes the place of the file's.
      cache.addCatalog(server.catalog, 1);
      expect([nodes(cache), cache.wantedResources]).toEqual([[1, 2], []]);
      addAll(cache, new LightmapServer().step(6), 1);
      expect(shown(cache, 1.25)[0]).toEqual([6, 0.5]);
    }
  });

  it.each([0, 1, 2])('that lacks resource %i is refused', (missing) => {
    const server = new LightmapServer();
    const file = lightmapFile(server, 4, server.resources.toSpliced(missing, 1));
    const cache = new Cache('me');
    expect(() => cache.load(file, 0)).toThrow(expect.objectContaining({ kind: 'malformed' }));
    expect(cache.catalog).toBeUndefined();
  });

  it('with a delta, or a resource that cannot be read, is refused', () => {
    const server = new LightmapServer();
    server.step(1);
    const refused = (file: Uint8Array, kind: string) =>
      expect(() => new Cache('me').load(file, 0)).toThrow(expect.objectContaining({ kind }));
    refused(lightmapFile(server, 2), 'malformed');
    const rubbish = resource(new Uint8Array([1]));
    const bad = new LightmapServer({ surfaces: [{ node: 1, charts: rubbish }] });
    refused(lightmapFile(bad, 2), 'truncated');
  });

  it('need not hold the resources of a lightmap without light', () => {
    const { catalog } = new LightmapServer();
    const cache = new Cache('me');
    cache.load(join(new TextEncoder().encode('LUMENCST'), [2], record(0, catalog)), 0);
    expect([cache.catalog?.fields.length, cache.light(0).fields]).toEqual([1, []]);
  });
});
