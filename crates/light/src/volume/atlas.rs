//! Probe volumes as half-float textures.
//!
//! A volume is one RGBA16F 3D texture. The 3·(l+1)² numbers of a probe fill texels of four in order
//! (c0.rgb c1.r | c1.gb c2.rg | …), so an expansion takes n = 3, 7, 12, 19 texels at L1 to L4; texel k
//! of all probes makes a sub-volume, and the n sub-volumes are stacked along z, each padded by one
//! copied slice at both ends so that trilinear filtering never reaches into the next. Depth is
//! n·(nz+2), 8 bytes a texel: an 8×8×8 volume at L2 takes 36 KB. For L2 it is the atlas that three.js
//! r187's `LightProbeGrid` samples. Halves hold value / scale (see [`crate::ScaleRule`]).

use glam::{UVec3, Vec3};
use half::f16;
use half::slice::{HalfBitsSliceExt, HalfFloatSliceExt};

use super::ProbeVolume;
use crate::Order;

/// A volume's texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Atlas {
    /// Texels along x, y, z.
    pub size: UVec3,
    /// Bits of half floats, four a texel, x fastest, then y, then z.
    pub halves: Vec<u16>,
    /// log2 of the scale: light is 2^`scale_log2` times what the texture holds.
    pub scale_log2: i8,
}

/// Texels of a probe: ⌈3·(l+1)²/4⌉.
pub const fn texels(order: Order) -> usize {
    (3 * order.coefficients()).div_ceil(4)
}

/// Size of the texture of a volume of `resolution` cells.
pub fn atlas_size(resolution: UVec3, order: Order) -> UVec3 {
    resolution.with_z((resolution.z + 2) * texels(order) as u32)
}

impl Atlas {
    /// Packs a volume. Values beyond the range of halves are clamped to it, NaN becomes 0, so that
    /// filtering stays finite.
    pub fn pack(volume: &ProbeVolume, scale_log2: i8) -> Self {
        let size = atlas_size(volume.grid.resolution, volume.order);
        let [nx, ny, nz] = volume.grid.resolution.as_usizevec3().to_array();
        let factor = (-f32::from(scale_log2)).exp2();
        let mut halves = vec![0; size.as_usizevec3().element_product() * 4];
        let mut numbers = vec![0.0_f32; 4 * texels(volume.order)];
        let mut packed = vec![f16::ZERO; numbers.len()];
        for probe in 0..volume.grid.probe_count() {
            for (number, value) in
                numbers.iter_mut().zip(volume.probe(probe).iter().flat_map(|c| c.to_array()))
            {
                *number = finite(value * factor);
            }
            packed.convert_from_f32_slice(&numbers);
            let (column, z) = (probe % (nx * ny), probe / (nx * ny));
            for (k, texel) in packed.reinterpret_cast().chunks_exact(4).enumerate() {
                let first = k * (nz + 2);
                let mut put = |slice: usize| {
                    halves[((first + slice) * nx * ny + column) * 4..][..4].copy_from_slice(texel);
                };
                put(z + 1);
                if z == 0 {
                    put(0);
                }
                if z + 1 == nz {
                    put(nz + 1);
                }
            }
        }
        Self { size, halves, scale_log2 }
    }

    /// Reads the coefficients back into `volume`.
    ///
    /// # Panics
    /// If `volume` is of another size than the texture.
    pub fn unpack(&self, volume: &mut ProbeVolume) {
        assert_eq!(self.size, atlas_size(volume.grid.resolution, volume.order));
        let [nx, ny, nz] = volume.grid.resolution.as_usizevec3().to_array();
        let factor = f32::from(self.scale_log2).exp2();
        let halves: &[f16] = self.halves.reinterpret_cast();
        for probe in 0..volume.grid.probe_count() {
            let (column, z) = (probe % (nx * ny), probe / (nx * ny));
            let number = |i: usize| {
                let slice = i / 4 * (nz + 2) + z + 1;
                halves[(slice * nx * ny + column) * 4 + i % 4].to_f32() * factor
            };
            for (i, c) in volume.probe_mut(probe).iter_mut().enumerate() {
                *c = Vec3::new(number(3 * i), number(3 * i + 1), number(3 * i + 2));
            }
        }
    }
}

fn finite(value: f32) -> f32 {
    let largest = f16::MAX.to_f32();
    if value.is_nan() { 0.0 } else { value.clamp(-largest, largest) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FieldId, Grid};
    use glam::Quat;

    fn volume(order: Order) -> ProbeVolume {
        let grid = Grid {
            center: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            size: Vec3::ONE,
            resolution: UVec3::new(2, 3, 4),
        };
        let mut volume = ProbeVolume::dark(FieldId(0), grid, order);
        for (i, c) in volume.coefficients.iter_mut().enumerate() {
            *c = Vec3::new(i as f32, -0.5 * i as f32, 0.25);
        }
        volume
    }

    #[test]
    fn every_order_round_trips() {
        for (order, n) in [(Order::L1, 3), (Order::L2, 7), (Order::L3, 12), (Order::L4, 19)] {
            let volume = volume(order);
            let atlas = Atlas::pack(&volume, 3);
            assert_eq!(atlas.size, UVec3::new(2, 3, n * 6));
            let mut back = ProbeVolume::dark(volume.id, volume.grid, order);
            atlas.unpack(&mut back);
            // Small multiples of ¼ are exact in halves.
            assert_eq!(back, volume);
        }
    }

    #[test]
    fn channels_and_padding_lie_where_the_layout_says() {
        let volume = volume(Order::L2);
        let atlas = Atlas::pack(&volume, 0);
        let texel = |x: usize, y: usize, z: usize| -> [f32; 4] {
            let first = ((z * 3 + y) * 2 + x) * 4;
            std::array::from_fn(|i| f16::from_bits(atlas.halves[first + i]).to_f32())
        };
        let probe = volume.probe(volume.grid.index(UVec3::new(1, 2, 3)));
        assert_eq!(texel(1, 2, 4), [probe[0].x, probe[0].y, probe[0].z, probe[1].x]);
        assert_eq!(texel(1, 2, 6 + 4), [probe[1].y, probe[1].z, probe[2].x, probe[2].y]);
        assert_eq!(texel(1, 2, 6 * 6 + 4), [probe[8].x, probe[8].y, probe[8].z, 0.0]);
        for k in 0..7 {
            assert_eq!(texel(0, 1, k * 6), texel(0, 1, k * 6 + 1));
            assert_eq!(texel(0, 1, k * 6 + 5), texel(0, 1, k * 6 + 4));
        }
    }

    #[test]
    fn bright_and_broken_light_stays_finite() {
        let mut volume = volume(Order::L1);
        volume.coefficients[0] = Vec3::new(45_000.0 * 4.0, f32::NAN, f32::NEG_INFINITY);
        let atlas = Atlas::pack(&volume, 0);
        assert!(atlas.halves.iter().all(|&bits| f16::from_bits(bits).is_finite()));
        let mut back = volume.clone();
        Atlas::pack(&volume, 16).unpack(&mut back);
        assert!((back.coefficients[0].x / 180_000.0 - 1.0).abs() < 1e-3);
        assert_eq!(back.coefficients[0].y, 0.0);
    }
}
