/**
 * Geometries whose vertices are parted where charts are, so that each knows where its lumels lie. A still
 * mesh shows such a geometry in place of its own.
 */
import type { Charts } from '@lumencast/client';
import {
  BufferAttribute,
  BufferGeometry,
  type InterleavedBufferAttribute,
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

/** Charts of the two sides of a primitive. */
export type Sides = readonly [front: Charts | undefined, back: Charts | undefined];

/** What a geometry becomes by charts, wherever these lie on pages. */
export interface Parted {
  readonly attributes: Readonly<Record<string, BufferAttribute>>;
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

/** Whether a mesh may take light from lumels: one that neither deforms nor stands for several. */
export function canHaveLumels(mesh: Mesh): boolean {
  const isOther = ['isInstancedMesh', 'isSkinnedMesh', 'isBatchedMesh'].some((kind) => kind in mesh);
  return !isOther && Object.keys(mesh.geometry.morphAttributes).length === 0;
}

/** Parts a geometry by charts; `undefined` where the charts of a side are not those of this geometry. */
export function part(geometry: BufferGeometry, sides: Sides): Parted | undefined {
  const own = trianglesOf(geometry);
  if (!sides.every((charts) => charts === undefined || fits(charts, own))) return undefined;
  const [front, back] = sides;
  const index = new Uint32Array(own.length);
  const [sources, ofFronts, ofBacks]: number[][] = [[], [], []];
  const known = new Map<number, number>();
  // A vertex without lumels is known by its own number, others by their vertices of both sides' charts.
  const stride = (back?.sources.length ?? 0) + 1;
  for (let i = 0; i < own.length; i++) {
    const ofFront = front ? front.triangles[i] : -1;
    const ofBack = back ? back.triangles[i] : -1;
    const isBare = ofFront < 0 && ofBack < 0;
    const key = isBare ? -1 - own[i] : (ofFront + 1) * stride + ofBack + 1;
    let vertex = known.get(key);
    if (vertex === undefined) {
      vertex = sources.push(own[i]) - 1;
      ofFronts.push(ofFront);
      ofBacks.push(ofBack);
      known.set(key, vertex);
    }
    index[i] = vertex;
  }
  const attributes = Object.entries(geometry.attributes);
  return {
    attributes: Object.fromEntries(attributes.map(([name, all]) => [name, gather(all, sources)])),
    index: new BufferAttribute(sources.length > 0xffff ? index : Uint16Array.from(index), 1),
    chartVertices: [Int32Array.from(ofFronts), Int32Array.from(ofBacks)],
  };
}

/** Three vertices a triangle. */
function trianglesOf({ index, attributes }: BufferGeometry): TypedArray {
  return index?.array ?? Uint32Array.from({ length: attributes.position?.count ?? 0 }, (_, i) => i);
}

/** Whether charts are of as many triangles, each with its own vertices. */
function fits({ triangles, sources }: Charts, own: TypedArray): boolean {
  if (triangles.length !== own.length) return false;
  for (let i = 0; i < own.length; i++) {
    if (triangles[i] >= 0 && sources[triangles[i]] !== own[i]) return false;
  }
  return true;
}

/** The values of these vertices. */
function gather(
  all: BufferAttribute | InterleavedBufferAttribute,
  sources: readonly number[],
): BufferAttribute {
  const { itemSize, normalized } = all;
  const isInterleaved = 'data' in all;
  const stride = isInterleaved ? all.data.stride : itemSize;
  const offset = isInterleaved ? all.offset : 0;
  const from = all.array;
  const array = new (from.constructor as new (length: number) => TypedArray)(sources.length * itemSize);
  sources.forEach((source, vertex) => {
    const first = offset + source * stride;
    for (let k = 0; k < itemSize; k++) array[vertex * itemSize + k] = from[first + k];
  });
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
      const corner = corners[side][rectangle[chartVertex]];
      for (const axis of [0, 1]) {
        array[vertex * itemSize + 2 * side + axis] = FIRST + corner[axis] + at[2 * chartVertex + axis];
      }
    }
  });
  return new BufferAttribute(array, itemSize);
}

/** A geometry that stands in for another: parted, and with lumels. What it is made of may be shared. */
export function chartedGeometry(
  original: BufferGeometry,
  { attributes, index }: Parted,
  lumels: BufferAttribute,
): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.name = original.name;
  geometry.userData = original.userData;
  for (const [name, attribute] of Object.entries(attributes)) geometry.setAttribute(name, attribute);
  geometry.setAttribute(LUMELS, lumels);
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

/** Frees what a geometry alone has; what it shares stays for the others. */
export function disposeCharted(geometry: BufferGeometry, isLast: boolean): void {
  if (!isLast) {
    geometry.setIndex(null);
    for (const name of Object.keys(geometry.attributes)) if (name !== LUMELS) geometry.deleteAttribute(name);
  }
  geometry.dispose();
}
