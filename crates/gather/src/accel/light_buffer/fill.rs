//! Which blocks lie over which cells of a light buffer, and what covers them.

use std::ops::Range;

use rayon::prelude::*;

use super::{Blocker, Cell};
use crate::accel::kernel::Setup;
use crate::accel::pages::Pages;
use crate::accel::triangle_bvh::{Block, LANES};

/// Cells a leaf's place for a triangle. Four times as many, or half as many, trace as fast; filling
/// takes 2.2 or 0.7 times as long.
const CELLS: f64 = 1.0;
/// Most cells along a side.
const SIDE: usize = 4096;
/// Most blocks that a cell lists: to walk the tree takes as long as to test some twenty.
const LISTED: usize = 32;
/// Rows that are filled together.
const BAND: usize = 16;

/// The cells, and one that ends the last one's list; and what lies over each.
pub(super) struct Filled {
    pub(super) grid: Grid,
    pub(super) cells: Pages<Cell>,
    pub(super) blockers: Pages<Blocker>,
}

/// Finds what lies over cells across all blocks. `None` where there are none to speak of.
pub(super) fn over(
    blocks: &[Block],
    setup: &Setup,
    margins: Margins,
    is_opaque: impl Fn(&Block, usize) -> bool + Sync,
) -> Option<Filled> {
    let bounds: Vec<_> = blocks.par_iter().map(|block| Flat::around(block, setup)).collect();
    let all = bounds.iter().fold(Flat::NOTHING, Flat::union);
    let margin = 4.0 * margins.aside + f64::from(f32::MIN_POSITIVE);
    let grid = Grid::new(&all.grown(margin), CELLS * (blocks.len() * LANES) as f64)?;
    let bands: Vec<_> = (0..grid.rows.div_ceil(BAND))
        .into_par_iter()
        .map(|n| {
            let rows = n * BAND..grid.rows.min((n + 1) * BAND);
            let mut band = Band::new(grid, rows, margins);
            let [low, high] = band.reach();
            let is_near = |flat: &Flat| flat.low[1] <= high && flat.high[1] >= low;
            let near = || (0..).zip(blocks).zip(&bounds).filter(|(_, flat)| is_near(flat));
            for ((_, block), _) in near() {
                let opaque = used(block).filter(|&lane| is_opaque(block, lane));
                opaque.for_each(|lane| band.cover(&Shape::new(block, lane, setup)));
            }
            for ((n, block), _) in near() {
                used(block).for_each(|lane| band.list(n, &Shape::new(block, lane, setup)));
            }
            band.finish()
        })
        .collect();
    let (cells, blockers) = joined(&bands);
    Some(Filled { grid, cells, blockers })
}

/// Lanes that hold a triangle.
fn used(block: &Block) -> impl Iterator<Item = usize> + use<> {
    let is_used = block.is_used();
    (0..LANES).filter(move |&lane| is_used[lane])
}

/// What is allowed for rounding, metres.
#[derive(Clone, Copy)]
pub(super) struct Margins {
    /// On either side of a cell.
    aside: f64,
    /// Beside a triangle at which rays start.
    beside: f64,
}

impl Margins {
    /// In a scene without coordinates beyond `extent`, whose rays start up to `slack` beside their
    /// triangle along each axis.
    pub(super) fn new(extent: f64, slack: f64) -> Self {
        // Of a few roundings of coordinates, each sheared by at most one.
        let aside = 32.0 * f64::from(f32::EPSILON) * extent;
        Self { aside, beside: aside + 2.0 * slack }
    }
}

/// A rectangle across the rays.
#[derive(Clone, Copy)]
struct Flat {
    low: [f64; 2],
    high: [f64; 2],
}

impl Flat {
    const NOTHING: Self = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };

    /// Around a block's triangles.
    fn around(block: &Block, setup: &Setup) -> Self {
        let points = used(block).flat_map(|lane| Shape::new(block, lane, setup).points);
        points.fold(Self::NOTHING, |all, [x, y, _]| all.union(&Self { low: [x, y], high: [x, y] }))
    }

    fn union(self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|k| self.low[k].min(other.low[k])),
            high: std::array::from_fn(|k| self.high[k].max(other.high[k])),
        }
    }

    fn grown(self, by: f64) -> Self {
        Self { low: self.low.map(|v| v - by), high: self.high.map(|v| v + by) }
    }
}

/// A triangle as the rays see it.
struct Shape {
    /// Across, and the height.
    points: [[f64; 3]; 3],
    /// How its height grows across it; not finite where it is seen from its edge.
    slope: [f64; 2],
}

impl Shape {
    fn new(block: &Block, lane: usize, setup: &Setup) -> Self {
        let shear = setup.shear.map(f64::from);
        let points: [[f64; 3]; 3] = std::array::from_fn(|vertex| {
            let corner = setup.axes.map(|axis| f64::from(block.corners[vertex][axis][lane]));
            let [x, y, z] = corner;
            [x - shear[0] * z, y - shear[1] * z, z * shear[2]]
        });
        let from_first = |point: [f64; 3]| [0, 1, 2].map(|k| point[k] - points[0][k]);
        let ([ax, ay, ah], [bx, by, bh]) = (from_first(points[1]), from_first(points[2]));
        let area = ax * by - bx * ay;
        let slope = [(ah * by - bh * ay) / area, (ax * bh - bx * ah) / area];
        Self { points, slope }
    }

    fn edges(&self) -> impl Iterator<Item = [[f64; 3]; 2]> + '_ {
        [[0, 1], [1, 2], [2, 0]].into_iter().map(|edge| edge.map(|n| self.points[n]))
    }

    /// Where a row's line crosses its edges.
    fn crossings(&self, y: f64) -> impl Iterator<Item = f64> + '_ {
        self.edges()
            .filter(move |[a, b]| (a[1] < y) != (b[1] < y))
            .map(move |[a, b]| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
    }

    /// What it takes up of the x axis between two rows' lines.
    fn between(&self, [low, high]: [f64; 2]) -> [f64; 2] {
        let inside = self.points.iter().filter(|p| low <= p[1] && p[1] <= high).map(|p| p[0]);
        around(inside.chain(self.crossings(low)).chain(self.crossings(high)))
    }

    /// What of the x axis it fills between two rows' lines.
    fn filled(&self, lines: [f64; 2]) -> [f64; 2] {
        let [a, b] = lines.map(|y| around(self.crossings(y)));
        [a[0].max(b[0]), a[1].min(b[1])]
    }

    fn height_at(&self, x: f64, y: f64) -> f64 {
        let [x0, y0, h0] = self.points[0];
        h0 + self.slope[0] * (x - x0) + self.slope[1] * (y - y0)
    }

    /// How much its height may differ within so much of a place.
    fn rise_within(&self, reach: f64) -> f64 {
        reach * (self.slope[0].abs() + self.slope[1].abs())
    }

    fn highest(&self) -> f64 {
        self.points.iter().fold(f64::NEG_INFINITY, |highest, p| highest.max(p[2]))
    }
}

/// The least and the greatest; (∞, −∞) of none.
fn around(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    numbers.fold(nothing, |[low, high], number| [low.min(number), high.max(number)])
}

/// Where cells lie across the rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Least coordinates of the first cell.
    low: [f32; 2],
    /// Along either side.
    cells_per_metre: f32,
    columns: usize,
    rows: usize,
}

impl Grid {
    /// Of so many cells over a rectangle, or fewer; `None` where that is not finite.
    fn new(over: &Flat, count: f64) -> Option<Self> {
        let low = over.low.map(|v| v as f32);
        let size: [f64; 2] = std::array::from_fn(|k| over.high[k] - f64::from(low[k]));
        let longest = size[0].max(size[1]);
        let side = (size[0] * size[1] / count).sqrt().max(longest / SIDE as f64);
        let cells_per_metre = (1.0 / side) as f32;
        if !(cells_per_metre.is_finite() && longest.is_finite()) {
            return None;
        }
        let [columns, rows] = size.map(|size| (size * f64::from(cells_per_metre)) as usize + 1);
        Some(Self { low, cells_per_metre, columns, rows })
    }

    /// The cell at a place, row by row; `None` beyond them.
    #[inline(always)]
    pub(super) fn cell(&self, at: [f32; 2]) -> Option<usize> {
        let [x, y] = [0, 1].map(|k| (at[k] - self.low[k]) * self.cells_per_metre);
        let is_within = x >= 0.0 && y >= 0.0 && x < self.columns as f32 && y < self.rows as f32;
        is_within.then(|| y as usize * self.columns + x as usize)
    }

    /// Of a cell, metres.
    fn side(&self) -> f64 {
        1.0 / f64::from(self.cells_per_metre)
    }

    /// Where a row or column begins.
    fn line(&self, axis: usize, n: usize) -> f64 {
        f64::from(self.low[axis]) + self.side() * n as f64
    }

    /// The row or column that a coordinate lies in, of so many; the first or last one for all beyond.
    fn index(&self, axis: usize, at: f64, count: usize) -> usize {
        let n = (at - f64::from(self.low[axis])) * f64::from(self.cells_per_metre);
        (n as usize).min(count - 1)
    }
}

/// A few rows of cells while they are filled.
struct Band {
    grid: Grid,
    rows: Range<usize>,
    margins: Margins,
    /// Of each cell, below which all is in shadow.
    covered: Vec<f32>,
    blockers: Vec<(u32, Blocker)>,
    /// Each cell's last one of them.
    last: Vec<u32>,
}

impl Band {
    fn new(grid: Grid, rows: Range<usize>, margins: Margins) -> Self {
        let count = rows.len() * grid.columns;
        Self {
            grid,
            rows,
            margins,
            covered: vec![f32::NEG_INFINITY; count],
            blockers: Vec::new(),
            last: vec![u32::MAX; count],
        }
    }

    /// The least and the greatest coordinate that matter to it.
    fn reach(&self) -> [f64; 2] {
        let aside = self.margins.aside;
        [self.grid.line(1, self.rows.start) - aside, self.grid.line(1, self.rows.end) + aside]
    }

    /// The lines on both sides of a row or column, moved apart by the margin.
    fn lines(&self, axis: usize, n: usize) -> [f64; 2] {
        let aside = self.margins.aside;
        [self.grid.line(axis, n) - aside, self.grid.line(axis, n + 1) + aside]
    }

    /// Those of its rows that a triangle may lie in.
    fn rows_of(&self, shape: &Shape) -> Range<usize> {
        let [low, high] = around(shape.points.iter().map(|p| p[1]));
        let row = |y| self.grid.index(1, y, self.rows.end);
        row(low - self.margins.aside).max(self.rows.start)..row(high + self.margins.aside) + 1
    }

    /// The middle of a cell, and how far a point for which it is looked up may be from there.
    fn middle(&self, row: usize, column: usize) -> ([f64; 2], f64) {
        let half = 0.5 * self.grid.side();
        let at = [self.grid.line(0, column) + half, self.grid.line(1, row) + half];
        (at, half + self.margins.aside)
    }

    fn cell(&self, row: usize, column: usize) -> usize {
        (row - self.rows.start) * self.grid.columns + column
    }

    /// Puts what an opaque triangle fills in shadow.
    fn cover(&mut self, shape: &Shape) {
        if !shape.slope.iter().all(|slope| slope.is_finite()) {
            return;
        }
        let Margins { beside, .. } = self.margins;
        let margin = beside + shape.rise_within(beside);
        for row in self.rows_of(shape) {
            let [left, right] = shape.filled(self.lines(1, row));
            if left >= right {
                continue;
            }
            let columns = self.grid.index(0, left, self.grid.columns)
                ..self.grid.index(0, right, self.grid.columns) + 1;
            for column in columns {
                let [from, to] = self.lines(0, column);
                if from < left || to > right {
                    continue;
                }
                let ([x, y], reach) = self.middle(row, column);
                let height = shape.height_at(x, y) - shape.rise_within(reach) - margin;
                let cell = self.cell(row, column);
                self.covered[cell] = self.covered[cell].max(below(height));
            }
        }
    }

    /// Lists a block over the cells that one of its triangles touches, but for those covered above
    /// it. All triangles of a block must follow each other.
    fn list(&mut self, block: u32, shape: &Shape) {
        let highest = shape.highest();
        let aside = self.margins.aside;
        for row in self.rows_of(shape) {
            let [left, right] = shape.between(self.lines(1, row));
            if left > right {
                continue;
            }
            let column = |x| self.grid.index(0, x, self.grid.columns);
            for column in column(left - aside)..=column(right + aside) {
                let ([x, y], reach) = self.middle(row, column);
                // Passes over what is no number.
                let here = highest.min(shape.height_at(x, y) + shape.rise_within(reach));
                let height = above(here + self.margins.aside);
                let cell = self.cell(row, column);
                if height < self.covered[cell] {
                    continue;
                }
                match self.blockers.get_mut(self.last[cell] as usize) {
                    Some((_, last)) if last.block == block => last.height = last.height.max(height),
                    _ => {
                        self.last[cell] = self.blockers.len() as u32;
                        self.blockers.push((cell as u32, Blocker { height, block }));
                    }
                }
            }
        }
    }

    /// Its cells, whose lists begin at 0, and their blockers, each cell's highest first.
    fn finish(mut self) -> (Vec<Cell>, Vec<Blocker>) {
        self.blockers.sort_unstable_by(|(cell, a), (other, b)| {
            cell.cmp(other).then(b.height.total_cmp(&a.height)).then(a.block.cmp(&b.block))
        });
        let mut rest = self.blockers.as_slice();
        let mut listed = Vec::with_capacity(rest.len());
        let cells = (0..).zip(&self.covered).map(|(cell, &covered_below)| {
            let first = listed.len() as u32;
            let count = rest.iter().take_while(|(of, _)| *of == cell).count();
            let (over, others) = rest.split_at(count);
            rest = others;
            if count <= LISTED {
                listed.extend(over.iter().map(|(_, blocker)| *blocker));
            } else {
                listed.push(Blocker::TOO_MANY);
            }
            Cell { covered_below, first }
        });
        (cells.collect(), listed)
    }
}

/// A number of 32 bits that is not greater.
fn below(number: f64) -> f32 {
    let near = number as f32;
    if f64::from(near) > number { near.next_down() } else { near }
}

/// A number of 32 bits that is not less.
fn above(number: f64) -> f32 {
    -below(-number)
}

/// All bands' cells and blockers, and the cell that ends the last one's list.
fn joined(bands: &[(Vec<Cell>, Vec<Blocker>)]) -> (Pages<Cell>, Pages<Blocker>) {
    let sum = |of: fn(&(Vec<Cell>, Vec<Blocker>)) -> usize| bands.iter().map(of).sum();
    let cell_count: usize = sum(|(cells, _)| cells.len());
    let blocker_count: usize = sum(|(_, blockers)| blockers.len());
    let mut cells = Pages::zeroed(cell_count + 1);
    let mut blockers = Pages::zeroed(blocker_count);
    let (mut cell, mut blocker) = (0, 0);
    for (of_band, listed) in bands {
        for (to, from) in cells[cell..].iter_mut().zip(of_band) {
            *to = Cell { first: from.first + blocker as u32, ..*from };
        }
        blockers[blocker..blocker + listed.len()].copy_from_slice(listed);
        cell += of_band.len();
        blocker += listed.len();
    }
    cells[cell] = Cell { covered_below: f32::NEG_INFINITY, first: blocker as u32 };
    (cells, blockers)
}
