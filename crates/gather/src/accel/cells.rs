//! Finds the triangles that rays of one kind may meet, by their position in a plane across the
//! rays.
//!
//! Rays that are parallel, or that all start at one point, are told apart by two coordinates. So
//! the plane across them is divided into cells, and each cell lists what lies over it. The list
//! holds blocks of triangles, the highest first, down to a height where one opaque triangle covers
//! the whole cell. Most rays then meet few blocks. A ray's cell is known before it is read, so it
//! can be prefetched. Cells with too many blocks over them (a car in a desert) leave their rays to
//! the hierarchy.
//!
//! Blocks are those of the hierarchy and are tested by the same instructions. So a ray finds here
//! what it finds there. Lists and covers are conservative: they err towards testing.
//!
//! Coordinates are those of a [`Shape`]: two across the rays, constant along each ray, and a
//! height.

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

/// Number of rays whose cells are prefetched before the first of them is read.
pub(super) const AHEAD: usize = 16;

/// The lists of blocks over each cell.
#[derive(Debug)]
pub(super) struct Cells {
    pub(super) kernel: Kernel,
    /// The hierarchy whose blocks are listed.
    pub(super) bvh: Arc<TriangleBvh>,
    /// The instance that the blocks' instances are relative to.
    pub(super) instance: u32,
    grid: Grid,
    /// Cells row by row, and one more that ends the last cell's list.
    cells: Pages<Cell>,
    listed: Pages<Listed>,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Cell {
    /// Height below which an opaque triangle covers the whole cell.
    covered_below: f32,
    /// Index of its first entry in `listed`; its list ends where the next cell's begins.
    first: u32,
}

/// A block with triangles over a cell.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Listed {
    /// Upper limit of the height of its triangles over the cell.
    pub(super) height: f32,
    pub(super) block: u32,
}

impl Listed {
    /// Stands for a list that is too long.
    pub(super) const TOO_MANY: Self = Self { height: f32::INFINITY, block: u32::MAX };

    pub(super) fn is_too_many(&self) -> bool {
        self.block == Self::TOO_MANY.block
    }
}

/// Margins for rounding, in the units of shapes.
#[derive(Clone, Copy)]
pub(super) struct Margins {
    /// Added on either side of a cell.
    pub(super) aside: f64,
    /// Distance from a triangle at which rays that leave it may start.
    pub(super) beside: f64,
    /// Added to heights.
    pub(super) above: f64,
    /// Added to heights, as a share of them.
    pub(super) share: f64,
}

/// The content of a cell.
pub(super) struct Over<'a> {
    /// Height below which an opaque triangle covers the whole cell.
    pub(super) covered_below: f32,
    /// Blocks over the cell, the highest first.
    pub(super) listed: &'a [Listed],
}

impl Cells {
    #[cfg(test)]
    pub(super) fn count(&self) -> usize {
        // The last cell only ends the list of the one before.
        self.cells.len() - 1
    }

    /// Prefetches the cell at a place and returns its number.
    #[inline(always)]
    pub(super) fn find(&self, at: [f32; 2]) -> usize {
        // This number is beyond the last cell.
        let cell = self.grid.cell(at).unwrap_or(self.cells.len());
        fetch_line(self.cells.as_ptr().wrapping_add(cell).cast());
        cell
    }

    /// Prefetches the list of a cell. `None` for the number of a place beyond all cells.
    #[inline(always)]
    pub(super) fn look_up(&self, cell: usize) -> Option<Over<'_>> {
        let [cell, next] = self.cells.get(cell..cell + 2)? else { return None };
        let listed = &self.listed[cell.first as usize..next.first as usize];
        fetch_line(listed.as_ptr().cast());
        Some(Over { covered_below: cell.covered_below, listed })
    }
}
