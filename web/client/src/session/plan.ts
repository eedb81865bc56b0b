import type { Catalog, Field, Grid, Region } from '../codec/catalog.js';
import { lightPriority, lightTrack, TURN_PRIORITY } from '../codec/tracks.js';
import type { Vec3, Vec4 } from '../edit.js';
import type { Turns } from './turns.js';

/**
 * Tracks read at once. Each takes a stream, and a peer allows about 100: past this, far regions lose
 * their upper layers, then all do, then far ones take turns (see `Turns`).
 */
export const MOST_TRACKS = 80;

/** A track to read. */
export interface TrackPlan {
  readonly name: string;
  readonly field: number;
  readonly region: number;
  readonly layer: number;
  readonly priority: number;
}

/** The tracks of the regions' lowest layers, near regions first. */
export function lowestTracks(catalog: Catalog, camera: Vec3 | undefined): string[] {
  return byDistance(catalog, camera).map(({ field, region }) => lightTrack(field.id, region.id, 0));
}

/**
 * The tracks to read, most important first: layer 0 of all regions before layer 1 of any, since light
 * that is seldom renewed beats light that is not; within a layer near regions before far ones. Of regions
 * that take turns those that `turns` reads; only the track `turns.turn` goes before all of them.
 */
export function planTracks(
  catalog: Catalog,
  layers: number,
  camera: Vec3 | undefined,
  turns?: Pick<Turns, 'turn' | 'reads'>,
): TrackPlan[] {
  const regions = byDistance(catalog, camera);
  const plan: TrackPlan[] = [];
  for (let layer = 0; layer < layers; layer++) {
    // Tracks that are free between turns are for those who wait, not for upper layers.
    if (layer > 0 && regions.length >= MOST_TRACKS) break;
    regions.forEach(({ field, region }, rank) => {
      if (layer >= field.layers) return;
      const name = lightTrack(field.id, region.id, layer);
      if (turns && !turns.reads(name)) return;
      const priority = name === turns?.turn ? TURN_PRIORITY : lightPriority(layer, rank);
      plan.push({ name, field: field.id, region: region.id, layer, priority });
    });
  }
  return plan.slice(0, MOST_TRACKS);
}

function byDistance(catalog: Catalog, camera: Vec3 | undefined): { field: Field; region: Region }[] {
  return catalog.fields
    .flatMap((field) =>
      field.regions.map((region) => ({
        field,
        region,
        distance: camera ? distanceToRegion(field.grid, region, camera) : 0,
      })),
    )
    .sort((a, b) => a.distance - b.distance);
}

/** Metres from a point in the world to a region's box. */
export function distanceToRegion(grid: Grid, region: Region, point: Vec3): number {
  const local = rotateBack(grid.rotation, [0, 1, 2].map((i) => point[i] - grid.center[i]) as Vec3);
  let squared = 0;
  for (let axis = 0; axis < 3; axis++) {
    const cell = grid.size[axis] / grid.resolution[axis];
    const min = region.min[axis] * cell - grid.size[axis] / 2;
    const max = min + region.size[axis] * cell;
    squared += Math.max(min - local[axis], 0, local[axis] - max) ** 2;
  }
  return Math.sqrt(squared);
}

/** A vector turned by the inverse of a unit quaternion: v + 2w(u×v) + 2u×(u×v) with u = −xyz. */
function rotateBack([x, y, z, w]: Vec4, v: Vec3): Vec3 {
  const u: Vec3 = [-x, -y, -z];
  const t = cross(u, v).map((c) => 2 * c) as Vec3;
  const s = cross(u, t);
  return [v[0] + w * t[0] + s[0], v[1] + w * t[1] + s[1], v[2] + w * t[2] + s[2]];
}

function cross(a: Vec3, b: Vec3): Vec3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
