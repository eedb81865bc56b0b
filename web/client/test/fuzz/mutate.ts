/** Mutations of bytes, the same for the same number: the twin of `fuzz/src/mutate.rs`, and more of JSON. */

/** Random numbers: SplitMix64. */
export class Random {
  private state: bigint;

  constructor(seed: number) {
    this.state = BigInt(seed);
  }

  /** A whole number below `end`, which is at least 1. */
  below(end: number): number {
    this.state = BigInt.asUintN(64, this.state + 0x9e3779b97f4a7c15n);
    let z = this.state;
    z = BigInt.asUintN(64, (z ^ (z >> 30n)) * 0xbf58476d1ce4e5b9n);
    z = BigInt.asUintN(64, (z ^ (z >> 27n)) * 0x94d049bb133111ebn);
    return Number((z ^ (z >> 31n)) % BigInt(end));
  }

  /** One of some. */
  of<T>(some: readonly T[]): T {
    return some[this.below(some.length)];
  }
}

/** Bytes in which a frame says what it is. */
const HEAD = 40;
/** Deeper than a stack is. */
const DEPTH = 20_000;

/** What decoders like least, as bytes and in JSON; the last ones are JavaScript's own. */
const TOKENS: readonly Uint8Array[] = [
  ...['0', '-1', '0.5', '1e39', '1e308', '-1e-320', '4294967296', '9007199254740992', '18446744073709551616'],
  ...['null', '[]', '{}', '""', '\xff\xff\xff\xff', '\0\0\0\0', '\n'],
  ...[
    '-0',
    '1e999',
    '262144',
    '"__proto__"',
    '"constructor"',
    '"\\ud800"',
    '['.repeat(DEPTH) + ']'.repeat(DEPTH),
  ],
].map((token) => Uint8Array.from(Buffer.from(token, 'latin1')));

/**
 * One to four changes of a seed: bytes turned, cut out, doubled, numbers and texts exchanged, parts of
 * another seed put in.
 */
export function mutated(seed: Uint8Array, other: Uint8Array, random: Random): Uint8Array {
  let bytes = seed;
  for (let left = 1 + random.below(4); left > 0; left--) {
    // Half of the changes are in the head.
    const at = random.below(Math.min(random.of([HEAD, Infinity]), bytes.length + 1));
    const end = Math.min(at + random.below(16), bytes.length);
    switch (random.below(7)) {
      case 0:
        bytes = spliced(bytes, at, at + 1, [bytes[at] ^ (1 << random.below(8))]);
        break;
      case 1:
        bytes = spliced(bytes, at, at + 1, [random.below(256)]);
        break;
      case 2:
        bytes = spliced(bytes, at, end, []);
        break;
      case 3:
        bytes = spliced(bytes, at, at, bytes.subarray(at, end));
        break;
      case 4:
        bytes = spliced(bytes, at, at, random.of(TOKENS));
        break;
      case 5:
        bytes = spliced(bytes, ...nextValue(bytes, at), random.of(TOKENS));
        break;
      default: {
        const from = random.below(other.length + 1);
        bytes = spliced(bytes, at, end, other.subarray(from, from + random.below(200)));
      }
    }
  }
  return bytes;
}

function spliced(bytes: Uint8Array, from: number, to: number, part: ArrayLike<number>): Uint8Array {
  const [before, after] = [bytes.subarray(0, from), bytes.subarray(to)];
  const whole = new Uint8Array(before.length + part.length + after.length);
  whole.set(before);
  whole.set(part, before.length);
  whole.set(after, before.length + part.length);
  return whole;
}

const QUOTE = 0x22;

/** Where the next number in digits or text in quotes is. */
function nextValue(bytes: Uint8Array, from: number): [start: number, end: number] {
  const isDigit = (byte: number) => (byte >= 0x30 && byte <= 0x39) || byte === 0x2d || byte === 0x2e;
  let start = from;
  while (start < bytes.length && !isDigit(bytes[start]) && bytes[start] !== QUOTE) start++;
  if (bytes[start] === QUOTE) {
    const close = bytes.indexOf(QUOTE, start + 1);
    return [start, close < 0 ? start : close + 1];
  }
  let end = start;
  while (end < bytes.length && isDigit(bytes[end])) end++;
  return [start, end];
}
