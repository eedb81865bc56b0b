/** What all resources have in common (docs/wire.md, "Resources"). */
import { WireError } from '../wire-error.js';
import { LIMITS } from './limits.js';
import { Reader } from './reader.js';

/** Reads a resource of the version `known` after that, to its last byte. */
export function readResource<T>(bytes: Uint8Array, known: number, read: (reader: Reader) => T): T {
  if (bytes.length > LIMITS.resourceBytes) {
    throw new WireError('limit', `a resource of ${bytes.length} bytes`);
  }
  const reader = new Reader(bytes);
  const version = reader.varint();
  if (version !== known) throw new WireError('version', `a resource of version ${version}`);
  const value = read(reader);
  if (reader.left > 0) throw new WireError('malformed', 'bytes after the end');
  return value;
}
