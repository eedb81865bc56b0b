//! Fills the cells: which blocks lie over which cells, and what covers them.

use std::ops::Range;

use rayon::prelude::*;

use super::shape::used;
use super::{Cell, Cells, Flat, Listed, Margins, Shape};
use crate::accel::Accel;
use crate::accel::pages::Pages;
use crate::accel::triangle_bvh::Block;

/// Greatest number of cells along a side.
const SIDE: usize = 4096;
/// Greatest number of blocks that a cell lists. Walking the tree costs as much as testing about
/// twenty.
const LISTED: u8 = 32;
/// Average number of blocks over a place beyond which there are fewer cells, to bound the time of
/// filling.
const DEEP: f64 = 64.0;
/// Number of rows that are filled together.
const BAND: usize = 16;

impl Cells {
    /// Divides a rectangle into about `count` cells, fewer where many blocks overlap, and lists the
    /// blocks over each. `shape` gives the triangle of a block's lane as the rays see it, `None` if
    /// they cannot meet it. `is_opaque` tells whether the triangles of a primitive (instance,
    /// primitive) stop all rays that do not start at them. `None` where the structure is not a
    /// single hierarchy in the world, or is empty.
    pub(in crate::accel) fn over(
        accel: &Accel,
        rectangle: &Flat,
        count: f64,
        margins: Margins,
        shape: impl Fn(&Block, usize) -> Option<Shape> + Sync,
        is_opaque: impl Fn(u32, u32) -> bool + Sync,
    ) -> Option<Self> {
        let (instance, bvh) = accel.whole()?;
        let blocks: &[Block] = &bvh.blocks;
        let is_opaque = |block: &Block, lane: usize| {
            is_opaque(instance + block.instance[lane], block.primitive[lane])
        };
        let shapes = |block| used(block).filter_map(|lane| Some((lane, shape(block, lane)?)));
        let around = |block| Flat::around(shapes(block).flat_map(|(_, shape)| shape.points));
        let bounds: Vec<_> = blocks.par_iter().map(around).collect();
        let covered: f64 = bounds.iter().map(|flat| flat.area_within(rectangle)).sum();
        let depth = covered / rectangle.area_within(rectangle);
        let count = if depth > DEEP { count * DEEP / depth } else { count };
        let grid = Grid::new(rectangle, count)?;
        let bands: Vec<_> = (0..grid.rows.div_ceil(BAND))
            .into_par_iter()
            .map(|n| {
                let rows = n * BAND..grid.rows.min((n + 1) * BAND);
                let mut band = Band::new(grid, rows, margins);
                let reach = band.reach();
                let near = || (0..).zip(blocks).zip(&bounds).filter(|(_, flat)| flat.meets(&reach));
                for ((_, block), _) in near() {
                    let opaque = shapes(block).filter(|&(lane, _)| is_opaque(block, lane));
                    opaque.for_each(|(_, shape)| band.cover(&shape));
                }
                for ((n, block), _) in near() {
                    shapes(block).for_each(|(_, shape)| band.list(n, &shape));
                }
                band.finish()
            })
            .collect();
        let (cells, listed) = joined(&bands);
        Some(Self { kernel: accel.kernel(), bvh: bvh.clone(), instance, grid, cells, listed })
    }
}

/// The grid of cells across the rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Least coordinates of the first cell.
    low: [f32; 2],
    /// Number of cells in a unit of length, along both axes.
    cells_a_unit: f32,
    columns: usize,
    rows: usize,
}

impl Grid {
    /// A grid of at most about `count` cells over a rectangle; `None` where the rectangle is not
    /// finite.
    fn new(over: &Flat, count: f64) -> Option<Self> {
        let low = over.low.map(|v| v as f32);
        let size: [f64; 2] = std::array::from_fn(|k| over.high[k] - f64::from(low[k]));
        let longest = size[0].max(size[1]);
        let side = (size[0] * size[1] / count).sqrt().max(longest / SIDE as f64);
        let cells_a_unit = (1.0 / side) as f32;
        if !(cells_a_unit.is_finite() && longest.is_finite()) {
            return None;
        }
        let [columns, rows] = size.map(|size| (size * f64::from(cells_a_unit)) as usize + 1);
        Some(Self { low, cells_a_unit, columns, rows })
    }

    /// Index of the cell at a place, row by row; `None` outside the grid.
    #[inline(always)]
    pub(super) fn cell(&self, at: [f32; 2]) -> Option<usize> {
        let [x, y] = [0, 1].map(|k| (at[k] - self.low[k]) * self.cells_a_unit);
        let is_within = x >= 0.0 && y >= 0.0 && x < self.columns as f32 && y < self.rows as f32;
        is_within.then(|| y as usize * self.columns + x as usize)
    }

    /// Side of a cell.
    fn side(&self) -> f64 {
        1.0 / f64::from(self.cells_a_unit)
    }

    /// Coordinate at which a row or column begins.
    fn line(&self, axis: usize, n: usize) -> f64 {
        f64::from(self.low[axis]) + self.side() * n as f64
    }

    /// Indices below `count` of the rows or columns that meet an interval of coordinates.
    fn indices(&self, axis: usize, [from, to]: [f64; 2], count: usize) -> Range<usize> {
        let index = |at| (at - f64::from(self.low[axis])) * f64::from(self.cells_a_unit);
        let (first, last) = (index(from), index(to));
        // The conversion turns negative numbers into 0.
        first as usize..if last < 0.0 { 0 } else { (last as usize).saturating_add(1).min(count) }
    }
}

/// A few rows of cells while they are filled.
struct Band {
    grid: Grid,
    rows: Range<usize>,
    margins: Margins,
    filled: Vec<Filling>,
    /// Blocks in the order of listing, each with its cell.
    listed: Vec<(u32, Listed)>,
}

/// A cell during filling.
#[derive(Clone, Copy)]
struct Filling {
    covered_below: f32,
    /// Index of its latest entry in `listed`.
    latest: u32,
    /// Number of its entries; at most one more than [`LISTED`].
    count: u8,
}

impl Band {
    fn new(grid: Grid, rows: Range<usize>, margins: Margins) -> Self {
        let nothing = Filling { covered_below: f32::NEG_INFINITY, latest: u32::MAX, count: 0 };
        let filled = vec![nothing; rows.len() * grid.columns];
        Self { grid, rows, margins, filled, listed: Vec::new() }
    }

    /// The rectangle of its cells, grown by the margin.
    fn reach(&self) -> Flat {
        let line = |axis, n| self.grid.line(axis, n);
        let reach = Flat {
            low: [line(0, 0), line(1, self.rows.start)],
            high: [line(0, self.grid.columns), line(1, self.rows.end)],
        };
        reach.grown(self.margins.aside)
    }

    /// The two lines that bound a row or column, moved apart by the margin.
    fn lines(&self, axis: usize, n: usize) -> [f64; 2] {
        let aside = self.margins.aside;
        [self.grid.line(axis, n) - aside, self.grid.line(axis, n + 1) + aside]
    }

    /// The band's rows that a triangle may lie in.
    fn rows_of(&self, shape: &Shape) -> Range<usize> {
        let rows = self.grid.indices(1, self.grown(shape.rows()), self.rows.end);
        rows.start.max(self.rows.start)..rows.end
    }

    fn columns(&self, between: [f64; 2]) -> Range<usize> {
        self.grid.indices(0, between, self.grid.columns)
    }

    fn grown(&self, [low, high]: [f64; 2]) -> [f64; 2] {
        [low - self.margins.aside, high + self.margins.aside]
    }

    /// The centre of a cell, and the greatest distance along an axis of points that look it up.
    fn middle(&self, row: usize, column: usize) -> ([f64; 2], f64) {
        let half = 0.5 * self.grid.side();
        let at = [self.grid.line(0, column) + half, self.grid.line(1, row) + half];
        (at, half + self.margins.aside)
    }

    fn cell(&self, row: usize, column: usize) -> usize {
        (row - self.rows.start) * self.grid.columns + column
    }

    /// Covers the cells that an opaque triangle fills.
    fn cover(&mut self, shape: &Shape) {
        if !shape.has_slope() {
            return;
        }
        let Margins { beside, above, share, .. } = self.margins;
        let margin = above + beside + shape.rise_within(beside);
        for row in self.rows_of(shape) {
            let [left, right] = shape.filled(self.lines(1, row));
            if left >= right {
                continue;
            }
            for column in self.columns([left, right]) {
                let [from, to] = self.lines(0, column);
                if from < left || to > right {
                    continue;
                }
                let ([x, y], reach) = self.middle(row, column);
                let height = shape.height_at(x, y) - shape.rise_within(reach);
                let height = below(height - margin - share * height.abs());
                let cell = self.cell(row, column);
                let covered_below = &mut self.filled[cell].covered_below;
                *covered_below = covered_below.max(height);
            }
        }
    }

    /// Lists a block for the cells that one of its triangles touches, except where a cover lies
    /// above it. All triangles of a block must be listed one after the other.
    fn list(&mut self, block: u32, shape: &Shape) {
        let highest = shape.highest();
        let Margins { above: margin, share, .. } = self.margins;
        for row in self.rows_of(shape) {
            let [left, right] = shape.between(self.lines(1, row));
            if left > right {
                continue;
            }
            for column in self.columns(self.grown([left, right])) {
                let ([x, y], reach) = self.middle(row, column);
                // `min` ignores a height that is NaN.
                let here = highest.min(shape.height_at(x, y) + shape.rise_within(reach));
                let height = above(here + margin + share * here.abs());
                let n = self.cell(row, column);
                let cell = &mut self.filled[n];
                if height < cell.covered_below || cell.count > LISTED {
                    continue;
                }
                match self.listed.get_mut(cell.latest as usize) {
                    Some((_, last)) if last.block == block => last.height = last.height.max(height),
                    _ => {
                        cell.latest = self.listed.len() as u32;
                        cell.count += 1;
                        self.listed.push((n as u32, Listed { height, block }));
                    }
                }
            }
        }
    }

    /// Its cells, with list starts relative to the band, and their entries, each cell's highest
    /// first.
    fn finish(mut self) -> (Vec<Cell>, Vec<Listed>) {
        self.listed.sort_unstable_by(|(cell, a), (other, b)| {
            cell.cmp(other).then(b.height.total_cmp(&a.height)).then(a.block.cmp(&b.block))
        });
        let mut rest = self.listed.as_slice();
        let mut listed = Vec::with_capacity(rest.len());
        let cells = self.filled.iter().map(|cell| {
            let first = listed.len() as u32;
            let (over, others) = rest.split_at(usize::from(cell.count));
            rest = others;
            if cell.count <= LISTED {
                listed.extend(over.iter().map(|(_, listed)| *listed));
            } else {
                listed.push(Listed::TOO_MANY);
            }
            Cell { covered_below: cell.covered_below, first }
        });
        (cells.collect(), listed)
    }
}

/// The greatest f32 that is not above the number.
fn below(number: f64) -> f32 {
    let near = number as f32;
    if f64::from(near) > number { near.next_down() } else { near }
}

/// The least f32 that is not below the number.
fn above(number: f64) -> f32 {
    -below(-number)
}

/// The cells and entries of all bands, and the cell that ends the last list.
fn joined(bands: &[(Vec<Cell>, Vec<Listed>)]) -> (Pages<Cell>, Pages<Listed>) {
    let sum = |of: fn(&(Vec<Cell>, Vec<Listed>)) -> usize| bands.iter().map(of).sum();
    let cell_count: usize = sum(|(cells, _)| cells.len());
    let listed_count: usize = sum(|(_, listed)| listed.len());
    let mut cells = Pages::zeroed(cell_count + 1);
    let mut listed = Pages::zeroed(listed_count);
    let (mut cell, mut at) = (0, 0);
    for (of_band, lists) in bands {
        for (to, from) in cells[cell..].iter_mut().zip(of_band) {
            *to = Cell { first: from.first + at as u32, ..*from };
        }
        listed[at..at + lists.len()].copy_from_slice(lists);
        cell += of_band.len();
        at += lists.len();
    }
    cells[cell] = Cell { covered_below: f32::NEG_INFINITY, first: at as u32 };
    (cells, listed)
}
