import { WireError } from '../wire-error.js';
import { type Catalog, parseCatalog } from './catalog.js';
import { LIMITS } from './limits.js';
import { splitProbeFrame } from './probe-header.js';
import { Reader } from './reader.js';

/** A saved light field: a catalog and keyframes, the same bytes as on the wire. */
export interface LightFile {
  readonly catalog: Catalog;
  readonly frames: readonly { readonly field: number; readonly region: number; readonly frame: Uint8Array }[];
}

const MAGIC = new TextEncoder().encode('LUMENCST');
const VERSION = 1;

/** Reads a `.light` file. The frames are views of `bytes`; their payloads are not decoded yet. */
export function readLightFile(bytes: Uint8Array): LightFile {
  if (bytes.length > LIMITS.fileBytes) throw new WireError('limit', `a file of ${bytes.length} bytes`);
  const reader = new Reader(bytes);
  const magic = reader.take(MAGIC.length);
  if (magic.some((byte, i) => byte !== MAGIC[i])) throw new WireError('malformed', 'not a light file');
  const version = reader.u8();
  if (version !== VERSION) throw new WireError('version', `a light file of version ${version}`);
  const catalog = parseCatalog(record(reader));
  const frames = [];
  while (reader.left > 0) {
    const entry = new Reader(record(reader));
    const [field, region] = [entry.varint(), entry.varint()];
    const frame = entry.rest();
    if (splitProbeFrame(frame).header.base !== undefined) {
      throw new WireError('malformed', 'a delta in a light file');
    }
    frames.push({ field, region, frame });
  }
  return { catalog, frames };
}

function record(reader: Reader): Uint8Array {
  return reader.take(reader.varint());
}
