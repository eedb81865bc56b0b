import type { HalvesPicture, LumelPicture, PlanesPicture } from './api.js';
import { halfValue } from './codec/half.js';

/** The code that stands for no chroma. */
const NEUTRAL = 128;
const MOST_CODE = 255;

/**
 * What a lumel of a picture says, r, g, b in lux: the twin of what shaders do with pictures. `width`: lumels
 * of the picture along x. Codes of a video are
 *
 * Y = (r + 2g + b) / 4, Co = (r − b) / 2 + 128, Cg = (−r + 2g − b) / 4 + 128 of codes
 * 255 · log₂(1 + 2^toe · x) / octaves, where x is irradiance over the scale.
 *
 * Chroma of half the resolution is read with bilinear filtering; past its edges the last sample counts.
 */
export function irradianceOf(
  picture: LumelPicture,
  width: number,
  x: number,
  y: number,
): [r: number, g: number, b: number] {
  return picture.kind === 'halves' ? ofHalves(picture, y * width + x) : ofPlanes(picture, x, y);
}

function ofHalves({ texels, scale }: HalvesPicture, lumel: number): [number, number, number] {
  const value = (channel: number) => halfValue(texels[4 * lumel + channel]) * scale;
  return [value(0), value(1), value(2)];
}

function ofPlanes(picture: PlanesPicture, x: number, y: number): [number, number, number] {
  const luma = picture.y[y * picture.width + x];
  const co = chroma(picture, picture.co, x, y) - NEUTRAL;
  const cg = chroma(picture, picture.cg, x, y) - NEUTRAL;
  const { scale, toe, octaves } = picture;
  const value = (code: number) => {
    const exponent = (Math.min(Math.max(code, 0), MOST_CODE) / MOST_CODE) * octaves;
    return (scale * (2 ** exponent - 1)) / 2 ** toe;
  };
  return [value(luma - cg + co), value(luma + cg), value(luma - cg - co)];
}

/** Chroma at the middle of a lumel. */
function chroma(picture: PlanesPicture, plane: Uint8Array, x: number, y: number): number {
  const { width, chromaWidth, chromaHeight } = picture;
  if (chromaWidth === width) return plane[y * width + x];
  // Sample i is at the border of lumels 2i and 2i + 1.
  const [column, row] = [(x - 0.5) / 2, (y - 0.5) / 2];
  const [left, top] = [Math.floor(column), Math.floor(row)];
  const [u, v] = [column - left, row - top];
  const sample = (i: number, j: number) => {
    const [inX, inY] = [clamped(i, chromaWidth - 1), clamped(j, chromaHeight - 1)];
    return plane[inY * chromaWidth + inX];
  };
  const upper = (1 - u) * sample(left, top) + u * sample(left + 1, top);
  const lower = (1 - u) * sample(left, top + 1) + u * sample(left + 1, top + 1);
  return (1 - v) * upper + v * lower;
}

function clamped(index: number, last: number): number {
  return Math.min(Math.max(index, 0), last);
}
