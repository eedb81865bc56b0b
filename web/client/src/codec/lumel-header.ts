import { WireError } from '../wire-error.js';
import { type FrameHead, splitFrame } from './frame-head.js';
import { LIMITS } from './limits.js';
import type { Reader } from './reader.js';

/** All of a lumel frame but its payload. */
export interface LumelHeader extends FrameHead {
  /** Lumels of the tile along x and y, each 1 to 256. */
  readonly size: readonly [number, number];
}

/** Header and payload of a lumel frame. */
export function splitLumelFrame(frame: Uint8Array): { header: LumelHeader; payload: Uint8Array } {
  const { head, reader } = splitFrame(frame);
  const size = [side(reader), side(reader)] as const;
  return { header: { ...head, size }, payload: reader.rest() };
}

function side(reader: Reader): number {
  const lumels = reader.varint();
  if (lumels > LIMITS.tileLumels) throw new WireError('limit', `a tile of ${lumels} lumels along a side`);
  if (lumels === 0) throw new WireError('malformed', 'an empty tile');
  return lumels;
}
