/**
 * Residuals of lumels: how many bits the magnitude has, in unary, those bits below the first, the sign
 * (docs/wire.md, "Residuals"). The twin of `codec/src/lumel/residual.rs`.
 */
import type { RangeDecoder } from './range.js';

/** Bits of the largest magnitude: differences of differences of halves have 17. */
const MOST_BITS = 17;
/** Classes of how much a residual's neighbours differ from their predictions. */
const CLASSES = 12;

/** Where the contexts begin of the bit after the first, by the number of bits. Those of `more` come first. */
const SECOND = CLASSES * MOST_BITS;
/** Where those of the sign begin, by the signs of the residuals at west and north. */
const NEGATIVE = SECOND + MOST_BITS + 1;

/** Contexts of the residuals of one channel, or of two that are alike. */
export const RESIDUAL_CONTEXTS = NEGATIVE + 9;

/**
 * A residual by the context set from `set` on. `west` and `north` are the residuals of the same channel
 * there, `luma` is that of Y of the same lumel; 0 for Y itself.
 */
export function decodeResidual(
  coder: RangeDecoder,
  set: number,
  west: number,
  north: number,
  luma: number,
): number {
  const near = bitLength(Math.abs(west) + Math.abs(north) + Math.abs(luma));
  const more = set + (near < CLASSES ? near : CLASSES - 1) * MOST_BITS;
  let bits = 0;
  while (bits < MOST_BITS && coder.bit(more + bits)) bits++;
  if (bits === 0) return 0;
  let magnitude = 1;
  if (bits > 1) magnitude = 2 | coder.bit(set + SECOND + bits);
  for (let below = bits - 2; below > 0; below--) magnitude = (magnitude << 1) | coder.evenBit();
  const negative = coder.bit(set + NEGATIVE + 3 * (Math.sign(west) + 1) + Math.sign(north) + 1);
  return negative ? -magnitude : magnitude;
}

/** Binary digits of a number that is not negative; 0 has none. */
function bitLength(value: number): number {
  return 32 - Math.clz32(value);
}
