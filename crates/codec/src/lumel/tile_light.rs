//! Decoded lumels.

use glam::Vec3;

use crate::FrameHead;

/// Light of a tile at one update.
#[derive(Clone, Debug, PartialEq)]
pub struct TileLight {
    /// What the frame begins with.
    pub head: FrameHead,
    /// Irradiance (r, g, b), lux, row after row.
    pub irradiance: Vec<Vec3>,
}
