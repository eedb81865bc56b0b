/** Charts: how the triangles of a primitive lie on rectangles of lumels (docs/wire.md, "Charts"). */
import { WireError } from '../wire-error.js';
import { LIMITS } from './limits.js';
import { type Reader, unzigzag } from './reader.js';
import { readResource } from './resource.js';

/** How the triangles of a primitive lie on rectangles of lumels. */
export interface Charts {
  /** Lumels of each rectangle along x and y. */
  readonly sizes: readonly (readonly [number, number])[];
  /** Of each chart vertex the vertex of the primitive, as numbered in the glTF file. */
  readonly sources: Uint32Array;
  /** The rectangle of each chart vertex. */
  readonly rectangle: Uint32Array;
  /**
   * x, y of each chart vertex, lumels from its rectangle's corner; the middle of the first lumel is at
   * 0.5, 0.5.
   */
  readonly at: Float32Array;
  /**
   * Three chart vertices for each triangle of the primitive, in its order; −1, −1, −1 where it has no
   * lumels.
   */
  readonly triangles: Int32Array;
}

const VERSION = 1;
/** Steps of coordinates in a lumel. */
const STEPS = 256;

/**
 * Reads charts.
 * @throws WireError where the bytes are none of this version, exceed a limit or contradict themselves.
 */
export function readCharts(bytes: Uint8Array): Charts {
  return readResource(bytes, VERSION, (reader) => {
    const sizes = Array.from({ length: reader.count(2) }, () => [side(reader), side(reader)] as const);
    const vertices = readVertices(reader, sizes);
    return { sizes, ...vertices, triangles: readTriangles(reader, vertices.rectangle) };
  });
}

function side(reader: Reader): number {
  const side = reader.number();
  if (side > LIMITS.pageLumels) throw new WireError('limit', `a rectangle of ${side} lumels along a side`);
  if (side === 0) throw new WireError('malformed', 'an empty rectangle');
  return side;
}

function readVertices(reader: Reader, sizes: Charts['sizes']): Pick<Charts, 'sources' | 'rectangle' | 'at'> {
  const count = reader.count(4);
  const sources = new Uint32Array(count);
  const rectangle = new Uint32Array(count);
  const at = new Float32Array(2 * count);
  let [source, x, y] = [0, 0, 0];
  for (let vertex = 0; vertex < count; vertex++) {
    source += reader.zigzag();
    const own = reader.number();
    x += reader.zigzag();
    y += reader.zigzag();
    if (own >= sizes.length) throw new WireError('malformed', 'a vertex without a rectangle');
    const [width, height] = sizes[own];
    if (x < 0 || y < 0 || x > STEPS * width || y > STEPS * height) {
      throw new WireError('malformed', 'a vertex outside its rectangle');
    }
    if (source < 0 || source > 0xffff_ffff) throw new WireError('malformed', "a vertex's source");
    sources[vertex] = source;
    rectangle[vertex] = own;
    at[2 * vertex] = x / STEPS;
    at[2 * vertex + 1] = y / STEPS;
  }
  return { sources, rectangle, at };
}

function readTriangles(reader: Reader, rectangle: Uint32Array): Int32Array {
  const count = reader.count(1);
  const triangles = new Int32Array(3 * count).fill(-1);
  let a = 0;
  for (let i = 0; i < triangles.length; i += 3) {
    const first = reader.varint();
    if (first === 0) continue;
    a += unzigzag(first - 1);
    const b = a + reader.zigzag();
    const c = a + reader.zigzag();
    if (!isVertex(a, rectangle) || !isVertex(b, rectangle) || !isVertex(c, rectangle)) {
      throw new WireError('malformed', 'a triangle without a vertex');
    }
    if (rectangle[a] !== rectangle[b] || rectangle[a] !== rectangle[c]) {
      throw new WireError('malformed', 'a triangle in several rectangles');
    }
    triangles[i] = a;
    triangles[i + 1] = b;
    triangles[i + 2] = c;
  }
  return triangles;
}

function isVertex(number: number, rectangle: Uint32Array): boolean {
  return number >= 0 && number < rectangle.length;
}
