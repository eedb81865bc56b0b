import { WireError } from '../wire-error.js';
import { halfValue } from './half.js';
import { type LumelHeader, splitLumelFrame } from './lumel-header.js';
import { decodeTile, TEXEL } from './lumel-model.js';

/** Light of a tile at one update. */
export interface TileLight {
  readonly header: LumelHeader;
  /**
   * r, g, b, 1 of each lumel as half floats, row after row: irradiance in lux over the header's scale. They
   * belong to the decoder, which overwrites them with the second frame after this one.
   */
  readonly texels: Uint16Array<ArrayBuffer>;
  /** Whether they, or the scale, are others than those of the newest update before. */
  readonly changed: boolean;
}

/** Scales up to which every half float is finite once it is multiplied, in 32 bits. */
const SAFE_SCALE = 2 ** 112;

/**
 * Decodes the frames of one tile of a lightmap. Holds the newest, which deltas refer to, and room for the
 * next: 16 bytes a lumel.
 */
export class LumelDecoder {
  private newest: { readonly update: number; readonly scale: number } | undefined;
  private texels: Uint16Array<ArrayBuffer>;
  private spare: Uint16Array<ArrayBuffer>;

  constructor(private readonly size: readonly [number, number]) {
    this.texels = new Uint16Array(TEXEL * size[0] * size[1]);
    this.spare = new Uint16Array(this.texels.length);
  }

  /**
   * Decodes a frame. Frames may come in any order and may be missing.
   * @throws WireError; the decoder is then as it was.
   */
  decode(frame: Uint8Array): TileLight {
    const { header, payload } = splitLumelFrame(frame);
    const { update, base, scale } = header;
    if (header.size[0] !== this.size[0] || header.size[1] !== this.size[1]) {
      throw new WireError('mismatch', `a frame of ${header.size} lumels for a tile of ${this.size}`);
    }
    if (base !== undefined && base !== this.newest?.update) {
      throw new WireError('missing_base', `update ${update} needs ${base}, which is not at hand`);
    }
    const moved = decodeTile(payload, this.size, base === undefined ? undefined : this.texels, this.spare);
    const texels = moved ? this.spare : this.texels;
    if (scale > SAFE_SCALE && !isFinite(texels, scale)) {
      throw new WireError('malformed', 'a value is not finite');
    }
    const changed = moved || scale !== this.newest?.scale;
    // Late frames do not replace newer ones.
    if (!this.newest || this.newest.update < update) {
      this.newest = { update, scale };
      if (moved) [this.texels, this.spare] = [this.spare, this.texels];
    }
    return { header, texels, changed };
  }
}

/** Whether 32 bits hold every value times the scale. */
function isFinite(texels: Uint16Array, scale: number): boolean {
  let largest = 0;
  for (let i = 0; i < texels.length; i++) {
    if (i % TEXEL < 3) largest = Math.max(largest, texels[i]);
  }
  return Number.isFinite(Math.fround(halfValue(largest) * scale));
}
