/** What the plan of a session must know of the regions of fields: a table of their kinds. */
import type { FieldInfo, FieldKind, Shapes } from '../codec/catalog.js';
import { tileCount } from '../codec/lightmap-shape.js';
import type { Vec3 } from '../edit.js';
import { boxDistance } from './box.js';

/** A region of a field of any kind. */
export interface PlannedRegion {
  readonly field: number;
  readonly region: number;
  /** Temporal layers that it has. */
  readonly layers: number;
  /** Metres from the camera; 0 while nobody knows where that is. */
  readonly distance: number;
}

/** What a kind's shape says of its regions. */
interface RegionRules<Shape> {
  layers(shape: Shape): number;
  /** Each region's number, and how far it is from a point in the world, metres. */
  regions(shape: Shape): readonly { readonly id: number; distance(point: Vec3): number }[];
}

const RULES: { readonly [K in FieldKind]: RegionRules<Shapes[K]> } = {
  volume: {
    layers: ({ layers }) => layers,
    regions: ({ grid, regions }) =>
      regions.map((region) => ({ id: region.id, distance: (point) => boxDistance(grid, region, point) })),
  },
  lightmap: {
    layers: () => 1,
    // A shape does not say where in the world its surfaces are.
    regions: (shape) => Array.from({ length: tileCount(shape) }, (_, id) => ({ id, distance: () => 0 })),
  },
};

/** Temporal layers of a field. */
export function layersOf<K extends FieldKind>({ kind, shape }: FieldInfo<K>): number {
  return RULES[kind].layers(shape);
}

/** A field's regions, as seen from the camera. */
export function regionsOf<K extends FieldKind>(
  field: FieldInfo<K>,
  camera: Vec3 | undefined,
): PlannedRegion[] {
  const layers = layersOf(field);
  return RULES[field.kind].regions(field.shape).map(({ id, distance }) => ({
    field: field.id,
    region: id,
    layers,
    distance: camera ? distance(camera) : 0,
  }));
}
