/** Frames of lightmaps that are coded as video (docs/wire.md). */
import { WireError } from '../wire-error.js';
import { type FrameHead, splitFrame } from './frame-head.js';

/** All of a video frame but its access unit. */
export interface VideoHeader extends FrameHead {
  /** log2 of what irradiance over the scale is multiplied by before its logarithm is taken, 0 to 32. */
  readonly toe: number;
  /** Powers of two that the codes 0 to 255 span, 1/8 to 31 7/8. */
  readonly octaves: number;
}

const MOST_TOE = 32;
/** Parts of a power of two in which they are told. */
const PARTS = 8;

/** Header and access unit of a video frame; the unit is empty where the page is that of the frame's base. */
export function splitVideoFrame(frame: Uint8Array): { header: VideoHeader; unit: Uint8Array } {
  const { head, reader } = splitFrame(frame);
  const toe = reader.u8();
  if (toe > MOST_TOE) throw new WireError('malformed', `a toe of ${toe}`);
  const range = reader.u8();
  if (range === 0) throw new WireError('malformed', 'a range of nothing');
  const unit = reader.rest();
  if (unit.length === 0 && head.base === undefined) {
    throw new WireError('malformed', 'a keyframe without a picture');
  }
  return { header: { ...head, toe, octaves: range / PARTS }, unit };
}
