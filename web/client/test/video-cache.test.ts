/** Lightmaps that travel as video, in a cache: pictures come some time after their frames. */
import { beforeEach, describe, expect, it, vi } from 'vitest';

import type { LightmapLight, PlanesPicture } from '../src/api.js';
import { Cache } from '../src/cache.js';
import { isLightmap } from '../src/codec/catalog.js';
import { splitVideoFrame } from '../src/codec/video-frame.js';
import { FakeDecoders } from './support/fake-decoder.js';
import { type SentFrame, TICK } from './support/fake-server.js';
import { FIELD, LightmapServer } from './support/lightmap-server.js';
import { frameHead, join } from './support/probe-encoder.js';

let decoders: FakeDecoders;
let onLate: () => void;

beforeEach(() => {
  decoders = new FakeDecoders();
  onLate = vi.fn<() => void>();
});

function joined(server: LightmapServer): Cache {
  const cache = new Cache('me', { openDecoder: decoders.open, onLate });
  cache.addCatalog(server.catalog, 0);
  cache.events();
  return cache;
}

function video(options = {}): LightmapServer {
  return new LightmapServer({ coding: 'h264', pages: 1, ...options });
}

function add(cache: Cache, { track, bytes }: SentFrame, now: number): boolean | undefined {
  const [field, region, layer] = track.match(/\d+/g)!.map(Number);
  return cache.addLight(field, region, layer, bytes, now)?.news;
}

function lightOf(cache: Cache, now: number): LightmapLight | undefined {
  return cache.light(now).fields.filter(isLightmap)[0];
}

/** The code of the first region's picture, and how far along it is. */
function shown(cache: Cache, now: number): [code: number, share: number] | undefined {
  const region = lightOf(cache, now)?.regions[0];
  return region && [(region.picture as PlanesPicture).y[0], +region.shown.toFixed(6)];
}

const missing = expect.objectContaining({ kind: 'missing_base' });

describe('a video frame', () => {
  const head = frameHead({ update: 4, base: 3, tick: 9, scaleLog2: -2 });

  it('tells what its codes mean, and holds an access unit', () => {
    const { header, unit } = splitVideoFrame(join(head, [7, 98, 1, 2, 3]));
    expect(header).toMatchObject({ update: 4, base: 3, tick: 9, scale: 0.25, toe: 7, octaves: 12.25 });
    expect([...unit]).toEqual([1, 2, 3]);
  });

  it.each([
    ['a toe of 33', [33, 96, 1], 'malformed'],
    ['a range of nothing', [7, 0, 1], 'malformed'],
    ['no range', [7], 'truncated'],
  ])('with %s is refused', (_, bytes, kind) => {
    expect(() => splitVideoFrame(join(head, bytes))).toThrow(expect.objectContaining({ kind }));
  });
});

describe('a frame without a picture', () => {
  it('is none as a keyframe', () => {
    const keyframe = frameHead({ update: 4, tick: 9, scaleLog2: -2 });
    const malformed = expect.objectContaining({ kind: 'malformed' });
    expect(() => splitVideoFrame(join(keyframe, [7, 96]))).toThrow(malformed);
  });

  it('says that the page is still that of its base, also of a picture on its way', async () => {
    const server = video();
    const cache = joined(server);
    const newest = () => lightOf(cache, 9)?.age;
    add(cache, server.step(1)[0], 0);
    await decoders.answer();
    expect(add(cache, server.idle()[0], 5)).toBe(true);
    expect([shown(cache, 9), newest(), decoders.given.length]).toEqual([[1, 1], 4, 0]);
    add(cache, server.step(2)[0], 6);
    for (const now of [7, 8]) expect(add(cache, server.idle()[0], now)).toBe(true);
    expect(newest()).toBe(4);
    await decoders.answer();
    expect([shown(cache, 9 + TICK)?.[0], newest()]).toEqual([2, 1]);
    expect(add(cache, server.step(3)[0], 9)).toBe(true);
    expect(decoders.given.length).toBe(1);
  });
});

describe('pictures', () => {
  it('are shown when they come, and said so then', async () => {
    const server = video();
    const cache = joined(server);
    expect(add(cache, server.step(40)[0], 0)).toBe(true);
    expect([cache.light(0).fields, cache.events(), cache.age(0)]).toEqual([[], [], undefined]);
    expect(decoders.formats).toEqual([{ coding: 'h264', pageSize: 16 }]);
    expect(decoders.given[0]).toMatchObject({ keyframe: true, unit: Uint8Array.of(1, 40) });
    await decoders.answer();
    expect(cache.events()).toEqual([{ kind: 'light', light: { field: FIELD, region: 0, tick: 0 } }]);
    expect(onLate).toHaveBeenCalledOnce();
    const [region] = lightOf(cache, 0)!.regions;
    expect(region).toMatchObject({ region: 0, page: 0, min: [0, 0], size: [16, 16], shown: 1 });
    expect(region.picture).toMatchObject({ kind: 'planes', scale: 16, toe: 7, octaves: 12, width: 16 });
    expect(lightOf(cache, 0)).toMatchObject({ scale: 16, tick: 0, sceneVersion: 5 });
  });

  it('begin their passage at the look before they came', async () => {
    const server = video();
    const cache = joined(server);
    add(cache, server.step(40)[0], 0);
    await decoders.answer();
    expect(shown(cache, 0.1)).toEqual([40, 1]);
    add(cache, server.step(50)[0], 0.2);
    expect(shown(cache, 0.25)).toEqual([40, 1]);
    await decoders.answer();
    // 0.15 seconds after the last began.
    expect([0.25, 0.325, 0.4].map((now) => shown(cache, now))).toEqual([
      [50, 0],
      [50, 0.5],
      [50, 1],
    ]);
  });

  it('are reached also where each look finds another one', async () => {
    const server = video();
    const cache = joined(server);
    for (let frame = 0; frame < 20; frame++) {
      add(cache, server.step(frame)[0], 0.25 * frame - TICK);
      await decoders.answer();
      expect(shown(cache, 0.25 * frame)).toEqual([frame, 1]);
    }
  });

  it('that came unseen pass as long as they were made', async () => {
    const server = video();
    const cache = joined(server);
    for (let value = 1; value <= 6; value++) add(cache, server.step(value)[0], 0);
    await decoders.answer();
    expect(shown(cache, 0)).toEqual([1, 1]);
    for (let left = 5; left > 0; left--) await decoders.answer();
    expect(shown(cache, 0)).toEqual([6, 0]);
    expect(shown(cache, 2.5 * TICK)).toEqual([6, 0.5]);
  });

  it('are decoded in order, by a decoder for each region', () => {
    const server = video({ pages: 2 });
    const cache = joined(server);
    for (const value of [1, 2]) for (const frame of server.step(value)) add(cache, frame, 0);
    expect(decoders.given.map(({ region, unit, keyframe }) => [region, unit[1], keyframe])).toEqual([
      [0, 1, true],
      [1, 1, true],
      [0, 2, false],
      [1, 2, false],
    ]);
  });

  it('of deltas whose base the decoder has not, wait for a keyframe', async () => {
    const server = video({ keyframeEvery: 4 });
    const cache = joined(server);
    const frames = Array.from({ length: 6 }, (_, value) => server.step(value)[0]);
    expect(() => add(cache, frames[1], 0)).toThrow(missing);
    add(cache, frames[0], 0);
    expect(() => add(cache, frames[2], 0)).toThrow(missing);
    expect(add(cache, frames[4], 0)).toBe(true);
    expect(add(cache, frames[5], 0)).toBe(true);
    // A group that is sent again from its beginning is known.
    expect([add(cache, frames[4], 0), add(cache, frames[5], 0)]).toEqual([false, false]);
    expect(decoders.given.map(({ unit }) => unit[1])).toEqual([0, 4, 5]);
  });

  it('stay where decoding fails, until the next keyframe', async () => {
    const server = video({ keyframeEvery: 4 });
    const cache = joined(server);
    const frames = Array.from({ length: 10 }, (_, value) => server.step(10 + value)[0]);
    for (const frame of frames.slice(0, 2)) add(cache, frame, 0);
    await decoders.answer();
    await decoders.answer(false);
    expect(shown(cache, 1)).toEqual([10, 1]);
    expect(() => add(cache, frames[2], 0)).toThrow(missing);
    for (const frame of frames.slice(4, 6)) add(cache, frame, 1);
    await decoders.answer();
    await decoders.answer();
    expect(shown(cache, 9)?.[0]).toBe(15);
    // What fails before a keyframe that is on its way takes nothing from what follows that.
    for (const frame of frames.slice(6, 9)) add(cache, frame, 2);
    await decoders.answer(false);
    expect(add(cache, frames[9], 2)).toBe(true);
  });

  it('that are late do not replace newer ones', async () => {
    const server = video();
    const cache = joined(server);
    add(cache, server.step(1)[0], 0);
    add(cache, server.step(2)[0], 0);
    const [first] = decoders.given.splice(0, 1);
    await decoders.answer();
    const { revision } = lightOf(cache, 0)!.regions[0];
    await first.answer(undefined);
    expect(shown(cache, 9)).toEqual([2, 1]);
    expect(lightOf(cache, 9)!.regions[0].revision).toBe(revision);
  });
});

describe('another run of the server', () => {
  it('begins with a keyframe, and pictures of the old one do not come', async () => {
    const first = video();
    const cache = joined(first);
    add(cache, first.step(1)[0], 0);
    await decoders.answer();
    add(cache, first.step(2)[0], 0);
    const second = video({ epoch: '00000000000000bb', keyframeEvery: 2 });
    cache.addCatalog(second.catalog, 1);
    await decoders.answer();
    expect(shown(cache, 1)).toEqual([1, 1]);
    expect(lightOf(cache, 1)!.tick).toBeUndefined();
    expect(add(cache, second.step(7)[0], 1)).toBe(true);
    await decoders.answer();
    expect(shown(cache, 9)?.[0]).toBe(7);
    expect(decoders.formats.length).toBe(1);
  });

  it('closes decoders of fields that go, and all with the cache', () => {
    const server = video({ pages: 2 });
    const cache = joined(server);
    for (const frame of server.step(1)) add(cache, frame, 0);
    const wider = video({ pageSize: 32 });
    cache.addCatalog(wider.catalog, 1);
    expect(decoders.closed).toEqual([0, 1]);
    add(cache, wider.step(1)[0], 1);
    cache.close();
    expect(decoders.closed).toEqual([0, 1, 2]);
  });
});

it('without a decoder lightmaps that travel as video are told as not shown', () => {
  for (const [coding, count] of [
    ['h264', 1],
    ['h264_stacked', 1],
    ['halves', 0],
  ] as const) {
    const server = new LightmapServer({ coding });
    const cache = new Cache('me');
    expect(cache.unshown).toEqual([]);
    cache.addCatalog(server.catalog, 0);
    expect(cache.unshown.map(({ id }) => id)).toEqual(Array(count).fill(FIELD));
    expect(add(cache, server.step(1)[0], 0)).toBe(count === 0 ? true : undefined);
    expect(joined(server).unshown).toEqual([]);
  }
});
