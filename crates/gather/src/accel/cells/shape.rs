//! A triangle as seen by rays of one kind.

use crate::accel::triangle_bvh::{Block, LANES};

/// Lanes that hold a triangle.
pub(super) fn used(block: &Block) -> impl Iterator<Item = usize> + use<> {
    let is_used = block.is_used();
    (0..LANES).filter(move |&lane| is_used[lane])
}

/// Corners of a lane's triangle.
pub(in crate::accel) fn corners(block: &Block, lane: usize) -> [[f64; 3]; 3] {
    block.corners.map(|corner| corner.map(|lanes| f64::from(lanes[lane])))
}

/// A rectangle in the plane across the rays.
#[derive(Clone, Copy, Debug)]
pub(in crate::accel) struct Flat {
    pub(in crate::accel) low: [f64; 2],
    pub(in crate::accel) high: [f64; 2],
}

impl Flat {
    pub(in crate::accel) const NOTHING: Self =
        Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };

    /// The rectangle around points, whose heights are ignored.
    pub(in crate::accel) fn around(points: impl Iterator<Item = [f64; 3]>) -> Self {
        points.fold(Self::NOTHING, |all, [x, y, _]| all.union(&Self { low: [x, y], high: [x, y] }))
    }

    pub(in crate::accel) fn union(self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|k| self.low[k].min(other.low[k])),
            high: std::array::from_fn(|k| self.high[k].max(other.high[k])),
        }
    }

    pub(in crate::accel) fn grown(self, by: f64) -> Self {
        Self { low: self.low.map(|v| v - by), high: self.high.map(|v| v + by) }
    }

    pub(in crate::accel) fn meets(&self, other: &Self) -> bool {
        (0..2).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    /// Area of the intersection with another rectangle.
    pub(super) fn area_within(&self, other: &Self) -> f64 {
        let side = |k: usize| self.high[k].min(other.high[k]) - self.low[k].max(other.low[k]);
        side(0).max(0.0) * side(1).max(0.0)
    }
}

/// The visible part of a triangle: three corners or, where it was clipped, four.
pub(in crate::accel) struct Shape {
    /// Corners: two coordinates across the rays and the height. Of three corners, the last is
    /// repeated.
    pub(super) points: [[f64; 3]; 4],
    /// Slopes of the height across the shape; not finite where it is seen edge-on.
    slope: [f64; 2],
}

impl Shape {
    /// A whole triangle, given by its corners.
    pub(in crate::accel) fn new([a, b, c]: [[f64; 3]; 3]) -> Self {
        let from_first = |point: [f64; 3]| [0, 1, 2].map(|k| point[k] - a[k]);
        let ([bx, by, bh], [cx, cy, ch]) = (from_first(b), from_first(c));
        let area = bx * cy - cx * by;
        let slope = [(bh * cy - ch * by) / area, (bx * ch - cx * bh) / area];
        Self { points: [a, b, c, c], slope }
    }

    /// A clipped triangle: three or four points in order, and the slopes of its height.
    pub(in crate::accel) fn rest(points: [[f64; 3]; 4], slope: [f64; 2]) -> Self {
        Self { points, slope }
    }

    /// A shape that stands for anything in a rectangle, at any height.
    pub(in crate::accel) fn anywhere(within: &Flat) -> Self {
        let Flat { low: [left, low], high: [right, high] } = *within;
        let top = f64::INFINITY;
        let points = [[left, low, top], [right, low, top], [right, high, top], [left, high, top]];
        Self { points, slope: [f64::NAN; 2] }
    }

    fn edges(&self) -> impl Iterator<Item = [[f64; 3]; 2]> + '_ {
        [[0, 1], [1, 2], [2, 3], [3, 0]].into_iter().map(|edge| edge.map(|n| self.points[n]))
    }

    /// The x at which its edges cross a line of constant y.
    fn crossings(&self, y: f64) -> impl Iterator<Item = f64> + '_ {
        self.edges()
            .filter(move |[a, b]| (a[1] < y) != (b[1] < y))
            .map(move |[a, b]| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
    }

    /// Its extent along the y axis.
    pub(super) fn rows(&self) -> [f64; 2] {
        around(self.points.iter().map(|p| p[1]))
    }

    /// Its extent along the x axis between two lines of constant y.
    pub(super) fn between(&self, [low, high]: [f64; 2]) -> [f64; 2] {
        let inside = self.points.iter().filter(|p| low <= p[1] && p[1] <= high).map(|p| p[0]);
        around(inside.chain(self.crossings(low)).chain(self.crossings(high)))
    }

    /// The interval of x that it fills entirely between two lines of constant y.
    pub(super) fn filled(&self, lines: [f64; 2]) -> [f64; 2] {
        let [a, b] = lines.map(|y| around(self.crossings(y)));
        [a[0].max(b[0]), a[1].min(b[1])]
    }

    /// Whether its height is known at every place.
    pub(super) fn has_slope(&self) -> bool {
        self.slope.iter().all(|slope| slope.is_finite())
    }

    pub(super) fn height_at(&self, x: f64, y: f64) -> f64 {
        let [x0, y0, h0] = self.points[0];
        h0 + self.slope[0] * (x - x0) + self.slope[1] * (y - y0)
    }

    /// Greatest difference of its height within `reach` along each axis.
    pub(super) fn rise_within(&self, reach: f64) -> f64 {
        reach * (self.slope[0].abs() + self.slope[1].abs())
    }

    pub(super) fn highest(&self) -> f64 {
        self.points.iter().fold(f64::NEG_INFINITY, |highest, p| highest.max(p[2]))
    }
}

/// The least and the greatest number; (∞, −∞) of none.
fn around(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    numbers.fold(nothing, |[low, high], number| [low.min(number), high.max(number)])
}
