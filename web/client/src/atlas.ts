import type { Vec3 } from './edit.js';
import { valuesPerProbe } from './codec/volume-shape.js';

/**
 * Packing of a probe volume into the atlas that shaders sample: one RGBA16F 3D texture, the volume's
 * values four a texel in ⌈3(order+1)²/4⌉ sub-volumes stacked along z (3, 7, 12, 19 for orders 1 to 4),
 * each padded by a copy of its first and last slice so that filtering does not reach into the next.
 * For order 2 this is the texture of three.js' own `LightProbeGrid`. Halves hold value / scale.
 */
export interface AtlasLayout {
  readonly width: number;
  readonly height: number;
  /** Slices of the whole atlas: `subVolumes * (nz + 2)`. WebGL2 guarantees 256. */
  readonly depth: number;
  readonly subVolumes: number;
}

/** The atlas of a volume of `resolution` cells and an order of 1 to 4. */
export function atlasLayout(resolution: Vec3, order: number): AtlasLayout {
  const [width, height, nz] = resolution;
  const subVolumes = Math.ceil(valuesPerProbe(order) / 4);
  return { width, height, depth: subVolumes * (nz + 2), subVolumes };
}

const scratch = new Float32Array(1);
const scratchBits = new Int32Array(scratch.buffer);

/**
 * The half nearest to a number, ties to even; what a half cannot hold becomes the largest finite one,
 * NaN becomes 0: a texture must never hold what filtering would spread.
 */
export function halfBits(value: number): number {
  scratch[0] = value;
  const bits = scratchBits[0];
  const sign = (bits >>> 16) & 0x8000;
  const magnitude = bits & 0x7fff_ffff;
  if (magnitude > 0x477f_e000) return magnitude > 0x7f80_0000 ? 0 : sign | 0x7bff;
  if (magnitude < 0x3880_0000) {
    // Below 2⁻¹⁴ halves are multiples of 2⁻²⁴, which is an ulp of floats from 0.5 to 1.
    scratch[0] = Math.abs(value) + 0.5;
    return sign | (scratchBits[0] - 0x3f00_0000);
  }
  const odd = (magnitude >>> 13) & 1;
  return sign | ((magnitude - 0x3800_0000 + 0xfff + odd) >>> 13);
}

/**
 * Packs a volume's coefficients (as in `VolumeLight.coefficients`) into `target`, which holds
 * `width * height * depth * 4` halves; allocates it when absent.
 */
export function packAtlas(
  coefficients: Float32Array,
  resolution: Vec3,
  order: number,
  scale: number,
  target?: Uint16Array<ArrayBuffer>,
): Uint16Array<ArrayBuffer> {
  const { width, height, depth, subVolumes } = atlasLayout(resolution, order);
  const nz = resolution[2];
  const length = width * height * depth * 4;
  const out = target ?? new Uint16Array(length);
  const values = valuesPerProbe(order);
  const probes = width * height * nz;
  if (out.length !== length) throw new RangeError(`an atlas of ${out.length} halves instead of ${length}`);
  if (coefficients.length !== probes * values) {
    throw new RangeError(`${coefficients.length} coefficients instead of ${probes * values}`);
  }
  const slice = width * height * 4;
  const perScale = 1 / scale;
  for (let sub = 0; sub < subVolumes; sub++) {
    const base = sub * (nz + 2) * slice;
    const channels = Math.min(4, values - sub * 4);
    for (let channel = 0; channel < channels; channel++) {
      let to = base + slice + channel;
      for (let from = sub * 4 + channel; from < coefficients.length; from += values, to += 4) {
        out[to] = halfBits(coefficients[from] * perScale);
      }
    }
    out.copyWithin(base, base + slice, base + 2 * slice);
    out.copyWithin(base + (nz + 1) * slice, base + nz * slice, base + (nz + 1) * slice);
  }
  return out;
}
