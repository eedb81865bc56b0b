import type { FakeServer } from './fake-server.js';
import { join, varint } from './probe-encoder.js';

/** What a `.light` file keeps of its scene. */
export interface Kept {
  readonly edits?: readonly unknown[];
  readonly files?: Readonly<Record<string, Uint8Array>>;
}

/** A `.light` file of a server's next tick: the catalog, what is kept, and a keyframe of each region. */
export function lightFile(server: FakeServer, { edits, files = {} }: Kept = {}): Uint8Array {
  const utf8 = new TextEncoder();
  const kept = Object.entries(files).map(([name, bytes]) => {
    const encoded = utf8.encode(name);
    return record(3, varint(encoded.length), encoded, bytes);
  });
  const keyframes = server
    .step()
    .probes.map(({ bytes }, region) => record(1, varint(0), varint(region), bytes));
  const edited = edits ? [record(2, utf8.encode(JSON.stringify({ edits })))] : [];
  const records = [record(0, server.catalog), ...edited, ...kept, ...keyframes];
  return join(utf8.encode('LUMENCST'), [2], ...records);
}

/** A record of a `.light` file. */
export function record(kind: number, ...parts: (Uint8Array | number[])[]): Uint8Array {
  const body = join([kind], ...parts);
  return join(varint(body.length), body);
}
