/** Writes layouts and charts, from docs/wire.md apart from their readers. */
import { createHash } from 'node:crypto';

import { join, varint } from './probe-encoder.js';

/** Bytes and their name. */
export interface Resource {
  readonly hash: string;
  readonly bytes: Uint8Array;
}

export interface PlacedTriangle {
  readonly node: number;
  /** Charts of {@link triangle}. */
  readonly charts: Resource;
  readonly page?: number;
  readonly x?: number;
  readonly y?: number;
}

export function resource(bytes: Uint8Array): Resource {
  return { bytes, hash: createHash('sha256').update(bytes).digest('hex') };
}

function zigzag(value: number): number[] {
  return varint(value < 0 ? -2 * value - 1 : 2 * value);
}

/** Charts of one triangle in a rectangle of 4 lumels' height. */
export function triangle(width: number): Resource {
  const places = [
    [128, 128],
    [896, 128],
    [128, 896],
  ];
  const vertices = places.flatMap(([x, y], i) => {
    const [lastX, lastY] = places[i - 1] ?? [0, 0];
    return [...zigzag(i === 0 ? 0 : 1), 0, ...zigzag(x - lastX), ...zigzag(y - lastY)];
  });
  const corners = [1, ...zigzag(1), ...zigzag(2)];
  return resource(join([1, 1], varint(width), [4, 3], vertices, [1], corners));
}

/** A layout of such triangles, in ascending order of nodes. */
export function layoutOf(pageSize: number, pages: number, surfaces: readonly PlacedTriangle[]): Resource {
  const placed = surfaces.map(({ node, charts, page = 0, x = 0, y = 0 }) =>
    join(varint(node), [0, 0, 0], Buffer.from(charts.hash, 'hex'), [1], varint(page), varint(x), varint(y)),
  );
  return resource(join([1], varint(pageSize), varint(pages), varint(surfaces.length), ...placed));
}
