import type { Vec3 } from '../edit.js';
import { WireError } from '../wire-error.js';
import { LIMITS } from './limits.js';
import { Reader } from './reader.js';

/** What a frame of light says of itself, whatever the kind of its field. */
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

/** All of a probe frame but its payload. */
export interface ProbeHeader extends LightHead {
  /** The update that a delta changes; `undefined` in a keyframe. */
  readonly base: number | undefined;
  /** A power of two near the field's largest coefficient. */
  readonly scale: number;
  /** 1 to 4. */
  readonly order: number;
  /** Cells of the region along x, y, z, each 1 to 16. */
  readonly size: Vec3;
}

const VERSION = 1;
const KEYFRAME = 1;

/** The temporal layer of an update: 0 for every fourth, 1 for the other even ones, 2 for the odd. */
export function layerOf(update: number): 0 | 1 | 2 {
  return update % 4 === 0 ? 0 : update % 2 === 0 ? 1 : 2;
}

/** Header and payload of a probe frame. */
export function splitProbeFrame(frame: Uint8Array): { header: ProbeHeader; payload: Uint8Array } {
  if (frame.length > LIMITS.frameBytes) throw new WireError('limit', `a frame of ${frame.length} bytes`);
  const reader = new Reader(frame);
  const version = reader.u8();
  if (version !== VERSION) throw new WireError('version', `a probe frame of version ${version}`);
  const flags = reader.u8();
  if (flags & ~KEYFRAME) throw new WireError('malformed', 'unknown flags');
  const update = reader.varint();
  const base = baseOf(update, reader.varint(), (flags & KEYFRAME) !== 0);
  const sceneVersion = reader.varint();
  const tick = reader.varint();
  const time = reader.f64();
  if (!Number.isFinite(time)) throw new WireError('malformed', 'time is not finite');
  const scale = 2 ** reader.i8();
  const order = reader.u8();
  if (order < 1 || order > 4) throw new WireError('malformed', `order ${order}`);
  const size: Vec3 = [...reader.take(3)] as Vec3;
  if (Math.min(...size) === 0) throw new WireError('malformed', 'an empty region');
  if (Math.max(...size) > LIMITS.regionCells) throw new WireError('limit', `a region of ${size} cells`);
  return {
    header: { update, base, sceneVersion, tick, time, scale, order, size },
    payload: reader.rest(),
  };
}

function baseOf(update: number, distance: number, keyframe: boolean): number | undefined {
  if (keyframe) {
    if (distance !== 0) throw new WireError('malformed', 'a keyframe with a base');
    return undefined;
  }
  if (distance < 1 || distance > 255 || distance > update) {
    throw new WireError('malformed', `distance ${distance} to the base`);
  }
  const base = update - distance;
  if (layerOf(base) > layerOf(update)) throw new WireError('malformed', 'a base in a higher layer');
  return base;
}
