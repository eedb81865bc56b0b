import type { Vec3 } from '../edit.js';
import { WireError } from '../wire-error.js';
import { layerOf, type ProbeHeader, splitProbeFrame } from './probe-header.js';
import { decodeRegion, type Reconstruction } from './probe-model.js';

/** Light of a region at one update. */
export interface RegionLight {
  readonly header: ProbeHeader;
  /** r, g, b of each coefficient, cd/m², probe by probe in index order of the region. */
  readonly coefficients: Float32Array;
}

/**
 * Decodes the frames of one region of a field. Holds the newest reconstruction of layers 0 and 1, to
 * which deltas refer.
 */
export class ProbeDecoder {
  private readonly bases: (Base | undefined)[] = [undefined, undefined];

  constructor(
    private readonly size: Vec3,
    private readonly order: number,
  ) {}

  /**
   * Decodes a frame. Frames may come in any order and may be missing.
   * @throws WireError; the decoder is then as it was.
   */
  decode(frame: Uint8Array): RegionLight {
    const { header, payload } = splitProbeFrame(frame);
    if (header.size.some((cells, axis) => cells !== this.size[axis])) {
      throw new WireError('mismatch', `a frame of ${header.size} cells for a region of ${this.size}`);
    }
    if (header.order !== this.order) {
      throw new WireError('mismatch', `a frame of order ${header.order} for a field of order ${this.order}`);
    }
    const region = decodeRegion(payload, this.size, this.order, this.base(header));
    this.keep(header.update, region);
    return { header, coefficients: toRgb(region.values) };
  }

  /** Whether a later delta may refer to an update, as far as is known. */
  lacks(update: number): boolean {
    const layer = layerOf(update);
    const held = this.bases[layer];
    return layer <= 1 && (!held || held.update < update);
  }

  private base(header: ProbeHeader): Reconstruction | undefined {
    if (header.base === undefined) return undefined;
    const base = this.bases.find((base) => base?.update === header.base);
    if (!base) {
      throw new WireError(
        'missing_base',
        `update ${header.update} needs ${header.base}, which is not at hand`,
      );
    }
    return base.region;
  }

  /** Keeps what later deltas may refer to; late frames do not replace newer ones. */
  private keep(update: number, region: Reconstruction): void {
    if (this.lacks(update)) this.bases[layerOf(update)] = { update, region };
  }
}

interface Base {
  readonly update: number;
  readonly region: Reconstruction;
}

/** 1/√3, 1/√2, 1/√6 and 2/√6. */
const K3 = 0.5773502691896258;
const K2 = Math.SQRT1_2;
const K6 = 0.408248290463863;
const K6_2 = 0.816496580927726;

/** (a, b, c) → (r, g, b), computed in f64 from left to right and rounded once. */
function toRgb(abc: Float32Array): Float32Array {
  const rgb = new Float32Array(abc.length);
  for (let i = 0; i < abc.length; i += 3) {
    const a = K3 * abc[i];
    const half = K2 * abc[i + 1];
    const sixth = K6 * abc[i + 2];
    rgb[i] = a + half - sixth;
    rgb[i + 1] = a + K6_2 * abc[i + 2];
    rgb[i + 2] = a - half - sixth;
  }
  return rgb;
}
