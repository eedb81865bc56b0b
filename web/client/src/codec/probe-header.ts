import type { Vec3 } from '../edit.js';
import { WireError } from '../wire-error.js';
import { type FrameHead, splitFrame } from './frame-head.js';
import { LIMITS } from './limits.js';

/** All of a probe frame but its payload. */
export interface ProbeHeader extends FrameHead {
  /** 1 to 4. */
  readonly order: number;
  /** Cells of the region along x, y, z, each 1 to 16. */
  readonly size: Vec3;
}

/** The temporal layer of an update: 0 for every fourth, 1 for the other even ones, 2 for the odd. */
export function layerOf(update: number): 0 | 1 | 2 {
  return update % 4 === 0 ? 0 : update % 2 === 0 ? 1 : 2;
}

/** Header and payload of a probe frame. */
export function splitProbeFrame(frame: Uint8Array): { header: ProbeHeader; payload: Uint8Array } {
  const { head, reader } = splitFrame(frame);
  const { update, base } = head;
  if (base !== undefined && layerOf(base) > layerOf(update)) {
    throw new WireError('malformed', 'a base in a higher layer');
  }
  const order = reader.u8();
  if (order < 1 || order > 4) throw new WireError('malformed', `order ${order}`);
  const size: Vec3 = [...reader.take(3)] as Vec3;
  if (Math.min(...size) === 0) throw new WireError('malformed', 'an empty region');
  if (Math.max(...size) > LIMITS.regionCells) throw new WireError('limit', `a region of ${size} cells`);
  return { header: { ...head, order, size }, payload: reader.rest() };
}
