/** SHA-256 (FIPS 180-4), since browsers offer theirs to secure pages alone. */

const WORDS = 64;
const BLOCK = 64;

/** Whether a number has no divisor but itself and 1. */
function isPrime(n: number): boolean {
  for (let divisor = 2; divisor * divisor <= n; divisor++) if (n % divisor === 0) return false;
  return true;
}

const primes = Array.from({ length: 312 }, (_, i) => i).filter((n) => n >= 2 && isPrime(n));
/** The first 32 binary digits of a number's fraction. */
const fraction = (value: number) => ((value - Math.floor(value)) * 2 ** 32) | 0;
/** Of the cube roots of the first 64 primes (4.2.2). */
const K = Int32Array.from(primes.slice(0, WORDS), (prime) => fraction(Math.cbrt(prime)));
/** Of the square roots of the first 8 primes (5.3.3). */
const INITIAL = Int32Array.from(primes.slice(0, 8), (prime) => fraction(Math.sqrt(prime)));

const schedule = new Int32Array(WORDS);

/** The SHA-256 of bytes, in lower-case hexadecimal digits. */
export function sha256(bytes: Uint8Array): string {
  const hash = INITIAL.slice();
  const whole = bytes.length - (bytes.length % BLOCK);
  for (let at = 0; at < whole; at += BLOCK) digest(hash, bytes, at);
  const end = padded(bytes.subarray(whole), bytes.length);
  for (let at = 0; at < end.length; at += BLOCK) digest(hash, end, at);
  return Array.from(hash, (word) => (word >>> 0).toString(16).padStart(8, '0')).join('');
}

/** The bytes of the last block and their padding: a 1, zeros, and the number of bits in all (5.1.1). */
function padded(last: Uint8Array, length: number): Uint8Array {
  const end = new Uint8Array(last.length < BLOCK - 8 ? BLOCK : 2 * BLOCK);
  end.set(last);
  end[last.length] = 0x80;
  const view = new DataView(end.buffer);
  view.setUint32(end.length - 8, Math.floor(length / 2 ** 29));
  view.setUint32(end.length - 4, length * 8);
  return end;
}

/** Takes a block in (6.2.2). */
function digest(hash: Int32Array, bytes: Uint8Array, at: number): void {
  const w = schedule;
  for (let t = 0; t < 16; t++, at += 4) {
    w[t] = (bytes[at] << 24) | (bytes[at + 1] << 16) | (bytes[at + 2] << 8) | bytes[at + 3];
  }
  for (let t = 16; t < WORDS; t++) {
    const early = w[t - 15];
    const late = w[t - 2];
    const s0 = turned(early, 7) ^ turned(early, 18) ^ (early >>> 3);
    const s1 = turned(late, 17) ^ turned(late, 19) ^ (late >>> 10);
    w[t] = s1 + w[t - 7] + s0 + w[t - 16];
  }
  let [a, b, c, d] = [hash[0], hash[1], hash[2], hash[3]];
  let [e, f, g, h] = [hash[4], hash[5], hash[6], hash[7]];
  for (let t = 0; t < WORDS; t++) {
    const s1 = turned(e, 6) ^ turned(e, 11) ^ turned(e, 25);
    const t1 = (h + s1 + ((e & f) ^ (~e & g)) + K[t] + w[t]) | 0;
    const s0 = turned(a, 2) ^ turned(a, 13) ^ turned(a, 22);
    const t2 = (s0 + ((a & b) ^ (a & c) ^ (b & c))) | 0;
    h = g;
    g = f;
    f = e;
    e = (d + t1) | 0;
    d = c;
    c = b;
    b = a;
    a = (t1 + t2) | 0;
  }
  hash[0] += a;
  hash[1] += b;
  hash[2] += c;
  hash[3] += d;
  hash[4] += e;
  hash[5] += f;
  hash[6] += g;
  hash[7] += h;
}

/** Turns a word right. */
function turned(word: number, bits: number): number {
  return (word >>> bits) | (word << (32 - bits));
}
