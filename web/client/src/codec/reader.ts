import { WireError } from '../wire-error.js';

/** Reads little-endian numbers and varints (unsigned LEB128) from the front of bytes. */
export class Reader {
  private readonly view: DataView;
  position = 0;

  constructor(readonly bytes: Uint8Array) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  get left(): number {
    return this.bytes.length - this.position;
  }

  /** Moves on by `length` bytes and returns where they begin. */
  private skip(length: number): number {
    if (length > this.left) throw new WireError('truncated', 'the bytes end too early');
    const start = this.position;
    this.position += length;
    return start;
  }

  u8(): number {
    return this.bytes[this.skip(1)];
  }

  i8(): number {
    return this.view.getInt8(this.skip(1));
  }

  f64(): number {
    return this.view.getFloat64(this.skip(8), true);
  }

  /** A view of the next bytes, not a copy. */
  take(length: number): Uint8Array {
    const start = this.skip(length);
    return this.bytes.subarray(start, start + length);
  }

  /** All that is left. */
  rest(): Uint8Array {
    return this.take(this.left);
  }

  /** An integer below 2⁵³ in at most 8 bytes. */
  varint(): number {
    let value = 0;
    for (let factor = 1; factor < 2 ** 56; factor *= 128) {
      const byte = this.u8();
      value += (byte & 0x7f) * factor;
      if (byte < 0x80) {
        if (value > Number.MAX_SAFE_INTEGER) throw new WireError('malformed', 'a varint of 2^53 or more');
        return value;
      }
    }
    throw new WireError('malformed', 'a varint of more than 8 bytes');
  }

  /** A varint below 2³². */
  number(): number {
    const value = this.varint();
    if (value > 0xffff_ffff) throw new WireError('malformed', 'a number of 2^32 or more');
    return value;
  }

  /** A signed number: 0, −1, 1, −2, … as 0, 1, 2, 3, …. */
  zigzag(): number {
    return unzigzag(this.varint());
  }

  /**
   * How many things follow of so many bytes each, at least. What is allocated for them is bounded by the
   * bytes that are left.
   */
  count(bytesEach: number): number {
    const count = this.varint();
    if (count > Math.floor(this.left / bytesEach)) {
      throw new WireError('truncated', 'the bytes end too early');
    }
    return count;
  }
}

/** The signed number that a zigzag varint stands for. */
export function unzigzag(value: number): number {
  return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
}
