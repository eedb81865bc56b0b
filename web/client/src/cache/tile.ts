/** One region of a lightmap: what the cache of one asks of any coding. */
import type { LumelRegion } from '../api.js';
import type { Arrival, Received } from './field.js';

export interface TileCache {
  readonly lit: boolean;
  /** The newest light that can be shown, of this run of the server. */
  readonly newest: Arrival | undefined;
  /** Takes in a frame; see `FieldCache.add`. */
  add(frame: Uint8Array, now: number, tickSeconds: number): Received;
  /** See `FieldCache.forgetUpdates`. */
  forgetUpdates(): void;
  /** The region at `now`; `undefined` before there is light. */
  at(now: number): LumelRegion | undefined;
  close(): void;
}
