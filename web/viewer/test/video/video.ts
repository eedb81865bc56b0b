/** Casts pages of lumels as video to a session in the same page, and looks at what comes out. */
import { connect, irradianceOf, isLightmap, type Link, type VideoCoding } from '@lumencast/client';
import { frameHead, join } from '../../../client/test/support/probe-encoder.js';

/** What came out of updates that were sent. */
export interface Outcome {
  /** How far codes of the last picture are from those that were coded, at most. */
  readonly error: number;
  /** Pictures that were told of. */
  readonly pictures: number;
  /** Irradiance of the lumel in the middle, and what it was. */
  readonly middle: readonly number[];
  readonly wanted: readonly number[];
  /** Columns of chroma for each of luma. */
  readonly chroma: number;
}

declare global {
  interface Window {
    /** What comes of so many updates; `undefined` where the page cannot show such lightmaps. */
    cast?: (coding: VideoCoding, pageSize: number, updates: number) => Promise<Outcome | undefined>;
    /** Ends the session of the last cast. */
    end?: () => void;
  }
}

const TOE = 7;
const OCTAVES = 12;
const SCALE_LOG2 = 4;
const utf8 = new TextEncoder();

/** Y, Co and Cg of a page at an update: they vary little from lumel to lumel, and move. */
function codesOf(x: number, y: number, update: number): [number, number, number] {
  const wave = (period: number, phase: number) => Math.sin((x + 2 * y) / period + phase + update / 10);
  return [120 + 60 * wave(9, 0), 128 + 30 * wave(17, 1), 128 - 20 * wave(23, 2)].map(Math.round) as [
    number,
    number,
    number,
  ];
}

/** A page as the picture that a server codes, planes one after the other. */
function pictureOf(coding: VideoCoding, pageSize: number, update: number): VideoFrame {
  const side = 16 * Math.ceil(pageSize / 16);
  const height = coding === 'h264' ? side : 3 * side;
  const data = new Uint8Array((side * height * 3) / 2).fill(128);
  const at = (i: number) => Math.min(i, pageSize - 1);
  for (let y = 0; y < side; y++) {
    for (let x = 0; x < side; x++) {
      const codes = codesOf(at(x), at(y), update);
      data[y * side + x] = codes[0];
      if (coding !== 'h264_stacked') continue;
      for (const plane of [1, 2]) data[(plane * side + y) * side + x] = codes[plane];
    }
  }
  if (coding === 'h264') {
    const half = side / 2;
    for (let y = 0; y < half; y++) {
      for (let x = 0; x < half; x++) {
        for (const plane of [1, 2]) {
          const lumels = [0, 1].flatMap((j) =>
            [0, 1].map((i) => codesOf(at(2 * x + i), at(2 * y + j), update)),
          );
          const mean = lumels.reduce((sum, codes) => sum + codes[plane], 0) / 4;
          data[side * side + (plane - 1) * half * half + y * half + x] = Math.round(mean);
        }
      }
    }
  }
  return new VideoFrame(data, {
    format: 'I420',
    codedWidth: side,
    codedHeight: height,
    timestamp: 40_000 * update,
  });
}

/** Access units of so many updates, the first a keyframe. */
async function encode(coding: VideoCoding, pageSize: number, updates: number): Promise<Uint8Array[]> {
  const units: Uint8Array[] = [];
  const encoder = new VideoEncoder({
    output: (chunk) => {
      const unit = new Uint8Array(chunk.byteLength);
      chunk.copyTo(unit);
      units.push(unit);
    },
    error: (error) => {
      throw error;
    },
  });
  const first = pictureOf(coding, pageSize, 0);
  encoder.configure({
    codec: 'avc1.42c01f',
    width: first.codedWidth,
    height: first.codedHeight,
    bitrate: 20e6,
    framerate: 25,
    latencyMode: 'realtime',
    avc: { format: 'annexb' },
  });
  for (let update = 0; update < updates; update++) {
    const picture = update === 0 ? first : pictureOf(coding, pageSize, update);
    encoder.encode(picture, { keyFrame: update === 0 });
    picture.close();
  }
  await encoder.flush();
  encoder.close();
  return units;
}

function catalogOf(coding: VideoCoding, pageSize: number): Uint8Array {
  const shape = { coding, page_size: pageSize, pages: 1, layout: '00'.repeat(32) };
  const fields = [{ id: 0, use: 'static', kind: 'lightmap', shape }];
  const scene = { name: 'test', root: 'test.glb' };
  const epoch = '0123456789abcdef';
  return utf8.encode(JSON.stringify({ lumencast: 1, epoch, scene, tick_seconds: 0.04, fields }));
}

window.cast = async (coding, pageSize, updates) => {
  const readers = new Map<string, (frame: Uint8Array) => void>();
  const link: Link = {
    kind: 'websocket',
    subscribe: (track, _, onFrame) => {
      readers.set(track, onFrame);
      return { setPriority: () => {}, close: () => readers.delete(track) };
    },
    sendEdit: () => {},
    bandwidth: () => undefined,
    ended: new Promise(() => {}),
    close: () => {},
  };
  const session = connect(new URL('/test', location.href), { connector: async () => link });
  while (!readers.has('catalog')) await new Promise((resolve) => setTimeout(resolve));
  readers.get('catalog')!(catalogOf(coding, pageSize));
  window.end = () => session.close();
  if (session.unshown.length > 0) return undefined;
  const units = await encode(coding, pageSize, updates);
  let pictures = 0;
  const all = new Promise<void>((resolve) => {
    session.on('light', () => {
      if (++pictures === updates) resolve();
    });
  });
  units.forEach((unit, update) => {
    const base = update === 0 ? {} : { base: update - 1 };
    const head = frameHead({ update, ...base, scaleLog2: SCALE_LOG2 });
    readers.get('f0/r0/l0')!(join(head, [TOE, 8 * OCTAVES], unit));
  });
  await all;
  const [light] = session.light().fields.filter(isLightmap);
  const [{ picture }] = light.regions;
  if (picture.kind !== 'planes') throw new Error('a picture of halves');
  let error = 0;
  for (let y = 0; y < pageSize; y++) {
    for (let x = 0; x < pageSize; x++) {
      const codes = codesOf(x, y, updates - 1);
      error = Math.max(error, Math.abs(picture.y[y * picture.width + x] - codes[0]));
      if (picture.chromaWidth !== pageSize) continue;
      const found = [picture.co, picture.cg].map((plane) => plane[y * pageSize + x]);
      error = Math.max(error, Math.abs(found[0] - codes[1]), Math.abs(found[1] - codes[2]));
    }
  }
  const middle = Math.floor(pageSize / 2);
  const [y, co, cg] = codesOf(middle, middle, updates - 1);
  const value = (code: number) => (2 ** SCALE_LOG2 * (2 ** ((code / 255) * OCTAVES) - 1)) / 2 ** TOE;
  return {
    error,
    pictures,
    middle: irradianceOf(picture, pageSize, middle, middle),
    wanted: [y - cg + co, y + cg - 128, y - cg - co + 256].map(value),
    chroma: picture.chromaWidth / picture.width,
  };
};
