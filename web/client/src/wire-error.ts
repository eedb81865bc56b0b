/** What is wrong with bytes that came from outside: the words of `DecodeError::kind` in the Rust codec. */
export type WireErrorKind =
  /** It ends too early. */
  | 'truncated'
  /** It speaks another version of the wire format. */
  | 'version'
  /** It exceeds a limit of docs/wire.md. */
  | 'limit'
  /** It breaks a rule of docs/wire.md. */
  | 'malformed'
  /** Text that is not the JSON expected. */
  | 'json'
  /** A frame that is not of the size or order that the catalog says. */
  | 'mismatch'
  /** A delta whose base this decoder does not hold; a keyframe will mend it. */
  | 'missing_base';

/** Bytes that cannot be used. Whatever a decoder throws at bytes from outside is of this class. */
export class WireError extends Error {
  override readonly name = 'WireError';
  constructor(
    readonly kind: WireErrorKind,
    message: string,
  ) {
    super(message);
  }
}
