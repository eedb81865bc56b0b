/**
 * Geometries whose vertices are parted where charts are, so that each knows where its lumels lie. A still
 * mesh shows such a geometry in place of its own.
 */
import type { Charts } from '@lumencast/client';
import {
  BufferAttribute,
  BufferGeometry,
  InstancedBufferAttribute,
  InstancedInterleavedBuffer,
  InterleavedBufferAttribute,
  type Mesh,
  type TypedArray,
} from 'three';

/**
 * The attribute that tells where a vertex's lumels lie: x, y in lumels of the pages' texture plus
 * {@link FIRST}, of its front and, with four components, of its back. {@link NO_LUMELS} where that side
 * has none. WebGL reads attributes that a geometry lacks as 0, 0, 0, 1, or as 1, 1, 1, 1 after a shader
 * of a program's own: neither is a place.
 */
export const LUMELS = 'lumels';
export const FIRST = 2;
export const NO_LUMELS = -1;

/**
 * The attribute that tells how far a geometry's diffuse light has come from probes to its lumels, 0 to 1. It
 * has a value for each copy that is drawn in one go: a mesh that is no InstancedMesh has one.
 */
export const LUMEL_SHARE = 'lumelShare';

/**
 * The attribute that tells where the lumels of a copy begin, x, y in the pages' texture plus {@link FIRST}, of
 * its front and its back: {@link LUMELS} then counts from there. {@link NO_LUMELS} where that side of the copy
 * has none. Geometries without copies have no such attribute.
 */
export const LUMEL_CORNER = 'lumelCorner';

type Attribute = BufferAttribute | InterleavedBufferAttribute;

/** Charts of the two sides of a primitive. */
export type Sides = readonly [front: Charts | undefined, back: Charts | undefined];

/** What a geometry becomes by charts, wherever these lie on pages. */
export interface Parted {
  readonly attributes: Readonly<Record<string, Attribute>>;
  readonly index: BufferAttribute;
  /** Of each vertex the vertex of the charts of each side, or −1. */
  readonly chartVertices: readonly [front: Int32Array, back: Int32Array];
}

/** The geometries that stand behind those with charts. */
const originals = new WeakMap<BufferGeometry, BufferGeometry>();

/** A geometry as its file has it, without charts. */
export function withoutCharts(geometry: BufferGeometry): BufferGeometry {
  return originals.get(geometry) ?? geometry;
}

export function isCharted(geometry: BufferGeometry | undefined): boolean {
  return geometry !== undefined && originals.has(geometry);
}

/** Whether a mesh may take light from lumels: one that does not deform, nor is a batch of others. */
export function canHaveLumels(mesh: Mesh): boolean {
  const isOther = ['isSkinnedMesh', 'isBatchedMesh'].some((kind) => kind in mesh);
  return !isOther && Object.keys(mesh.geometry.morphAttributes).length === 0;
}

/** Parts a geometry by charts; `undefined` where the charts of a side are not those of this geometry. */
export function part(geometry: BufferGeometry, sides: Sides): Parted | undefined {
  const own = trianglesOf(geometry);
  const corners = sides.map((charts) => charts && cornersOf(charts, own));
  if (sides.some((charts, side) => charts && !corners[side])) return undefined;
  const vertices = new PartedVertices(sides, geometry.attributes.position?.count ?? 0, own.length);
  const [front, back] = corners;
  const index = new Uint32Array(own.length);
  for (let i = 0; i < own.length; i++) index[i] = vertices.of(own[i], front?.[i] ?? -1, back?.[i] ?? -1);
  const { sources, chartVertices } = vertices.found();
  const attributes = Object.entries(geometry.attributes);
  return {
    attributes: Object.fromEntries(
      attributes.map(([name, all]) => [name, isOfCopies(all) ? all : gather(all, sources)]),
    ),
    index: new BufferAttribute(sources.length > 0xffff ? index : Uint16Array.from(index), 1),
    chartVertices,
  };
}

/** The vertices that a geometry is parted into: each has one source, and one vertex of each side's charts. */
class PartedVertices {
  /** Of each vertex of the front's charts, the back's and the geometry the first parted one that has it. */
  readonly #first: Int32Array;
  /** Of each parted vertex the next one with the same such vertex. */
  readonly #next: Int32Array;
  readonly #sources: Uint32Array;
  readonly #fronts: Int32Array;
  readonly #backs: Int32Array;
  readonly #offsets: readonly [back: number, source: number];
  #count = 0;

  /** `most`: how many there may be. */
  constructor([front, back]: Sides, vertices: number, most: number) {
    const ofBack = front?.sources.length ?? 0;
    const ofSource = ofBack + (back?.sources.length ?? 0);
    this.#offsets = [ofBack, ofSource];
    this.#first = new Int32Array(ofSource + vertices).fill(-1);
    this.#next = new Int32Array(most);
    this.#sources = new Uint32Array(most);
    this.#fronts = new Int32Array(most);
    this.#backs = new Int32Array(most);
  }

  /** The number of the one that has these; −1 is no vertex of a side's charts. */
  of(source: number, front: number, back: number): number {
    const [ofBack, ofSource] = this.#offsets;
    // Charts' vertices know their source.
    const at = front >= 0 ? front : back >= 0 ? ofBack + back : ofSource + source;
    for (let known = this.#first[at]; known >= 0; known = this.#next[known]) {
      if (this.#backs[known] === back) return known;
    }
    const made = this.#count++;
    this.#sources[made] = source;
    this.#fronts[made] = front;
    this.#backs[made] = back;
    this.#next[made] = this.#first[at];
    this.#first[at] = made;
    return made;
  }

  found(): { readonly sources: Uint32Array; readonly chartVertices: Parted['chartVertices'] } {
    const count = this.#count;
    return {
      sources: this.#sources.slice(0, count),
      chartVertices: [this.#fronts.slice(0, count), this.#backs.slice(0, count)],
    };
  }
}

/** Three vertices a triangle. */
function trianglesOf({ index, attributes }: BufferGeometry): TypedArray {
  return index?.array ?? Uint32Array.from({ length: attributes.position?.count ?? 0 }, (_, i) => i);
}

/**
 * Of each corner of a geometry's triangles the charts' vertex, or −1; `undefined` where the charts are not of
 * as many triangles, each with its own vertices. GLTFLoader begins triangles of strips and fans at other
 * corners than glTF, and leaves corners that make no whole triangle at the end.
 */
function cornersOf({ triangles, sources }: Charts, own: TypedArray): Int32Array | undefined {
  const whole = own.length - (own.length % 3);
  if (triangles.length !== whole) return undefined;
  const corners = new Int32Array(own.length).fill(-1);
  for (let first = 0; first < whole; first += 3) {
    if (triangles[first] < 0) continue;
    let turn = 0;
    while (turn < 3 && !isTurned(triangles, sources, own, first, turn)) turn++;
    if (turn === 3) return undefined;
    for (let k = 0; k < 3; k++) corners[first + ((k + turn) % 3)] = triangles[first + k];
  }
  return corners;
}

/** Whether a triangle of charts is the geometry's, so many corners further on. */
function isTurned(
  triangles: Charts['triangles'],
  sources: Charts['sources'],
  own: TypedArray,
  first: number,
  turn: number,
): boolean {
  for (let k = 0; k < 3; k++)
    if (sources[triangles[first + k]] !== own[first + ((k + turn) % 3)]) return false;
  return true;
}

/** Whether an attribute has values of copies rather than of vertices. */
function isOfCopies(attribute: Attribute): boolean {
  if ('data' in attribute) return 'isInstancedInterleavedBuffer' in attribute.data;
  return 'isInstancedBufferAttribute' in attribute;
}

/** The values of these vertices. */
function gather(all: Attribute, sources: Uint32Array): BufferAttribute {
  const { itemSize, normalized } = all;
  const isInterleaved = 'data' in all;
  const stride = isInterleaved ? all.data.stride : itemSize;
  const offset = isInterleaved ? all.offset : 0;
  const from = all.array;
  const array = new (from.constructor as new (length: number) => TypedArray)(sources.length * itemSize);
  for (let vertex = 0; vertex < sources.length; vertex++) {
    const first = offset + sources[vertex] * stride;
    for (let k = 0; k < itemSize; k++) array[vertex * itemSize + k] = from[first + k];
  }
  const gathered = new BufferAttribute(array, itemSize, normalized);
  if (!isInterleaved) gathered.gpuType = all.gpuType;
  return gathered;
}

/** Of each rectangle of a side's charts its first lumel in the pages' texture. */
export type Corners = readonly (readonly [x: number, y: number])[];

/** The attribute {@link LUMELS}: charts put onto their rectangles. */
export function lumelsAttribute(
  { chartVertices }: Parted,
  sides: Sides,
  corners: readonly [front: Corners, back: Corners],
): BufferAttribute {
  const itemSize = sides[1] ? 4 : 2;
  const count = chartVertices[0].length;
  const array = new Float32Array(count * itemSize).fill(NO_LUMELS);
  sides.forEach((charts, side) => {
    if (!charts) return;
    const { at, rectangle } = charts;
    for (let vertex = 0; vertex < count; vertex++) {
      const chartVertex = chartVertices[side][vertex];
      if (chartVertex < 0) continue;
      const [x, y] = corners[side][rectangle[chartVertex]];
      const first = vertex * itemSize + 2 * side;
      array[first] = FIRST + x + at[2 * chartVertex];
      array[first + 1] = FIRST + y + at[2 * chartVertex + 1];
    }
  });
  return new BufferAttribute(array, itemSize);
}

/**
 * A geometry that stands in for another: parted, and with lumels. What it is made of may be shared. With
 * `copies`, what {@link LUMEL_CORNER} tells of each, it is for an InstancedMesh.
 */
export function chartedGeometry(
  original: BufferGeometry,
  { attributes, index }: Parted,
  lumels: BufferAttribute,
  share = 1,
  copies?: Float32Array,
): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.name = original.name;
  geometry.userData = original.userData;
  for (const [name, attribute] of Object.entries(attributes)) geometry.setAttribute(name, attribute);
  geometry.setAttribute(LUMELS, lumels);
  if (copies) setCopies(geometry, copies, share);
  else geometry.setAttribute(LUMEL_SHARE, new InstancedBufferAttribute(Float32Array.of(share), 1));
  geometry.setIndex(index);
  // Triangles keep their order, and so does what counts them.
  for (const { start, count, materialIndex } of original.groups)
    geometry.addGroup(start, count, materialIndex);
  geometry.setDrawRange(original.drawRange.start, original.drawRange.count);
  if (!original.boundingBox) original.computeBoundingBox();
  if (!original.boundingSphere) original.computeBoundingSphere();
  geometry.boundingBox = original.boundingBox;
  geometry.boundingSphere = original.boundingSphere;
  originals.set(geometry, original);
  return geometry;
}

/** Corners and shares of copies lie in one buffer: WebGPU allows eight a geometry. */
function setCopies(geometry: BufferGeometry, corners: Float32Array, share: number): void {
  const count = corners.length / 4;
  const array = new Float32Array(5 * count);
  for (let copy = 0; copy < count; copy++) {
    array.set(corners.subarray(4 * copy, 4 * copy + 4), 5 * copy);
    array[5 * copy + 4] = share;
  }
  const buffer = new InstancedInterleavedBuffer(array, 5);
  geometry.setAttribute(LUMEL_CORNER, new InterleavedBufferAttribute(buffer, 4, 0));
  geometry.setAttribute(LUMEL_SHARE, new InterleavedBufferAttribute(buffer, 1, 4));
}

/** Sets how much of a geometry's diffuse light its lumels make. */
export function setLumelShare(geometry: BufferGeometry, share: number): void {
  const attribute = geometry.getAttribute(LUMEL_SHARE);
  // As it is stored.
  if (attribute.getX(0) === Math.fround(share)) return;
  for (let copy = 0; copy < attribute.count; copy++) attribute.setX(copy, share);
  attribute.needsUpdate = true;
}

/** What a geometry does not share with others of the same charts. */
const OWN: readonly string[] = [LUMELS, LUMEL_SHARE, LUMEL_CORNER];

/** Frees what a geometry alone has; what it shares stays for the others. */
export function disposeCharted(geometry: BufferGeometry, isLast: boolean): void {
  if (!isLast) {
    geometry.setIndex(null);
    for (const name of Object.keys(geometry.attributes)) {
      if (!OWN.includes(name)) geometry.deleteAttribute(name);
    }
  }
  geometry.dispose();
}
