//! Where in front of a surface a volume's light is read.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::Grid;

/// How far along its normal a surface's point is moved before light is read, so that probes behind
/// the surface count less. In JSON `{"cells": 0.5}` or `{"metres": 0.1}`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Offset {
    /// Parts of the distance between probes, along each of the box's axes.
    Cells(f32),
    /// Metres.
    Metres(f32),
}

impl Offset {
    /// Not at all.
    pub const NONE: Self = Self::Cells(0.0);
    /// Half a cell: three.js's rule.
    pub const HALF_CELL: Self = Self::Cells(0.5);

    /// Along each of the box's axes, in cells, for a normal along that axis.
    #[must_use]
    pub fn in_cells(self, grid: &Grid) -> Vec3 {
        match self {
            Self::Cells(cells) => Vec3::splat(cells),
            Self::Metres(metres) => metres / grid.spacing(),
        }
    }
}

impl Default for Offset {
    fn default() -> Self {
        Self::HALF_CELL
    }
}
