/**
 * The decoder of docs/wire.md, "Range coder": binary, adaptive, carry-less as in LZMA, with 16-bit
 * probabilities that adapt fast at first. The twin of `codec/src/range_coder.rs`.
 */

/** Zero bytes that may be read past the end of a payload. */
const IMPLICIT_ZEROS = 64;
/** A probability never comes nearer than this to 0 or 1 (of 65536). */
const MARGIN = 32;
const TOP = 2 ** 24;
/** Unary bits of a magnitude before its rest is coded as Exp-Golomb. */
const UNARY = 14;
/** Most leading ones of that Exp-Golomb code. */
const GOLOMB_ONES = 28;

/** Contexts of a signed number: whether it is 0, its sign, and the unary bits of its magnitude. */
export const SIGNED_CONTEXTS = 2 + UNARY;

/** Adaptive estimates of bits' probabilities, by number. */
export class Contexts {
  /** Probability of a 0, of 65536. */
  readonly zero: Uint16Array;
  /** Bits seen, up to 5: the step of adaptation goes from 1/2 to 1/64. */
  readonly seen: Uint8Array;

  constructor(count: number) {
    this.zero = new Uint16Array(count);
    this.seen = new Uint8Array(count);
    this.reset();
  }

  reset(): void {
    this.zero.fill(1 << 15);
    this.seen.fill(0);
  }
}

/** Reads bits. Reading past the end gives zeros; {@link overrun} tells when that went too far. */
export class RangeDecoder {
  /** Code and range: typed, so that 32-bit values are never boxed. */
  private readonly state = new Uint32Array([0, 0xffff_ffff]);
  private position = 0;

  constructor(
    private readonly payload: Uint8Array,
    private readonly contexts: Contexts,
  ) {
    for (let i = 1; i < 5; i++) this.state[0] = (this.state[0] << 8) | (payload[i] ?? 0);
    this.position = 5;
  }

  /** Whether the payload can be one: its first byte is 0. */
  get valid(): boolean {
    return (this.payload[0] ?? 0) === 0;
  }

  /** Whether more was read than there is. */
  get overrun(): boolean {
    return this.position > this.payload.length + IMPLICIT_ZEROS;
  }

  /** Whether all bytes were used. */
  get atEnd(): boolean {
    return this.position >= this.payload.length;
  }

  /** A bit of the probability that context `c` has learnt. */
  bit(c: number): 0 | 1 {
    const { zero, seen } = this.contexts;
    const state = this.state;
    const p = zero[c];
    const count = seen[c];
    const range = state[1];
    const bound = Math.imul(range >>> 16, p) >>> 0;
    let bit: 0 | 1;
    if (state[0] < bound) {
      state[1] = bound;
      zero[c] = p + ((65536 - MARGIN - p) >> (count + 1));
      bit = 0;
    } else {
      state[0] -= bound;
      state[1] = range - bound;
      zero[c] = p - ((p - MARGIN) >> (count + 1));
      bit = 1;
    }
    if (count < 5) seen[c] = count + 1;
    if (state[1] < TOP) this.normalise();
    return bit;
  }

  /** A bit of probability ½. */
  evenBit(): 0 | 1 {
    const state = this.state;
    state[1] >>>= 1;
    let bit: 0 | 1 = 0;
    if (state[0] >= state[1]) {
      state[0] -= state[1];
      bit = 1;
    }
    if (state[1] < TOP) this.normalise();
    return bit;
  }

  private normalise(): void {
    const state = this.state;
    while (state[1] < TOP) {
      state[1] <<= 8;
      const next = this.position < this.payload.length ? this.payload[this.position] : 0;
      state[0] = (state[0] << 8) | next;
      this.position++;
    }
  }

  /** A signed number by the context set from `c` on; NaN when it is longer than any encoder writes. */
  signed(c: number): number {
    if (!this.bit(c)) return 0;
    const negative = this.bit(c + 1);
    let magnitude = 0;
    while (magnitude < UNARY && this.bit(c + 2 + magnitude)) magnitude++;
    if (magnitude === UNARY) magnitude += this.golomb();
    return negative ? -magnitude - 1 : magnitude + 1;
  }

  /** Exp-Golomb of order 0: as many ones as value + 1 has bits after its first, a zero, those bits. */
  private golomb(): number {
    let bits = 0;
    while (this.evenBit()) if (++bits > GOLOMB_ONES) return NaN;
    let value = 1;
    for (; bits > 0; bits--) value = (value << 1) | this.evenBit();
    return value - 1;
  }
}
