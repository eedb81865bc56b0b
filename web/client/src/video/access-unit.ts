/** What is read of access units of H.264 in Annex B, of which start codes tell the units. */

const SEQUENCE_PARAMETERS = 7;

/**
 * The codec of a keyframe as WebCodecs names it, `avc1.PPCCLL`: profile, constraints and level, which its
 * sequence parameters begin with (RFC 6381, 3.3). `undefined` where it has none.
 */
export function codecOf(unit: Uint8Array): string | undefined {
  for (let at = 0; at + 6 < unit.length; at++) {
    if (unit[at] !== 0 || unit[at + 1] !== 0 || unit[at + 2] !== 1) continue;
    if ((unit[at + 3] & 0x1f) !== SEQUENCE_PARAMETERS) continue;
    const named = Array.from(unit.subarray(at + 4, at + 7), (byte) => byte.toString(16).padStart(2, '0'));
    return `avc1.${named.join('')}`;
  }
  return undefined;
}
