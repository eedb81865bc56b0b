import type { Catalog } from '../codec/catalog.js';
import { lightPriority, lightTrack, TURN_PRIORITY } from '../codec/tracks.js';
import type { Vec3 } from '../edit.js';
import { type PlannedRegion, regionsOf } from './regions.js';
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
  return byDistance(catalog, camera).map(({ field, region }) => lightTrack(field, region, 0));
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
    regions.forEach(({ field, region, layers: most }, rank) => {
      if (layer >= most) return;
      const name = lightTrack(field, region, layer);
      if (turns && !turns.reads(name)) return;
      const priority = name === turns?.turn ? TURN_PRIORITY : lightPriority(layer, rank);
      plan.push({ name, field, region, layer, priority });
    });
  }
  return plan.slice(0, MOST_TRACKS);
}

function byDistance(catalog: Catalog, camera: Vec3 | undefined): PlannedRegion[] {
  return catalog.fields.flatMap((field) => regionsOf(field, camera)).sort((a, b) => a.distance - b.distance);
}
