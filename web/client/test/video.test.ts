/** Decoding of video by WebCodecs, of which Node has none: a fake one stands in. */
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';

import type { Planes } from '../src/api.js';
import type { VideoFormat } from '../src/cache/picture-decoder.js';
import { codecOf } from '../src/video/access-unit.js';
import { DecoderPool, type DecoderWorker, videoDecoders } from '../src/video/decoders.js';
import { MOST_BYTES, MOST_KEPT } from '../src/video/group.js';
import { planesOf, type RawPicture } from '../src/video/planes.js';
import { RegionDecoder } from '../src/video/region-decoder.js';
import { type Answer, DecoderService, type Question } from '../src/video/service.js';
import { FakeDecoders, grey } from './support/fake-decoder.js';
import { accessUnit, FakeChunk, FakeVideoDecoder, rawPage, sampleOf } from './support/fake-video.js';

const FORMAT: VideoFormat = { coding: 'h264', pageSize: 20 };

beforeEach(() => {
  FakeVideoDecoder.made = [];
  FakeVideoDecoder.fails = () => false;
  FakeVideoDecoder.open = 0;
  vi.stubGlobal('VideoDecoder', FakeVideoDecoder);
  vi.stubGlobal('EncodedVideoChunk', FakeChunk);
});

afterEach(() => {
  expect(FakeVideoDecoder.open, 'frames that nobody has closed').toBe(0);
  vi.unstubAllGlobals();
});

describe('the codec of a keyframe', () => {
  it('is told by its sequence parameters, whatever stands before them', () => {
    expect(codecOf(accessUnit(true, 1, [0x42, 0xc0, 0x1f]))).toBe('avc1.42c01f');
    const delimited = Uint8Array.from([0, 0, 0, 1, 9, 0xf0, ...accessUnit(true, 1, [0x4d, 0x00, 0x28])]);
    expect(codecOf(delimited)).toBe('avc1.4d0028');
    // Of another nal_ref_idc.
    expect(codecOf(Uint8Array.of(0, 0, 1, 0x27, 0x64, 0x00, 0x0a))).toBe('avc1.64000a');
  });

  it('is not told without them', () => {
    for (const unit of [accessUnit(false, 1), new Uint8Array(), Uint8Array.of(0, 0, 1, 0x67, 0x42)]) {
      expect(codecOf(unit)).toBeUndefined();
    }
  });
});

describe('planes', () => {
  const cases = (['h264', 'h264_stacked'] as const).flatMap((coding) =>
    (['I420', 'NV12'] as const).flatMap((format) =>
      [16, 20, 21].map((pageSize) => [coding, format, pageSize] as const),
    ),
  );

  it.each(cases)('of %s as %s, page of %i, are cut out of the picture', (coding, format, pageSize) => {
    const planes = planesOf(rawPage(format, { coding, pageSize }) as RawPicture, { coding, pageSize });
    const side = coding === 'h264' ? Math.ceil(pageSize / 2) : pageSize;
    const { width, height, chromaWidth, chromaHeight } = planes;
    expect([width, height, chromaWidth, chromaHeight]).toEqual([pageSize, pageSize, side, side]);
    const wanted = (plane: number, along: number) =>
      Uint8Array.from({ length: along * along }, (_, i) => sampleOf(plane, i % along, Math.floor(i / along)));
    expect(planes.y).toEqual(wanted(0, pageSize));
    expect(planes.co).toEqual(wanted(1, side));
    expect(planes.cg).toEqual(wanted(2, side));
  });

  it('of a smaller picture are none', () => {
    const picture = rawPage('I420', FORMAT) as RawPicture;
    const cut = () => planesOf(picture, { coding: 'h264', pageSize: 33 });
    expect(cut).toThrow('a picture of 32 × 32 for a page of 33');
    expect(() => planesOf(picture, { coding: 'h264_stacked', pageSize: 20 })).toThrow(RangeError);
  });
});

describe('a decoder of a region', () => {
  let decoder: RegionDecoder;

  beforeEach(() => {
    vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout'] });
    decoder = new RegionDecoder(FORMAT);
  });

  afterEach(() => {
    decoder.close();
    expect(vi.getTimerCount(), 'timers of a decoder that is closed').toBe(0);
    vi.useRealTimers();
  });

  const made = () => FakeVideoDecoder.made;
  const newest = () => made()[made().length - 1];
  const kinds = () => made().map(({ config }) => config?.hardwareAcceleration);
  const marks = () => newest().chunks.map(({ data }) => data[data.length - 1]);
  const key = (mark: number) => decoder.decode(accessUnit(true, mark), true);
  const delta = (mark: number) => decoder.decode(accessUnit(false, mark), false);
  /** Pictures have been copied. */
  const copied = () => new Promise<void>((resolve) => setImmediate(resolve));

  /** The oldest picture that has not come. */
  function output(from = newest(), picture = rawPage('I420', FORMAT)): void {
    from.output(from.chunks.shift()!, picture);
  }

  /** The oldest picture that has not come, of which the first lumel is the last byte of its unit. */
  function outputMarked(): void {
    const picture = rawPage('I420', FORMAT);
    picture.bytes[0] = marks()[0];
    output(newest(), picture);
  }

  it('is made for the codec of the first keyframe, for little delay', async () => {
    expect(await decoder.decode(accessUnit(false, 1), false)).toBeUndefined();
    expect(made()).toEqual([]);
    const decoded = decoder.decode(accessUnit(true, 2), true);
    expect(newest().config).toEqual({
      codec: 'avc1.42c01f',
      optimizeForLatency: true,
      hardwareAcceleration: 'no-preference',
    });
    const [chunk] = newest().chunks;
    expect([chunk.type, chunk.data]).toEqual(['key', accessUnit(true, 2)]);
    output();
    expect((await decoded)?.y).toEqual(planesOf(rawPage('I420', FORMAT) as RawPicture, FORMAT).y);
  });

  it('gives each unit its picture, in whatever order they come', async () => {
    const first = decoder.decode(accessUnit(true, 1), true);
    const second = decoder.decode(accessUnit(false, 2), false);
    const [one, two] = newest().chunks;
    expect([one.type, two.type]).toEqual(['key', 'delta']);
    newest().output(two, rawPage('NV12', FORMAT));
    expect((await second)?.width).toBe(20);
    newest().output(one, rawPage('I420', FORMAT));
    expect((await first)?.width).toBe(20);
    expect(made().length).toBe(1);
  });

  it('goes on at a keyframe of the same codec, and is made anew for another', async () => {
    const units = [0x1f, 0x1f, 0x28].map((level) => accessUnit(true, 0, [0x42, 0xc0, level]));
    const decoded = units.map((unit) => decoder.decode(unit, true));
    expect(made().map(({ config }) => config?.codec)).toEqual(['avc1.42c01f', 'avc1.42c028']);
    expect(made()[0].state).toBe('closed');
    expect(await Promise.all(decoded.slice(0, 2))).toEqual([undefined, undefined]);
    output();
    expect((await decoded[2])?.width).toBe(20);
  });

  it('that fails is replaced at once, by one that begins with the group', async () => {
    const before = [key(1), delta(2)];
    for (let i = 0; i < 2; i++) output();
    await Promise.all(before);
    const decoded = [delta(3), delta(4)];
    made()[0].fail();
    expect(kinds()).toEqual(['no-preference', 'prefer-software']);
    decoded.push(delta(5));
    expect(marks()).toEqual([1, 2, 3, 4, 5]);
    expect(newest().chunks.map(({ type }) => type)).toEqual(['key', 'delta', 'delta', 'delta', 'delta']);
    while (newest().chunks.length > 0) outputMarked();
    expect((await Promise.all(decoded)).map((planes) => planes?.y[0])).toEqual([3, 4, 5]);
    // The other way round in the next group.
    const next = key(6);
    newest().fail();
    expect([kinds()[2], marks()]).toEqual(['no-preference', [6]]);
    outputMarked();
    expect((await next)?.y[0]).toBe(6);
  });

  it('that fails while nothing waits is replaced too', async () => {
    const first = key(1);
    output();
    await first;
    newest().fail();
    expect(vi.getTimerCount()).toBe(0);
    const second = delta(2);
    expect([kinds()[1], marks()]).toEqual(['prefer-software', [1, 2]]);
    while (newest().chunks.length > 0) outputMarked();
    expect((await second)?.y[0]).toBe(2);
  });

  it('that fails in a group has no pictures of the groups before', async () => {
    const [lost, decoded] = [key(1), key(2)];
    newest().fail();
    expect(await lost).toBeUndefined();
    expect(marks()).toEqual([2]);
    outputMarked();
    expect((await decoded)?.y[0]).toBe(2);
  });

  it.each([
    ['fail', () => newest().fail()],
    ['give nothing', () => void vi.advanceTimersByTime(1000)],
  ])('of which both kinds %s gives nothing until the next keyframe', async (_, end) => {
    const lost = [key(1), delta(2)];
    end();
    expect(kinds()).toEqual(['no-preference', 'prefer-software']);
    end();
    lost.push(delta(3));
    expect(await Promise.all(lost)).toEqual([undefined, undefined, undefined]);
    expect([made().length, newest().state, vi.getTimerCount()]).toEqual([2, 'closed', 0]);
    const next = key(4);
    expect(kinds()[2]).toBe('no-preference');
    // Both are tried again.
    end();
    expect([kinds()[3], marks()]).toEqual(['prefer-software', [4]]);
    output();
    expect((await next)?.width).toBe(20);
  });

  it.each(['configure', 'decode'] as const)('that fails to %s is replaced', async (failing) => {
    FakeVideoDecoder.fails = (call, kind) => call === failing && kind === 'no-preference';
    const decoded = key(1);
    expect([made().length, made()[0].state, marks()]).toEqual([2, 'closed', [1]]);
    output();
    expect((await decoded)?.width).toBe(20);
    FakeVideoDecoder.fails = (call) => call === failing;
    expect(await decoder.decode(accessUnit(true, 2, [0x4d, 0x00, 0x28]), true)).toBeUndefined();
    expect(await delta(3)).toBeUndefined();
    FakeVideoDecoder.fails = () => false;
    const next = key(4);
    output();
    expect((await next)?.width).toBe(20);
  });

  it('whose pictures lie otherwise in memory is replaced', async () => {
    for (const picture of [
      { ...rawPage('I420', FORMAT), format: 'RGBA' },
      { ...rawPage('I420', FORMAT), format: null },
      rawPage('I420', { ...FORMAT, pageSize: 16 }),
    ]) {
      const decoded = key(1);
      const from = newest();
      output(from, picture);
      await copied();
      expect(from.state).toBe('closed');
      output();
      expect((await decoded)?.width).toBe(20);
    }
  });

  it('that gives nothing for a second is replaced, though no unit comes', async () => {
    const first = key(1);
    vi.advanceTimersByTime(900);
    const second = delta(2);
    vi.advanceTimersByTime(99);
    expect(kinds()).toEqual(['no-preference']);
    vi.advanceTimersByTime(1);
    expect(kinds()).toEqual(['no-preference', 'prefer-software']);
    expect(made()[0].state).toBe('closed');
    expect(marks()).toEqual([1, 2]);
    // The new one has a second of its own.
    vi.advanceTimersByTime(999);
    for (let i = 0; i < 2; i++) outputMarked();
    expect((await Promise.all([first, second])).map((planes) => planes?.y[0])).toEqual([1, 2]);
    // It stays.
    void key(3);
    expect(made().length).toBe(2);
  });

  it('that gives something is not, however late it is', async () => {
    const decoded = Array.from({ length: 30 }, (_, i) => {
      const picture = i === 0 ? key(i) : delta(i);
      vi.advanceTimersByTime(100);
      if (i % 5 === 4) output();
      return picture;
    });
    while (newest().chunks.length > 0) output();
    expect((await Promise.all(decoded)).every((picture) => picture?.width === 20)).toBe(true);
    // Nor one that had nothing to do.
    expect(vi.getTimerCount()).toBe(0);
    vi.advanceTimersByTime(60_000);
    const last = delta(30);
    vi.advanceTimersByTime(999);
    output();
    expect((await last)?.width).toBe(20);
    expect(made().length).toBe(1);
  });

  it.each([
    ['of as many units as are kept is', MOST_KEPT, 0, true],
    ['of more units is not', MOST_KEPT + 1, 0, false],
    ['of more bytes is not', 2, MOST_BYTES, false],
  ])('that fails in a group %s replaced at once', async (_, units, bytes, replaced) => {
    const first = key(0);
    output();
    await first;
    for (let i = 1; i + 1 < units; i++) {
      const decoded = delta(i);
      output();
      await decoded;
    }
    const unit = new Uint8Array(accessUnit(false, 9).length + bytes);
    unit.set(accessUnit(false, 9));
    const last = decoder.decode(unit, false);
    newest().fail();
    expect(made().length).toBe(replaced ? 2 : 1);
    if (replaced) expect(newest().chunks.length).toBe(units);
    while (replaced && newest().chunks.length > 0) output();
    expect((await last)?.width).toBe(replaced ? 20 : undefined);
    const next = key(1);
    expect(kinds()).toEqual(['no-preference', 'prefer-software']);
    output();
    expect((await next)?.width).toBe(20);
  });

  it('takes no more than a group of units at a time', async () => {
    const decoded = Array.from({ length: 65 }, (_, i) => decoder.decode(accessUnit(i === 0, i), i === 0));
    expect(await Promise.all(decoded)).toEqual(Array(65).fill(undefined));
    const next = decoder.decode(accessUnit(true, 0), true);
    // It was slow, not broken.
    expect(newest().config?.hardwareAcceleration).toBe('no-preference');
    output();
    expect((await next)?.width).toBe(20);
  });

  it('waits for nothing once it is closed', async () => {
    const lost = key(1);
    expect(vi.getTimerCount()).toBe(1);
    decoder.close();
    expect(vi.getTimerCount()).toBe(0);
    vi.advanceTimersByTime(10_000);
    expect(await lost).toBeUndefined();
    expect(made().length).toBe(1);
  });

  it('closes pictures that come too late', async () => {
    const lost = decoder.decode(accessUnit(true, 1), true);
    const before = newest();
    const [chunk] = before.chunks;
    decoder.close();
    before.output(chunk, rawPage('I420', FORMAT));
    expect(await lost).toBeUndefined();
  });
});

describe('decoders in a worker', () => {
  /** A worker on this thread: messages are copied, and come later. */
  class FakeWorker implements DecoderWorker {
    static started: FakeWorker[] = [];
    onmessage: DecoderWorker['onmessage'] = null;
    onerror: DecoderWorker['onerror'] = null;
    terminated = false;
    readonly decoders = new FakeDecoders();
    private readonly service = new DecoderService(this.decoders.open, (answer: Answer, transfer) => {
      const data = structuredClone(answer, { transfer });
      if (!this.terminated) this.onmessage?.call(this as unknown as Worker, { data } as MessageEvent<Answer>);
    });

    constructor() {
      FakeWorker.started.push(this);
    }

    postMessage(question: Question, options?: Transferable[] | StructuredSerializeOptions): void {
      const transfer = Array.isArray(options) ? options : [];
      this.service.take(structuredClone(question, { transfer }));
    }

    terminate(): void {
      this.terminated = true;
    }

    fail(): void {
      const event = { preventDefault: () => {} } as ErrorEvent;
      this.onerror?.call(this as unknown as Worker, event);
    }
  }

  let here: FakeDecoders;
  let pool: DecoderPool;

  beforeEach(() => {
    FakeWorker.started = [];
    here = new FakeDecoders();
    pool = new DecoderPool(() => new FakeWorker(), here.open);
  });

  const worker = () => FakeWorker.started[FakeWorker.started.length - 1];

  it('share one, and each unit has its picture', async () => {
    const [a, b] = [pool.open(FORMAT), pool.open({ coding: 'h264_stacked', pageSize: 4 })];
    const units = [accessUnit(true, 1), accessUnit(true, 2)];
    const decoded = [a.decode(units[0], true), b.decode(units[1], true)];
    expect(FakeWorker.started.length).toBe(1);
    expect(worker().decoders.formats).toEqual([FORMAT, { coding: 'h264_stacked', pageSize: 4 }]);
    const [first, second] = worker().decoders.given;
    await second.answer(grey(4, 9));
    await first.answer(grey(20, 8));
    expect((await Promise.all(decoded)).map((planes) => planes?.y[0])).toEqual([8, 9]);
    // The frame that a unit is a part of stays whole.
    expect(units.map(({ length }) => length)).toEqual([20, 20]);
    const none = a.decode(accessUnit(false, 3), false);
    await worker().decoders.given[2].answer(undefined);
    expect(await none).toBeUndefined();
  });

  it('end it with the last of them, and begin another', async () => {
    const [a, b] = [pool.open(FORMAT), pool.open(FORMAT)];
    const lost = a.decode(accessUnit(true, 1), true);
    a.close();
    a.close();
    expect(await lost).toBeUndefined();
    expect([worker().terminated, worker().decoders.closed]).toEqual([false, [0]]);
    expect(await a.decode(accessUnit(true, 1), true)).toBeUndefined();
    b.close();
    expect(worker().terminated).toBe(true);
    const decoded = pool.open(FORMAT).decode(accessUnit(true, 1), true);
    expect(FakeWorker.started.length).toBe(2);
    await worker().decoders.given[0].answer(grey(20, 7));
    expect((await decoded)?.y[0]).toBe(7);
  });

  it('go on in the page where it fails', async () => {
    const region = pool.open(FORMAT);
    const lost = region.decode(accessUnit(true, 1), true);
    worker().fail();
    expect(await lost).toBeUndefined();
    const decoded = region.decode(accessUnit(true, 2), true);
    await here.answer();
    expect((await decoded)?.y[0]).toBe(2);
    region.close();
    expect(here.closed).toEqual([0]);
    expect(FakeWorker.started.length).toBe(1);
  });

  it('go on in the page where there is none', async () => {
    const forbidden = new DecoderPool(() => {
      throw new Error('workers are forbidden');
    }, here.open);
    const decoded = forbidden.open(FORMAT).decode(accessUnit(true, 3), true);
    await here.answer();
    expect((await decoded)?.y[0]).toBe(3);
  });
});

it('there are decoders where the browser has WebCodecs and workers', () => {
  const all = { VideoDecoder: {}, Worker: {} };
  expect(videoDecoders(all)).toBeInstanceOf(Function);
  for (const missing of Object.keys(all)) {
    expect(videoDecoders({ ...all, [missing]: undefined })).toBeUndefined();
  }
});

it('planes have buffers of their own, which can be handed over', () => {
  const planes: Planes = planesOf(rawPage('NV12', FORMAT) as RawPicture, FORMAT);
  for (const plane of [planes.y, planes.co, planes.cg]) expect(plane.buffer.byteLength).toBe(plane.length);
});
