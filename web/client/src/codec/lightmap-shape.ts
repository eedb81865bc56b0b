/** The shape of a lightmap: the catalog's `shape` where `kind` is `lightmap`. */
import { WireError } from '../wire-error.js';
import { type Json, text, whole } from './json.js';
import { LIMITS } from './limits.js';

/** Irradiance at lumels, small squares that surfaces are covered with, which lie on square pages. */
export interface LightmapShape {
  /** How lumels are coded. */
  readonly coding: Coding;
  /** Lumels along both sides of each page. */
  readonly pageSize: number;
  readonly pages: number;
  /** Whether there are slopes, too, which tell how irradiance depends on the normal. */
  readonly slopes?: true;
  /** The resource that tells where surfaces lie on the pages: the SHA-256 of its bytes, in hexadecimal. */
  readonly layout: string;
}

/**
 * Half floats without loss; H.264 with chroma of half the resolution; H.264 with the three channels below
 * each other as luma, which keeps their resolution.
 */
const CODINGS = ['halves', 'h264', 'h264_stacked'] as const;

export type Coding = (typeof CODINGS)[number];

/** Those of which each region is a video. */
export type VideoCoding = Exclude<Coding, 'halves'>;

/** Whether a lightmap travels as video. */
export function isVideo(coding: Coding): coding is VideoCoding {
  return coding !== 'halves';
}

/** A part of a page that is coded and sent as one frame: a region of a lightmap. */
export interface Tile {
  readonly page: number;
  /** Whether it tells slopes of the page (see `slopeOf`), in place of irradiance. */
  readonly slopes?: true;
  /** Its first lumel. */
  readonly min: readonly [number, number];
  /** Lumels along x and y. */
  readonly size: readonly [number, number];
}

/** Number of lumels of all pages; where there are slopes, of these too. */
export function lumelCount(shape: LightmapShape): number {
  return pictureCount(shape) * shape.pageSize ** 2;
}

/** Pages of irradiance, and of slopes. */
function pictureCount({ pages, slopes }: LightmapShape): number {
  return slopes ? 2 * pages : pages;
}

/**
 * Number of a lightmap's regions, which are numbered from 0, page after page, row after row; those of slopes
 * come after those of irradiance.
 */
export function tileCount(shape: LightmapShape): number {
  return pictureCount(shape) * tilesAlongSide(shape) ** 2;
}

/** The tile of a number; `undefined` where there is none. */
export function tileOf(shape: LightmapShape, region: number): Tile | undefined {
  if (!Number.isInteger(region) || region < 0 || region >= tileCount(shape)) return undefined;
  const along = tilesAlongSide(shape);
  const side = tileSide(shape);
  const [column, row] = [region % along, Math.floor(region / along) % along];
  const min = [column * side, row * side] as const;
  const size = [Math.min(side, shape.pageSize - min[0]), Math.min(side, shape.pageSize - min[1])] as const;
  const picture = Math.floor(region / along ** 2);
  if (picture < shape.pages) return { page: picture, min, size };
  return { page: picture - shape.pages, slopes: true, min, size };
}

/** Lumels along a side of tiles; those at a page's right and lower edge may be smaller. */
function tileSide({ coding, pageSize }: LightmapShape): number {
  return isVideo(coding) ? pageSize : LIMITS.tileLumels;
}

function tilesAlongSide(shape: LightmapShape): number {
  return Math.ceil(shape.pageSize / tileSide(shape));
}

/**
 * Reads a lightmap's shape; `undefined` where its coding is another than this client knows.
 * @throws WireError where the shape is wrong or exceeds a limit.
 */
export function parseLightmapShape(json: Json): LightmapShape | undefined {
  const coding = CODINGS.find((coding) => coding === json.coding);
  if (!coding) return undefined;
  if (json.slopes !== undefined && typeof json.slopes !== 'boolean') {
    throw new WireError('malformed', 'slopes is neither true nor false');
  }
  const shape = {
    coding,
    pageSize: whole(json.page_size, 'page_size', LIMITS.pageLumels, 1),
    pages: whole(json.pages, 'pages', LIMITS.lumelsPerField, 1),
    ...(json.slopes && { slopes: true as const }),
    layout: parseHash(json.layout, 'layout'),
  };
  const [lumels, tiles] = [lumelCount(shape), tileCount(shape)];
  if (lumels > LIMITS.lumelsPerField) throw new WireError('limit', `a field of ${lumels} lumels`);
  if (tiles > LIMITS.regionsPerField) throw new WireError('limit', `a field of ${tiles} regions`);
  return shape;
}

function parseHash(json: unknown, what: string): string {
  const hash = text(json, what);
  if (!/^[0-9a-f]{64}$/i.test(hash)) {
    throw new WireError('malformed', `${what} is not 64 hexadecimal digits`);
  }
  return hash.toLowerCase();
}
