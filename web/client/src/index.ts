/** Version of the wire format that this client speaks; see docs/wire.md. */
export const WIRE_VERSION = 1;
