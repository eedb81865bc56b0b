//! Probe volumes of a scene.

use glam::{UVec3, Vec3};
use lumencast_light::{Grid, Order};
use serde::{Deserialize, Serialize};

use crate::limits;

/// A probe volume that a scene asks for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct VolumeSpec {
    /// The box and its cells, of which there are at most 65,536.
    #[serde(flatten)]
    pub grid: Grid,
    /// Order of the expansion.
    #[serde(default)]
    pub order: Order,
}

impl VolumeSpec {
    /// Checks values against their ranges.
    ///
    /// # Errors
    /// The reason why the volume makes no sense.
    pub fn check(&self) -> Result<(), String> {
        let Grid { center, rotation, size, resolution } = self.grid;
        if !(center.is_finite() && rotation.is_finite() && size.is_finite()) {
            return Err("it is not finite".into());
        }
        if !rotation.is_normalized() {
            return Err("its rotation is not a unit quaternion".into());
        }
        if !size.cmpgt(Vec3::ZERO).all() || size.max_element() > limits::EXTENT {
            return Err(format!(
                "its size is {size} metres; each side has to be more than 0, at most {:e}",
                limits::EXTENT
            ));
        }
        if resolution.min_element() == 0 || cells(resolution) > limits::PROBES {
            let UVec3 { x, y, z } = resolution;
            return Err(format!(
                "{x}x{y}x{z} cells; a volume has 1 to {}: give it fewer, or give several volumes",
                limits::PROBES
            ));
        }
        Ok(())
    }

    /// Splits the volume across z into the fewest pieces of at most 34 layers of cells, the most
    /// that browsers hold in one texture. Pieces are nearly equal, and probes keep their positions.
    /// A volume that is shallow enough is one piece.
    pub fn split(self) -> impl Iterator<Item = Self> {
        let Grid { center, rotation, size, resolution } = self.grid;
        let pieces = resolution.z.div_ceil(limits::VOLUME_DEPTH);
        let cut = move |piece: u32| {
            (u64::from(resolution.z) * u64::from(piece) / u64::from(pieces)) as u32
        };
        (0..pieces).map(move |piece| {
            let (from, to) = (cut(piece), cut(piece + 1));
            let share = |layers: u32| layers as f32 / resolution.z as f32;
            let middle = 0.5 * (share(from) + share(to)) - 0.5;
            let grid = Grid {
                center: center + rotation * (Vec3::Z * (middle * size.z)),
                rotation,
                size: size.with_z(size.z * share(to - from)),
                resolution: resolution.with_z(to - from),
            };
            Self { grid, ..self }
        })
    }
}

fn cells(resolution: UVec3) -> u64 {
    resolution.to_array().into_iter().map(u64::from).fold(1, u64::saturating_mul)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;
    use lumencast_light::{FieldId, Light, Place, ProbeVolume};

    fn deep(layers: u32, rotation: Quat) -> VolumeSpec {
        let grid = Grid {
            center: Vec3::new(3.0, -1.0, 2.0),
            rotation,
            size: Vec3::new(4.0, 2.0, 30.0),
            resolution: UVec3::new(3, 2, layers),
        };
        VolumeSpec { grid, order: Order::L3 }
    }

    #[test]
    fn pieces_have_the_probes_of_the_whole() {
        for rotation in [Quat::IDENTITY, Quat::from_xyzw(0.1, 0.5, -0.3, 0.8).normalize()] {
            for (layers, depths) in [
                (1, &[1][..]),
                (34, &[34]),
                (35, &[17, 18]),
                (68, &[34, 34]),
                (103, &[25, 26, 26, 26]),
            ] {
                let whole = deep(layers, rotation);
                whole.check().expect("a sound volume");
                let pieces: Vec<_> = whole.split().collect();
                let found: Vec<u32> = pieces.iter().map(|p| p.grid.resolution.z).collect();
                assert_eq!(found, depths);
                for piece in &pieces {
                    piece.check().expect("a sound piece");
                    assert_eq!(piece.order, whole.order);
                }
                let probes: Vec<Vec3> = pieces.iter().flat_map(|p| p.grid.positions()).collect();
                assert_eq!(probes.len(), whole.grid.probe_count());
                for (probe, of_whole) in probes.into_iter().zip(whole.grid.positions()) {
                    assert!(probe.distance(of_whole) < 1e-5, "{probe} {of_whole}");
                }
            }
            let shallow = deep(34, rotation);
            assert_eq!(shallow.split().collect::<Vec<_>>(), [shallow]);
        }
    }

    #[test]
    fn light_is_continuous_across_the_cuts() {
        let rotation = Quat::from_xyzw(0.1, 0.5, -0.3, 0.8).normalize();
        let whole = deep(70, rotation);
        // The light changes from layer to layer as much as it can.
        let lit = |(id, piece, first): (u32, VolumeSpec, u32)| {
            let mut volume = ProbeVolume::dark(FieldId(id), piece.grid, piece.order);
            for probe in 0..piece.grid.probe_count() {
                let layer = first + piece.grid.cell(probe).z;
                volume.probe_mut(probe)[0] = Vec3::splat((layer % 2) as f32);
            }
            volume
        };
        let mut first = 0;
        let pieces = (0..).zip(whole.split()).map(|(id, piece)| {
            first += piece.grid.resolution.z;
            lit((id, piece, first - piece.grid.resolution.z))
        });
        let pieces = Light::new(pieces);
        let whole_light = Light::new(vec![lit((0, whole, 0))]);
        assert_eq!(pieces.volumes().count(), 3);
        let cell = whole.grid.spacing().z;
        let read = |light: &Light, z: f32| {
            let position = whole.grid.center + rotation * Vec3::new(0.3, 0.2, z);
            light.sample(&Place::in_space(position)).expect("light").values()[0].x
        };
        // Steps are hundredths of a cell, from the first probe to the last.
        let values: Vec<(f32, f32)> = (50..=6950)
            .map(|i| (i as f32 * 0.01 - 35.0) * cell)
            .map(|z| (read(&pieces, z), read(&whole_light, z)))
            .collect();
        let steepest = values.windows(2).map(|v| (v[1].0 - v[0].0).abs()).fold(0.0, f32::max);
        assert!(steepest < 0.03, "{steepest}");
        // Trilinear light is linear between probes; at the cuts between pieces it is a curve.
        let farthest = values.iter().map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(farthest > 0.01 && farthest < 0.15, "{farthest}");
    }

    #[test]
    fn senseless_volumes_are_refused() {
        let good = deep(4, Quat::IDENTITY);
        let with = |change: fn(&mut Grid)| {
            let mut volume = good;
            change(&mut volume.grid);
            volume.check()
        };
        assert_eq!(good.check(), Ok(()));
        assert!(with(|g| g.size.x = 0.0).is_err());
        assert!(with(|g| g.size.y = f32::NAN).is_err());
        assert!(with(|g| g.resolution.y = 0).is_err());
        assert!(with(|g| g.resolution = UVec3::splat(u32::MAX)).is_err());
        assert!(with(|g| g.resolution = UVec3::new(1, 1, 65_537)).is_err());
        assert!(with(|g| g.rotation.w = 2.0).is_err());
    }
}
