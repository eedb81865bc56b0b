/** Writes what `RangeDecoder` reads; for tests that need frames of their own. */
const MARGIN = 32;
const UNARY = 14;

export class RangeEncoder {
  private low = 0n;
  private range = 0xffff_ffff;
  private cache = 0;
  private pending = 1;
  private readonly out: number[] = [];
  private readonly zero = new Map<number, number>();
  private readonly seen = new Map<number, number>();

  bit(context: number, bit: boolean): void {
    const p = this.zero.get(context) ?? 1 << 15;
    const n = this.seen.get(context) ?? 0;
    const bound = (this.range >>> 16) * p;
    if (bit) {
      this.low += BigInt(bound);
      this.range -= bound;
      this.zero.set(context, p - ((p - MARGIN) >> (n + 1)));
    } else {
      this.range = bound;
      this.zero.set(context, p + ((65536 - MARGIN - p) >> (n + 1)));
    }
    this.seen.set(context, Math.min(n + 1, 5));
    this.normalise();
  }

  evenBit(bit: boolean): void {
    this.range = Math.floor(this.range / 2);
    if (bit) this.low += BigInt(this.range);
    this.normalise();
  }

  signed(context: number, value: number): void {
    this.bit(context, value !== 0);
    if (value === 0) return;
    this.bit(context + 1, value < 0);
    const rest = Math.abs(value) - 1;
    for (let j = 0; j < UNARY; j++) {
      this.bit(context + 2 + j, j < rest);
      if (j >= rest) return;
    }
    const golomb = rest - UNARY + 1;
    const bits = 31 - Math.clz32(golomb);
    for (let i = 0; i < bits; i++) this.evenBit(true);
    this.evenBit(false);
    for (let i = bits - 1; i >= 0; i--) this.evenBit(((golomb >> i) & 1) === 1);
  }

  finish(): Uint8Array {
    for (let i = 0; i < 5; i++) this.shift();
    let end = this.out.length;
    while (end > 0 && end > this.out.length - 64 && this.out[end - 1] === 0) end--;
    return Uint8Array.from(this.out.slice(0, end));
  }

  private normalise(): void {
    while (this.range < 2 ** 24) {
      this.shift();
      this.range *= 256;
    }
  }

  private shift(): void {
    if (this.low < 0xff00_0000n || this.low > 0xffff_ffffn) {
      const carry = Number(this.low >> 32n);
      this.out.push((this.cache + carry) & 0xff);
      for (; this.pending > 1; this.pending--) this.out.push((0xff + carry) & 0xff);
      this.cache = Number((this.low >> 24n) & 0xffn);
      this.pending = 0;
    }
    this.pending++;
    this.low = (this.low & 0xff_ffffn) << 8n;
  }
}
