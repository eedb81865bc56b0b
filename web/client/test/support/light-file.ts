import type { FakeServer } from './fake-server.js';
import { join, varint } from './probe-encoder.js';

/** A `.light` file of a server's next tick: the catalog and a keyframe of each region. */
export function lightFile(server: FakeServer): Uint8Array {
  const record = (bytes: Uint8Array) => join(varint(bytes.length), bytes);
  const frames = server
    .step()
    .probes.map(({ bytes }, region) => record(join(varint(0), varint(region), bytes)));
  return join(new TextEncoder().encode('LUMENCST'), [1], record(server.catalog), ...frames);
}
