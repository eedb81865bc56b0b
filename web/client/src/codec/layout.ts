/** Layouts: where surfaces lie on the pages of a lightmap (docs/wire.md, "Layouts"). */
import { WireError } from '../wire-error.js';
import type { Charts } from './charts.js';
import { LIMITS } from './limits.js';
import type { Reader } from './reader.js';
import { readResource } from './resource.js';

/** Where surfaces lie on the pages of a lightmap. */
export interface LightmapLayout {
  /** Lumels along both sides of each page. */
  readonly pageSize: number;
  readonly pages: number;
  /** Those of which the charts are known, in ascending order of node, copy, primitive and side. */
  readonly surfaces: readonly LightmapSurface[];
}

/** One side of a primitive of an instance of a node. */
export interface LightmapSurface {
  readonly node: number;
  /** Which of the node's instances. */
  readonly copy: number;
  /** Which primitive of the node's mesh. */
  readonly primitive: number;
  /** Whether it is the side on which triangles wind clockwise. */
  readonly back: boolean;
  readonly charts: Charts;
  /** Where each of the charts' rectangles lies. */
  readonly rectangles: readonly Rectangle[];
}

/** Where a rectangle of lumels lies: its page and its first lumel there. */
export interface Rectangle {
  readonly page: number;
  readonly x: number;
  readonly y: number;
}

/** A layout as it is sent: charts are told by name. */
export interface LayoutResource {
  readonly pageSize: number;
  readonly pages: number;
  readonly surfaces: readonly PlacedSurface[];
}

/** A surface of which the charts are told by name. */
export interface PlacedSurface extends Omit<LightmapSurface, 'charts'> {
  /** The SHA-256 of the charts' bytes, in hexadecimal. */
  readonly charts: string;
}

const VERSION = 1;
/** Bytes of a surface without rectangles, and of a rectangle, at least. */
const LEAST = { surface: 37, rectangle: 3 } as const;
const HASH_BYTES = 32;

/**
 * Reads a layout.
 * @throws WireError where the bytes are none of this version, exceed a limit or contradict themselves.
 */
export function readLayout(bytes: Uint8Array): LayoutResource {
  return readResource(bytes, VERSION, (reader) => {
    const [pageSize, pages] = [reader.number(), reader.number()];
    if (pageSize > LIMITS.pageLumels) {
      throw new WireError('limit', `a page of ${pageSize} lumels along a side`);
    }
    const surfaces: PlacedSurface[] = [];
    for (let left = reader.count(LEAST.surface); left > 0; left--) {
      const surface = readSurface(reader, pageSize, pages);
      const last = surfaces.at(-1);
      if (last && !isBefore(last, surface)) throw new WireError('malformed', 'surfaces out of order');
      surfaces.push(surface);
    }
    return { pageSize, pages, surfaces };
  });
}

function readSurface(reader: Reader, pageSize: number, pages: number): PlacedSurface {
  const [node, copy, primitive] = [reader.number(), reader.number(), reader.number()];
  const side = reader.u8();
  if (side > 1) throw new WireError('malformed', 'a side of a surface');
  const charts = Array.from(reader.take(HASH_BYTES), (byte) => byte.toString(16).padStart(2, '0')).join('');
  const rectangles = Array.from({ length: reader.count(LEAST.rectangle) }, () => {
    const [page, x, y] = [reader.number(), reader.number(), reader.number()];
    if (page >= pages || x >= pageSize || y >= pageSize) {
      throw new WireError('malformed', 'a rectangle outside the pages');
    }
    return { page, x, y };
  });
  return { node, copy, primitive, back: side === 1, charts, rectangles };
}

/** Whether a surface comes before another by node, copy, primitive and side. */
function isBefore(a: PlacedSurface, b: PlacedSurface): boolean {
  const order = a.node - b.node || a.copy - b.copy || a.primitive - b.primitive;
  return order === 0 ? !a.back && b.back : order < 0;
}

/**
 * The layout of the surfaces whose charts are known. A surface whose rectangles are not those of its charts,
 * or do not fit their pages, is left out.
 */
export function layOut(
  resource: LayoutResource,
  known: (charts: string) => Charts | undefined,
): LightmapLayout {
  const { pageSize, pages } = resource;
  const surfaces: LightmapSurface[] = [];
  for (const placed of resource.surfaces) {
    const charts = known(placed.charts);
    if (charts && fits(placed.rectangles, charts.sizes, pageSize)) surfaces.push({ ...placed, charts });
  }
  return { pageSize, pages, surfaces };
}

function fits(rectangles: readonly Rectangle[], sizes: Charts['sizes'], pageSize: number): boolean {
  return (
    rectangles.length === sizes.length &&
    rectangles.every(({ x, y }, i) => x + sizes[i][0] <= pageSize && y + sizes[i][1] <= pageSize)
  );
}
