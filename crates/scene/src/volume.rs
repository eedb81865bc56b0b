//! Where a scene's probes are.

use glam::{UVec3, Vec3};
use lumencast_light::{Grid, Order};
use serde::{Deserialize, Serialize};

use crate::{Aabb, limits};

/// A probe volume as a scene asks for it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct VolumeSpec {
    /// The box and its cells: at most 65,536 of them, and at most 34 along z.
    #[serde(flatten)]
    pub grid: Grid,
    /// Order of the expansion.
    #[serde(default)]
    pub order: Order,
}

impl VolumeSpec {
    /// The volume of a scene that asks for none: its bounds, cut into nearly cubic cells, as many as
    /// `probes` allows. Probes stand at the centres of cells, so the outermost are half a cell
    /// inside. A side of less than a tenth of the longest is widened to that, about its middle.
    pub fn around(bounds: Aabb, probes: u32) -> Self {
        let extent = bounds.max - bounds.min;
        let size = extent.max(Vec3::splat((0.1 * extent.max_element()).max(1e-3)));
        let most = UVec3::new(u32::MAX, u32::MAX, limits::VOLUME_DEPTH);
        let probes = u64::from(probes.max(1)).min(limits::PROBES);
        let mut cell = (size.element_product() / probes as f32).cbrt();
        let resolution = loop {
            let resolution = (size / cell).round().as_uvec3().max(UVec3::ONE).min(most);
            if cells(resolution) <= probes {
                break resolution;
            }
            cell *= 1.02;
        };
        let grid = Grid {
            center: 0.5 * (bounds.min + bounds.max),
            rotation: glam::Quat::IDENTITY,
            size,
            resolution,
        };
        Self { grid, order: Order::default() }
    }

    /// Whether it makes sense; the reason when it does not.
    pub fn check(&self) -> Result<(), String> {
        let Grid { center, rotation, size, resolution } = self.grid;
        if !(center.is_finite() && rotation.is_finite() && size.is_finite()) {
            return Err("it is not finite".into());
        }
        if !rotation.is_normalized() {
            return Err("its rotation is not a unit quaternion".into());
        }
        if !size.cmpgt(Vec3::ZERO).all() || size.max_element() > limits::EXTENT {
            return Err(format!("its size is {size}; each side has to be more than 0"));
        }
        if resolution.min_element() == 0 || cells(resolution) > limits::PROBES {
            let UVec3 { x, y, z } = resolution;
            return Err(format!(
                "{x}x{y}x{z} cells; a volume has 1 to {}: give it fewer, or give several volumes",
                limits::PROBES
            ));
        }
        if resolution.z > limits::VOLUME_DEPTH {
            return Err(format!(
                "{} cells along z; browsers hold {} at most: turn it or split it",
                resolution.z,
                limits::VOLUME_DEPTH
            ));
        }
        Ok(())
    }
}

fn cells(resolution: UVec3) -> u64 {
    resolution.to_array().into_iter().map(u64::from).fold(1, u64::saturating_mul)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes_around_bounds_have_near_cubic_cells_within_the_budget() {
        for (size, probes) in [
            (Vec3::new(29.8, 12.4, 18.3), 512),
            (Vec3::splat(2.0), 512),
            (Vec3::new(100.0, 0.0, 100.0), 512),
            (Vec3::new(1.0, 1.0, 1000.0), 65_536),
            (Vec3::ZERO, 8),
        ] {
            let bounds = Aabb { min: Vec3::ONE, max: Vec3::ONE + size };
            let volume = VolumeSpec::around(bounds, probes);
            volume.check().expect("a sound volume");
            let n = volume.grid.probe_count();
            assert!(n <= probes as usize, "{size}: {n}");
            let margin = 0.05 * size.max_element() + 1e-3;
            let inside =
                |p: Vec3| p.cmpge(bounds.min - margin).all() && p.cmple(bounds.max + margin).all();
            assert!(volume.grid.positions().all(inside), "{size}");
        }
        let cube = VolumeSpec::around(Aabb { min: Vec3::ZERO, max: Vec3::ONE }, 512);
        assert_eq!(cube.grid.resolution, UVec3::splat(8));
        let sponza = Aabb { min: Vec3::ZERO, max: Vec3::new(29.8, 12.4, 18.3) };
        let cell = VolumeSpec::around(sponza, 512).grid;
        let cell = cell.size / cell.resolution.as_vec3();
        assert!(cell.max_element() / cell.min_element() < 1.3, "{cell}");
    }

    #[test]
    fn senseless_volumes_are_refused() {
        let good = VolumeSpec::around(Aabb { min: Vec3::ZERO, max: Vec3::ONE }, 64);
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
        assert!(with(|g| g.resolution.z = 35).is_err());
        assert!(with(|g| g.rotation.w = 2.0).is_err());
    }
}
