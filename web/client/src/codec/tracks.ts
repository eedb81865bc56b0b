/** Names and priorities of all tracks; see docs/wire.md. Priorities are 0 to 255, the highest goes first. */

/** The track of a client's own broadcast that its edits go by. */
export const EDITS_TRACK = 'edits';

/** The tracks of a scene that are always read. */
export const CATALOG_TRACK = { name: 'catalog', priority: 255 } as const;
export const STATE_TRACK = { name: 'state', priority: 254 } as const;

/**
 * The track of a temporal layer of a region. A *region* of a field, of whatever kind, is what is coded and
 * sent as one frame. The field's kind says which regions there are: of a volume they are boxes of cells.
 */
export function lightTrack(field: number, region: number, layer: number): string {
  return `f${field}/r${region}/l${layer}`;
}

/** Regions of different priority in each layer; those farther away share the last. */
const RANKS = 80;

/** The priority of light: layer 0 of all regions before layer 1 of any. `rank`: 0 for the nearest region. */
export function lightPriority(layer: number, rank: number): number {
  return STATE_TRACK.priority - 4 - RANKS * layer - Math.min(rank, RANKS - 1);
}

/** Priority of the lowest layer of a region that has its turn: before all other light. */
export const TURN_PRIORITY = STATE_TRACK.priority - 2;
