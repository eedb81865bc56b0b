//! Decoded lumels.

use glam::Vec3;
use lumencast_light::Told;

use super::slope_codes::slope;
use crate::FrameHead;

/// Light of a tile at one update.
#[derive(Clone, Debug, PartialEq)]
pub struct TileLight {
    /// What the frame begins with.
    pub head: FrameHead,
    /// Irradiance (r, g, b), lux, row after row; where the tile tells slopes, what codes them.
    pub irradiance: Vec<Vec3>,
}

impl TileLight {
    /// What it tells, row after row, where it is of a tile that tells this.
    pub fn told(self, told: Told) -> Vec<Vec3> {
        match told {
            Told::Irradiance => self.irradiance,
            Told::Slopes => self.irradiance.into_iter().map(slope).collect(),
        }
    }
}
