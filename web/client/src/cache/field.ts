/** The light of one field: what the cache asks of any kind. */
import type { FieldLight } from '../api.js';
import type { FieldInfo } from '../codec/catalog.js';
import type { LightHead } from '../codec/frame-head.js';

/** A frame that came. */
export interface Arrival {
  readonly head: LightHead;
  readonly arrived: number;
}

/** What became of a frame that was taken in. */
export interface Received {
  /** The frame's head. */
  readonly head: LightHead;
  /** Whether it is newer than what its region had. Older ones are not shown, but later ones may build on them. */
  readonly news: boolean;
}

/** Told when newer light of a region can be shown. */
export type OnLight = (region: number, head: LightHead) => void;

/** The light of one field of some kind: decodes its regions and blends each in time. */
export interface FieldCache {
  /** What the newest catalog says of the field. May be replaced by a field of the same shape. */
  field: FieldInfo;
  /** Whether the field has a region. */
  has(region: number): boolean;
  /** Whether any region has light. */
  readonly lit: boolean;
  /** Forgets updates, which are numbered anew after a restart of the server; what is shown stays. */
  forgetUpdates(): void;
  /**
   * Takes in a frame of the track of a layer of a region that this field has. A frame's head is read at
   * once; `tickSeconds` is the length of its server's ticks. Its light may be there later, if a decoder takes its time: `onLight` is called when it is.
   * @throws WireError; nothing has changed then.
   */
  add(region: number, layer: number, frame: Uint8Array, now: number, tickSeconds: number): Received;
  /** Of the regions' newest light the oldest and the newest. */
  span(): { readonly oldest: Arrival; readonly newest: Arrival } | undefined;
  /** The light at `now`; `undefined` when no region has any. `ageOf` tells the age of a tick's light. */
  light(now: number, ageOf: (tick: number, arrived: number) => number | undefined): FieldLight | undefined;
}
