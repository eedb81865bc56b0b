//! A volume of probes as given on the command line.

use std::str::FromStr;

use anyhow::{Context, Result, ensure};
use glam::{Quat, UVec3, Vec3};
use lumencast_light::{Grid, Order};
use lumencast_scene::{Scene, VolumeSpec};

use crate::values::{parse_list, parse_point};

/// A volume as given on the command line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VolumeArgument {
    /// Cells along each axis.
    pub(crate) resolution: UVec3,
    /// Centre and size; the scene's bounds if absent.
    pub(crate) place: Option<(Vec3, Vec3)>,
}

impl VolumeArgument {
    /// The volume in a scene: without a place of its own it spans the scene's bounds.
    pub(crate) fn in_scene(&self, scene: &Scene) -> Result<VolumeSpec> {
        let bounds = scene.bounds();
        let (center, size) = self.place.unwrap_or((
            0.5 * (bounds.min + bounds.max),
            (bounds.max - bounds.min).max(Vec3::splat(1e-3)),
        ));
        let grid = Grid { center, rotation: Quat::IDENTITY, size, resolution: self.resolution };
        let volume = VolumeSpec { grid, order: Order::default() };
        volume.check().map_err(anyhow::Error::msg)?;
        Ok(volume)
    }
}

impl FromStr for VolumeArgument {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let (cells, place) = match text.split_once('@') {
            Some((cells, place)) => (cells, Some(place)),
            None => (text, None),
        };
        let resolution: [u32; 3] = parse_list(cells, 'x')
            .with_context(|| format!("{cells:?}: cells are given as 10x6x7"))?;
        ensure!(resolution.iter().all(|n| *n > 0), "{cells:?}: at least one cell along each axis");
        let place = place.map(|place| -> Result<_> {
            let (center, size) = place
                .split_once(':')
                .with_context(|| format!("{place:?}: a place is given as X,Y,Z:SX,SY,SZ"))?;
            let (center, size) = (parse_point(center)?, parse_point(size)?);
            ensure!(size.cmpgt(Vec3::ZERO).all(), "a volume's size is more than 0 along each axis");
            Ok((center, size))
        });
        Ok(Self { resolution: resolution.into(), place: place.transpose()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes() {
        let v: VolumeArgument = "10x6x7".parse().expect("cells only");
        assert_eq!(v, VolumeArgument { resolution: UVec3::new(10, 6, 7), place: None });
        let v: VolumeArgument = "1x2x3@0,-1.5,2:4,5,6".parse().expect("cells and place");
        assert_eq!(v.place, Some((Vec3::new(0.0, -1.5, 2.0), Vec3::new(4.0, 5.0, 6.0))));
        for wrong in
            ["", "8", "8x8", "0x1x1", "8x8x8@", "8x8x8@0,0,0", "8x8x8@0,0,0:1,1,0", "axbxc"]
        {
            assert!(wrong.parse::<VolumeArgument>().is_err(), "{wrong}");
        }
    }
}
