/** The light of one field: what the cache asks of any kind. */
import type { FieldLight } from '../api.js';
import type { FieldInfo } from '../codec/catalog.js';
import type { LightHead } from '../codec/frame-head.js';
import type { LightmapLayout } from '../codec/layout.js';
import type { LightmapShape } from '../codec/lightmap-shape.js';
import type { OpenDecoder } from './picture-decoder.js';

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

/** The age of a tick's light that came at a time; `undefined` where nobody knows. */
export type AgeOf = (tick: number, arrived: number) => number | undefined;

/** What a field's cache is given besides its field. */
export interface Surroundings {
  readonly onLight: OnLight;
  /** Called after `onLight` where no call of the cache is under way: a decoder took its time. */
  readonly onLate: () => void;
  /** The layout of a lightmap, where that is known and of its pages. */
  readonly layoutOf: (shape: LightmapShape) => LightmapLayout | undefined;
  /** Opens decoders of video; absent where there are none. */
  readonly openDecoder: OpenDecoder | undefined;
}

/** The light of one field of some kind: decodes its regions and blends each in time. */
export interface FieldCache {
  /** What the newest catalog says of the field. May be replaced by a field that is coded alike. */
  field: FieldInfo;
  /** Whether the field has a region. */
  has(region: number): boolean;
  /** Whether any region has light. */
  readonly lit: boolean;
  /** Forgets updates, which are numbered anew after a restart of the server; what is shown stays. */
  forgetUpdates(): void;
  /**
   * Takes in a frame of the track of a layer of a region that this field has. A frame's head is read at
   * once; `tickSeconds` is the length of its server's ticks. Its light may be there later, if a decoder
   * takes its time: `onLight` is called when it is.
   * @throws WireError; nothing has changed then.
   */
  add(region: number, layer: number, frame: Uint8Array, now: number, tickSeconds: number): Received;
  /** Of the regions' newest light the oldest and the newest. */
  span(): { readonly oldest: Arrival; readonly newest: Arrival } | undefined;
  /** The light at `now`; `undefined` when no region has any. */
  light(now: number, ageOf: AgeOf): FieldLight | undefined;
  /** Takes what is known of the resources that its shape names: those of another shape may take their place. */
  keepResources(): void;
  /** Gives back what decoders hold; what is shown stays, and no frame comes any more. */
  close(): void;
}
