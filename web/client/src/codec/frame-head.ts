/** What frames of light begin with, whatever the kind of their field (docs/wire.md, "Probe frames"). */
import { WireError } from '../wire-error.js';
import { LIMITS } from './limits.js';
import { Reader } from './reader.js';

/** What a frame of light says of its update. */
export interface LightHead {
  /** Number u of the update. */
  readonly update: number;
  /** Version of the scene that this light was computed from. */
  readonly sceneVersion: number;
  /** Server tick in which it was computed. */
  readonly tick: number;
  /** Scene time of that tick, seconds. */
  readonly time: number;
}

/** All that frames of light have in common. */
export interface FrameHead extends LightHead {
  /** The update that a delta changes; `undefined` in a keyframe. */
  readonly base: number | undefined;
  /** The power of two that half floats are divided by. */
  readonly scale: number;
}

const VERSION = 1;
const KEYFRAME = 1;

/** The head of a frame of light, and a reader of what follows it. */
export function splitFrame(frame: Uint8Array): { head: FrameHead; reader: Reader } {
  if (frame.length > LIMITS.frameBytes) throw new WireError('limit', `a frame of ${frame.length} bytes`);
  const reader = new Reader(frame);
  const version = reader.u8();
  if (version !== VERSION) throw new WireError('version', `a frame of light of version ${version}`);
  const flags = reader.u8();
  if (flags & ~KEYFRAME) throw new WireError('malformed', 'unknown flags');
  const update = reader.varint();
  const base = baseOf(update, reader.varint(), (flags & KEYFRAME) !== 0);
  const sceneVersion = reader.varint();
  const tick = reader.varint();
  const time = reader.f64();
  if (!Number.isFinite(time)) throw new WireError('malformed', 'time is not finite');
  const scale = 2 ** reader.i8();
  return { head: { update, base, sceneVersion, tick, time, scale }, reader };
}

function baseOf(update: number, distance: number, keyframe: boolean): number | undefined {
  if (keyframe) {
    if (distance !== 0) throw new WireError('malformed', 'a keyframe with a base');
    return undefined;
  }
  if (distance < 1 || distance > 255 || distance > update) {
    throw new WireError('malformed', `distance ${distance} to the base`);
  }
  return update - distance;
}
