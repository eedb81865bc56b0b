/** Planes of decoded pictures, as lightmaps mean them. */
import type { Planes } from '../api.js';
import type { VideoFormat } from '../cache/picture-decoder.js';

/** A decoded picture in memory: where each of its planes begins, and the bytes from row to row. */
export interface RawPicture {
  readonly bytes: Uint8Array;
  /** Three planes, or two of which the second has both chroma channels by turns. */
  readonly format: 'I420' | 'NV12';
  readonly layout: readonly { readonly offset: number; readonly stride: number }[];
  /** Columns and rows of luma. */
  readonly width: number;
  readonly height: number;
}

/** Rows and columns of video are multiples of this. */
const MACROBLOCK = 16;

/** What a page has of a picture. Throws where the picture is smaller than the page. */
export function planesOf(picture: RawPicture, { coding, pageSize }: VideoFormat): Planes {
  const [columns, rows] = needed(coding, pageSize);
  if (picture.width < columns || picture.height < rows) {
    throw new RangeError(`a picture of ${picture.width} × ${picture.height} for a page of ${pageSize}`);
  }
  return coding === 'h264' ? besideEachOther(picture, pageSize) : belowEachOther(picture, pageSize);
}

/** Columns and rows of luma that a page's picture has, at least. */
function needed(coding: VideoFormat['coding'], pageSize: number): [number, number] {
  return [pageSize, coding === 'h264' ? pageSize : 2 * padded(pageSize) + pageSize];
}

/** A page's side as it is coded. */
function padded(pageSize: number): number {
  return MACROBLOCK * Math.ceil(pageSize / MACROBLOCK);
}

/** Y is the luma, Co and Cg are the chroma of half the resolution. */
function besideEachOther({ bytes, format, layout }: RawPicture, pageSize: number): Planes {
  const half = Math.ceil(pageSize / 2);
  const chroma = (channel: number) =>
    format === 'I420'
      ? cut(bytes, layout[1 + channel], half)
      : cut(bytes, { ...layout[1], offset: layout[1].offset + channel }, half, 2);
  return {
    y: cut(bytes, layout[0], pageSize),
    co: chroma(0),
    cg: chroma(1),
    width: pageSize,
    height: pageSize,
    chromaWidth: half,
    chromaHeight: half,
  };
}

/** Y, Co and Cg stand below each other in the luma. */
function belowEachOther({ bytes, layout }: RawPicture, pageSize: number): Planes {
  const { offset, stride } = layout[0];
  const [y, co, cg] = [0, 1, 2].map((number) =>
    cut(bytes, { offset: offset + number * padded(pageSize) * stride, stride }, pageSize),
  );
  return { y, co, cg, width: pageSize, height: pageSize, chromaWidth: pageSize, chromaHeight: pageSize };
}

/** A square of so many samples a side, each `step` bytes after the one before, as rows without gaps. */
function cut(
  bytes: Uint8Array,
  { offset, stride }: RawPicture['layout'][number],
  side: number,
  step = 1,
): Uint8Array<ArrayBuffer> {
  const out = new Uint8Array(side * side);
  for (let row = 0; row < side; row++) {
    const from = offset + row * stride;
    if (step === 1) out.set(bytes.subarray(from, from + side), row * side);
    else for (let i = 0; i < side; i++) out[row * side + i] = bytes[from + step * i];
  }
  return out;
}
