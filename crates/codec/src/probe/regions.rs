//! How a volume is cut into regions.

use glam::UVec3;
use serde::{Deserialize, Serialize};

/// A box of cells of a volume, the unit of tracks: a client asks for near regions first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Region {
    /// Its number within the field.
    pub id: u32,
    /// Its first cell.
    pub min: UVec3,
    /// Cells along each axis, 1 to 16.
    pub size: UVec3,
}

/// Cells of a region along an axis, at most, as this encoder cuts. Smaller regions follow the
/// viewer more closely; larger ones cost fewer tracks and learn their statistics once.
const CELLS: u32 = 10;

impl Region {
    /// Indices of the region's probes within a volume of `resolution`, in the region's index order.
    pub fn probes(self, resolution: UVec3) -> impl Iterator<Item = usize> + Clone {
        let r = resolution.as_usizevec3();
        let (min, size) = (self.min.as_usizevec3(), self.size.as_usizevec3());
        (min.z..min.z + size.z).flat_map(move |z| {
            (min.y..min.y + size.y)
                .flat_map(move |y| (min.x..min.x + size.x).map(move |x| (z * r.y + y) * r.x + x))
        })
    }

    /// Number of probes.
    pub fn probe_count(self) -> usize {
        self.size.as_usizevec3().element_product()
    }
}

/// Cuts a volume into bricks of nearly equal size, as few as have at most ten cells along an axis.
pub fn regions(resolution: UVec3) -> Vec<Region> {
    let parts = resolution.map(|cells| cells.div_ceil(CELLS).max(1));
    let cut = |axis: usize, part: u32| {
        (u64::from(resolution[axis]) * u64::from(part) / u64::from(parts[axis])) as u32
    };
    let mut regions = Vec::with_capacity(parts.as_usizevec3().element_product());
    for z in 0..parts.z {
        for y in 0..parts.y {
            for x in 0..parts.x {
                let part = UVec3::new(x, y, z).to_array();
                let corner = |step: u32| {
                    UVec3::from_array(std::array::from_fn(|axis| cut(axis, part[axis] + step)))
                };
                let min = corner(0);
                regions.push(Region { id: regions.len() as u32, min, size: corner(1) - min });
            }
        }
    }
    regions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_cover_every_probe_once() {
        for resolution in [[1, 1, 1], [8, 8, 8], [10, 6, 7], [16, 16, 16], [33, 2, 21]] {
            let resolution = UVec3::from_array(resolution);
            let regions = regions(resolution);
            let mut seen = vec![0; resolution.as_usizevec3().element_product()];
            for region in &regions {
                assert!(region.size.max_element() <= CELLS && region.size.min_element() >= 1);
                assert_eq!(region.probes(resolution).count(), region.probe_count());
                region.probes(resolution).for_each(|i| seen[i] += 1);
            }
            assert!(seen.iter().all(|&n| n == 1));
        }
        assert_eq!(regions(UVec3::splat(8)).len(), 1);
        assert_eq!(regions(UVec3::splat(16)).len(), 8);
    }
}
