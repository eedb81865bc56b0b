/**
 * The model of a tile: which numbers are coded, in which order, with which predictions and contexts
 * (docs/wire.md, "What is coded of lumels"). The twin of `codec/src/lumel/model.rs`, in whole numbers.
 */
import { WireError } from '../wire-error.js';
import { LIMITS } from './limits.js';
import { decodeResidual, RESIDUAL_CONTEXTS } from './lumel-residual.js';
import { Contexts, RangeDecoder } from './range.js';

/** Halves of a lumel's texel: r, g, b and 1. */
export const TEXEL = 4;
/** 1 as a half float. */
const ONE = 0x3c00;
/** The largest finite half, 65504, as an integer. */
const LARGEST = 0x7bff;
/** Lumels of a block along a side. */
const BLOCK = 8;

/** Where contexts begin: 3 for `skip`, 1 for `nearby`, those of Y's residuals, those of Co's and Cg's. */
const NEARBY = 3;
const LUMA = NEARBY + 1;
const CHROMA = LUMA + RESIDUAL_CONTEXTS;
const contexts = new Contexts(CHROMA + RESIDUAL_CONTEXTS);

const MOST_LUMELS = LIMITS.tileLumels ** 2;
/** Y, Co and Cg of each lumel of the tile under way, less those of the base; and the residuals. */
const changes = new Int32Array(3 * MOST_LUMELS);
const residuals = new Int32Array(3 * MOST_LUMELS);
const skipped = new Uint8Array(MOST_LUMELS / BLOCK ** 2);
/** The likely change of the lumel under way. */
const likely = new Int32Array(3);

/**
 * Decodes the payload of a frame into the texels of a tile: a delta on those of `base`, or a keyframe when
 * there is none. Returns whether the tile is another than the base; where it is not, `tile` is left alone.
 */
export function decodeTile(
  payload: Uint8Array,
  [width, height]: readonly [number, number],
  base: Uint16Array | undefined,
  tile: Uint16Array,
): boolean {
  contexts.reset();
  const coder = new RangeDecoder(payload, contexts);
  if (!coder.valid) throw new WireError('malformed', 'start of the payload');
  const across = Math.ceil(width / BLOCK);
  const blocks = across * Math.ceil(height / BLOCK);
  let changed = false;
  for (let block = 0; block < blocks; block++) {
    if (coder.overrun) throw new WireError('truncated', 'the payload ends too early');
    const column = block % across;
    let nearby = true;
    if (base) {
      const left = column > 0 ? skipped[block - 1] : 0;
      const above = block >= across ? skipped[block - across] : 0;
      skipped[block] = coder.bit(left + above);
      if (skipped[block]) continue;
      nearby = coder.bit(NEARBY) === 1;
    }
    if (!changed) begin(base, tile, width * height);
    changed = true;
    const [x, y] = [BLOCK * column, BLOCK * Math.floor(block / across)];
    decodeBlock(
      coder,
      base,
      tile,
      x,
      y,
      Math.min(x + BLOCK, width),
      Math.min(y + BLOCK, height),
      width,
      nearby,
    );
  }
  if (coder.overrun) throw new WireError('truncated', 'the payload ends too early');
  if (!coder.atEnd) throw new WireError('malformed', 'bytes after the end');
  return changed;
}

/** Makes a tile that of the base, and forgets the one before. */
function begin(base: Uint16Array | undefined, tile: Uint16Array, lumels: number): void {
  // In a keyframe each lumel is written before it is read.
  if (!base) return;
  tile.set(base);
  changes.fill(0, 0, 3 * lumels);
  residuals.fill(0, 0, 3 * lumels);
}

function decodeBlock(
  coder: RangeDecoder,
  base: Uint16Array | undefined,
  tile: Uint16Array,
  left: number,
  top: number,
  right: number,
  bottom: number,
  width: number,
  nearby: boolean,
): void {
  const row = 3 * width;
  for (let y = top; y < bottom; y++) {
    for (let x = left; x < right; x++) {
      const at = y * width + x;
      const i = 3 * at;
      const texel = TEXEL * at;
      if (nearby) predict(i, x > 0, y > 0, row);
      else likely.fill(0);
      let luma = 0;
      for (let k = 0; k < 3; k++) {
        const west = x > 0 ? residuals[i + k - 3] : 0;
        const north = y > 0 ? residuals[i + k - row] : 0;
        const residual = decodeResidual(coder, k > 0 ? CHROMA : LUMA, west, north, luma);
        if (k === 0) luma = residual;
        residuals[i + k] = residual;
        changes[i + k] = likely[k] + residual;
      }
      write(tile, texel, base, changes[i], changes[i + 1], changes[i + 2]);
    }
  }
}

/**
 * What a lumel's change is likely to be, by those at west, north and north-west: the median edge detector
 * of JPEG-LS (Weinberger, Seroussi and Sapiro 2000).
 */
function predict(i: number, hasWest: boolean, hasNorth: boolean, row: number): void {
  for (let k = 0; k < 3; k++) {
    const west = hasWest ? changes[i + k - 3] : 0;
    const north = hasNorth ? changes[i + k - row] : 0;
    if (hasWest && hasNorth) {
      const sum = west + north - changes[i + k - row - 3];
      likely[k] = Math.max(Math.min(west, north), Math.min(Math.max(west, north), sum));
    } else {
      likely[k] = west + north;
    }
  }
}

/** Writes a lumel: the base's Y, Co and Cg with their changes as r, g, b (YCoCg-R: Malvar and Sullivan 2003). */
function write(
  tile: Uint16Array,
  texel: number,
  base: Uint16Array | undefined,
  y: number,
  co: number,
  cg: number,
): void {
  if (base) {
    const [r, g, b] = [base[texel], base[texel + 1], base[texel + 2]];
    co += r - b;
    const t = b + ((r - b) >> 1);
    cg += g - t;
    y += t + ((g - t) >> 1);
  }
  const t = y - (cg >> 1);
  const g = cg + t;
  const b = t - (co >> 1);
  const r = b + co;
  // As unsigned numbers, negative ones are too large.
  if (r >>> 0 > LARGEST || g >>> 0 > LARGEST || b >>> 0 > LARGEST) {
    throw new WireError('malformed', 'a value is no half');
  }
  tile[texel] = r;
  tile[texel + 1] = g;
  tile[texel + 2] = b;
  tile[texel + 3] = ONE;
}
