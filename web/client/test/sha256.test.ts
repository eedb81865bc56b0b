import { createHash } from 'node:crypto';
import { describe, expect, it } from 'vitest';

import { sha256 } from '../src/codec/sha256.js';
import { random } from './support/random.js';

describe('SHA-256', () => {
  // FIPS 180-4's examples, as NIST publishes them.
  it.each([
    ['abc', 'ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad'],
    [
      'abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq',
      '248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1',
    ],
    ['', 'e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855'],
  ])('of %j', (text, hash) => expect(sha256(new TextEncoder().encode(text))).toBe(hash));

  it('of a million times "a"', () => {
    const hash = 'cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0';
    expect(sha256(new Uint8Array(1_000_000).fill(0x61))).toBe(hash);
  });

  it('is that of Node at every length of the last block', () => {
    const next = random(1);
    for (let length = 0; length < 200; length++) {
      // A view amid other bytes.
      const bytes = Uint8Array.from({ length: length + 7 }, () => 256 * next()).subarray(3, length + 3);
      expect(sha256(bytes), `${length} bytes`).toBe(createHash('sha256').update(bytes).digest('hex'));
    }
  });
});
