//! Triangles that lie over each other.

use std::ops::Range;

use glam::{DVec2, Vec2};

/// The unit square is looked at by so many lumels a side.
const LOOKED_AT: u32 = 1024;

/// A middle nearer to an edge than this share of the triangle is left to its neighbour.
const WITHIN: f64 = 1e-2;
const WORD: u32 = u64::BITS;

/// Lumels whose middles lie well within triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Within {
    /// Within any.
    pub(crate) all: u32,
    /// Within two or more: none unless charts overlap.
    pub(crate) twice: u32,
}

/// Counts the lumels that triangles hold, and those that several do, of 1024² in the unit square.
pub(crate) fn overlaps(corners: impl Iterator<Item = [Vec2; 3]>) -> Within {
    let words = (LOOKED_AT * LOOKED_AT / WORD) as usize;
    let (mut once, mut twice) = (vec![0_u64; words], vec![0_u64; words]);
    for triangle in corners.filter_map(Triangle::new) {
        for row in triangle.rows() {
            let columns = triangle.columns(row);
            for word in columns.start / WORD..columns.end.div_ceil(WORD) {
                let at = (row * (LOOKED_AT / WORD) + word) as usize;
                let held = bits(&columns, word * WORD);
                twice[at] |= once[at] & held;
                once[at] |= held;
            }
        }
    }
    let count = |words: &[u64]| words.iter().map(|word| word.count_ones()).sum();
    Within { all: count(&once), twice: count(&twice) }
}

/// The bits of a word that begins at a column, those of `columns`.
fn bits(columns: &Range<u32>, first: u32) -> u64 {
    let below = |column: u32| match column.saturating_sub(first) {
        bits @ 0..WORD => (1 << bits) - 1,
        _ => u64::MAX,
    };
    below(columns.end) & !below(columns.start)
}

/// A triangle of some area.
struct Triangle {
    corners: [DVec2; 3],
    /// Twice the area, below 0 where corners run clockwise.
    twice: f64,
}

impl Triangle {
    /// One whose corners lie in the unit square, in lumels.
    fn new(corners: [Vec2; 3]) -> Option<Self> {
        let corners @ [a, b, c] = corners.map(|at| f64::from(LOOKED_AT) * at.as_dvec2());
        let twice = (b - a).perp_dot(c - a);
        (twice.abs() > 0.0 && twice.is_finite()).then_some(Self { corners, twice })
    }

    /// Rows that it touches.
    fn rows(&self) -> Range<u32> {
        let [a, b, c] = self.corners.map(|corner| corner.y);
        let (low, high) = (a.min(b).min(c).floor(), a.max(b).max(c).ceil());
        low as u32..(high as u32).min(LOOKED_AT)
    }

    /// Columns of a row whose middles lie well within.
    fn columns(&self, row: u32) -> Range<u32> {
        let (mut low, mut high) = (0.0_f64, f64::from(LOOKED_AT));
        for k in 0..3 {
            let (from, to) = (self.corners[(k + 1) % 3], self.corners[(k + 2) % 3]);
            let edge = (to - from) / self.twice;
            // The barycentric weight of corner k is linear along the row, and is at least WITHIN from
            // this column on, or up to it.
            let first = edge.perp_dot(DVec2::new(0.5, f64::from(row) + 0.5) - from);
            let column = (first - WITHIN) / edge.y;
            if edge.y < 0.0 {
                low = low.max(column.ceil());
            } else if edge.y > 0.0 {
                high = high.min(column.floor() + 1.0);
            } else if first < WITHIN {
                return 0..0;
            }
        }
        low as u32..high as u32
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;
    use crate::raster::barycentric;

    /// [`super::overlaps`] of triangles whose corners are in lumels.
    fn overlaps(corners: impl Iterator<Item = [Vec2; 3]>) -> Within {
        super::overlaps(corners.map(|triangle| triangle.map(|at| at / LOOKED_AT as f32)))
    }

    /// Corners spread over the square and beyond it.
    fn corners(seed: u32) -> [Vec2; 3] {
        let number = |k: u32| (seed * 6 + k).wrapping_mul(0x9E37_79B9) as f32 / u32::MAX as f32;
        let place = |k: u32| 1.2 * LOOKED_AT as f32 * (number(k) - 0.1);
        [0, 2, 4].map(|k| Vec2::new(place(k), place(k + 1)))
    }

    #[test]
    fn lumels_are_those_whose_middles_lie_well_within() {
        let mut all = 0;
        for seed in 0..8 {
            let corners = corners(seed);
            let least = |at: UVec2| barycentric(corners, at.as_vec2() + 0.5).min_element();
            let lumels = (0..LOOKED_AT).flat_map(|y| (0..LOOKED_AT).map(move |x| UVec2::new(x, y)));
            let weights: Vec<f32> = lumels.map(least).collect();
            let of = |within: f32| weights.iter().filter(|least| **least >= within).count() as u32;
            let found = overlaps([corners].into_iter());
            let rounding = 1e-4;
            let (within, close) = (of(WITHIN as f32 + rounding), of(WITHIN as f32 - rounding));
            assert!((within..=close).contains(&found.all), "{corners:?}: {found:?} {within}");
            assert_eq!(found.twice, 0);
            all += found.all;
        }
        assert!(all > LOOKED_AT * LOOKED_AT / 2, "{all}");
    }

    #[test]
    fn what_lies_over_each_other_is_counted_and_what_shares_an_edge_is_not() {
        let [a, b, c, d] = [(0.0, 0.0), (640.0, 0.0), (640.0, 640.0), (0.0, 640.0)].map(Vec2::from);
        let square = [[a, b, c], [c, d, a]];
        let apart = overlaps(square.into_iter());
        assert_eq!(apart.twice, 0, "{apart:?}");
        // Each side is nearer to the middle by a hundredth of the height over it.
        let inner = (1.0 - 3.0 * WITHIN).powi(2) * 640.0 * 640.0;
        assert!((f64::from(apart.all) - inner).abs() < 5e-3 * inner, "{apart:?} {inner}");
        let moved = square[1].map(|at| at + Vec2::new(64.0, 0.0));
        let over = overlaps([square[0], moved].into_iter());
        assert!((26_000..36_864).contains(&over.twice), "{over:?}");
        let mirrored = overlaps(square.into_iter().chain([[a, c, b]]));
        assert_eq!(mirrored.twice * 2, mirrored.all, "{mirrored:?}");
    }

    #[test]
    fn what_has_no_area_or_lies_outside_holds_nothing() {
        let line = [Vec2::ZERO, Vec2::splat(4.0), Vec2::splat(8.0)];
        let beyond = [(2000.0, 0.0), (3000.0, 0.0), (2000.0, 900.0)].map(Vec2::from);
        let below = beyond.map(|at| -at);
        let broken = [Vec2::NAN, Vec2::ZERO, Vec2::X];
        assert_eq!(overlaps([line, beyond, below, broken].into_iter()), Within::default());
    }
}
