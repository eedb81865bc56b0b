//! Which triangles may rays of one kind meet, by where they go in a plane across them?
//!
//! Rays that are parallel, or that all start at one point, are told apart by two coordinates. So the
//! plane across them is divided into cells, and each cell knows what lies over it: blocks of triangles,
//! the highest first, down to a height where one opaque triangle covers the whole cell. Most rays then
//! meet few blocks; and a ray's cell is known before it is looked at, so that it can be asked for
//! early. Cells over which too many blocks lie (a car in a desert) leave their rays to the hierarchy.
//!
//! Blocks are those of the hierarchy and are tested by the same instructions, so that a ray finds
//! here what it finds there. What a cell lists, and what covers it, errs towards testing.
//!
//! Coordinates are those of a [`Shape`]: two across the rays, in which they do not move, and a height.

mod fill;
mod shape;

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::TriangleBvh;
use super::kernel::Kernel;
use super::pages::Pages;
use super::walk::fetch_line;
use fill::Grid;
pub(super) use shape::{Flat, Shape, corners};

/// Rays whose cells are asked for before the first of them is looked at.
pub(super) const AHEAD: usize = 16;

/// What lies over each cell.
#[derive(Debug)]
pub(super) struct Cells {
    pub(super) kernel: Kernel,
    /// Whose blocks are listed.
    pub(super) bvh: Arc<TriangleBvh>,
    /// The instance that the blocks count from.
    pub(super) instance: u32,
    grid: Grid,
    /// Row by row, and one that ends the last one's list.
    cells: Pages<Cell>,
    listed: Pages<Listed>,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Cell {
    /// Below this, an opaque triangle covers all of it.
    covered_below: f32,
    /// The first that is listed for it; the last is the one before the next cell's.
    first: u32,
}

/// A block with triangles over a cell.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Listed {
    /// No point of its triangles over the cell lies higher.
    pub(super) height: f32,
    pub(super) block: u32,
}

impl Listed {
    /// In place of more than are worth listing.
    pub(super) const TOO_MANY: Self = Self { height: f32::INFINITY, block: u32::MAX };

    pub(super) fn is_too_many(&self) -> bool {
        self.block == Self::TOO_MANY.block
    }
}

/// What is allowed for rounding, in the units of shapes.
#[derive(Clone, Copy)]
pub(super) struct Margins {
    /// On either side of a cell.
    pub(super) aside: f64,
    /// Beside a triangle at which rays start.
    pub(super) beside: f64,
    /// Of heights.
    pub(super) above: f64,
    /// Of heights, as a share of them.
    pub(super) share: f64,
}

/// What a cell knows.
pub(super) struct Over<'a> {
    /// Below this, an opaque triangle covers all of it.
    pub(super) covered_below: f32,
    /// What lies over it, the highest first.
    pub(super) listed: &'a [Listed],
}

impl Cells {
    #[cfg(test)]
    pub(super) fn count(&self) -> usize {
        // One ends the last one's list.
        self.cells.len() - 1
    }

    /// Asks for the cell at a place, and gives its number.
    #[inline(always)]
    pub(super) fn find(&self, at: [f32; 2]) -> usize {
        // Beyond the last there is nothing.
        let cell = self.grid.cell(at).unwrap_or(self.cells.len());
        fetch_line(self.cells.as_ptr().wrapping_add(cell).cast());
        cell
    }

    /// Asks for what lies over a cell; `None` for the number of a place beyond all cells.
    #[inline(always)]
    pub(super) fn look_up(&self, cell: usize) -> Option<Over<'_>> {
        let [cell, next] = self.cells.get(cell..cell + 2)? else { return None };
        let listed = &self.listed[cell.first as usize..next.first as usize];
        fetch_line(listed.as_ptr().cast());
        Some(Over { covered_below: cell.covered_below, listed })
    }
}
