//! Binned splits: the cheapest of a few planes across each axis.

use std::ops::Range;

use glam::{Mat3A, Vec3A, Vec3Swizzles};
use rayon::prelude::*;

use super::super::Aabb;
use super::{Extent, Item, LARGE, PARALLEL};

/// Number of bins along each axis.
const MANY: usize = 16;
/// Number of bins for ranges of fewer than [`SMALL`] items. Most ranges are small, and sweeping
/// over bins takes time.
const FEW: usize = 8;
const SMALL: usize = 48;

/// A splitting plane between two bins.
pub(super) struct Plane {
    binning: Binning,
    /// The first bin on its right, as a number of [`Binning::place`]; −∞ for the other axes.
    first_right: Vec3A,
    /// Box around the items of each side, and their number of things.
    pub(super) sides: [(Aabb, f32); 2],
}

impl Plane {
    /// The cheapest plane and its cost: the number of full leaves times half the area of their box,
    /// summed over both sides. The cost is infinite where all centres coincide.
    pub(super) fn cheapest(items: &[Item], extent: &Extent, leaf: f32) -> (f32, Self) {
        if items.len() < SMALL {
            let binning = Binning::new(&extent.centers, FEW);
            Bins::<FEW>::of(items, &binning).cheapest(binning, leaf)
        } else {
            let binning = Binning::new(&extent.centers, MANY);
            Bins::<MANY>::of(items, &binning).cheapest(binning, leaf)
        }
    }

    /// Whether an item lies to its left.
    #[inline]
    pub(super) fn is_left(&self, item: &Item) -> bool {
        self.binning.place(item).cmplt(self.first_right).any()
    }
}

/// 2²³: from here to twice as much, all f32 are integers.
const INTEGERS: f32 = 8_388_608.0;

/// Maps items to bins by their centres.
#[derive(Clone, Copy)]
struct Binning {
    origin: Vec3A,
    scale: Vec3A,
    /// The last bin along each axis.
    last: Vec3A,
}

impl Binning {
    fn new(centers: &Aabb, bins: usize) -> Self {
        let extent = (centers.max - centers.min).max(Vec3A::splat(f32::MIN_POSITIVE));
        let scale = (bins as f32 * 0.9999 / extent).min(Vec3A::splat(f32::MAX));
        Self { origin: centers.min, scale, last: Vec3A::splat(bins as f32 - 1.0) }
    }

    /// The bin along each axis, plus 2²³. The addition rounds to the nearest integer and leaves it
    /// in the lowest bits. Conversions that saturate take several times as long.
    #[inline]
    fn place(&self, item: &Item) -> Vec3A {
        let place = (item.center_twice() - self.origin) * self.scale - 0.5;
        place.clamp(Vec3A::ZERO, self.last) + INTEGERS
    }
}

/// Boxes and numbers of things in each bin, along each axis.
struct Bins<const N: usize> {
    bounds: [[Aabb; 3]; N],
    counts: [Vec3A; N],
}

impl<const N: usize> Bins<N> {
    const EMPTY: Self = Self { bounds: [[Aabb::EMPTY; 3]; N], counts: [Vec3A::ZERO; N] };

    fn of(items: &[Item], binning: &Binning) -> Self {
        if items.len() >= LARGE {
            let chunks = items.par_chunks(2 * PARALLEL);
            return chunks.map(|c| Self::of(c, binning)).reduce(|| Self::EMPTY, Self::merged);
        }
        let mut bins = Self::EMPTY;
        for item in items {
            let (bounds, count) = (item.bounds(), item.count() as f32);
            for (axis, bin) in binning.place(item).to_array().into_iter().enumerate() {
                let bin = bin.to_bits() as usize & (N - 1);
                let around = &mut bins.bounds[bin][axis];
                *around = around.union(bounds);
                bins.counts[bin][axis] += count;
            }
        }
        bins
    }

    fn merged(mut self, other: Self) -> Self {
        for (a, b) in self.bounds.iter_mut().flatten().zip(other.bounds.iter().flatten()) {
            *a = a.union(*b);
        }
        for (a, b) in self.counts.iter_mut().zip(other.counts) {
            *a += b;
        }
        self
    }

    /// The cheapest plane along any axis, and its cost times area; infinite where there is none.
    fn cheapest(&self, binning: Binning, leaf: f32) -> (f32, Plane) {
        // All axes are computed at once. The area of an empty side comes out infinite.
        let mut above = [Vec3A::ZERO; N];
        let mut side = Sides::EMPTY;
        for bin in (1..N).rev() {
            side.grow(&self.bounds[bin], self.counts[bin]);
            above[bin] = side.cost(leaf);
        }
        let mut least = Vec3A::INFINITY;
        let mut first_above = Vec3A::ZERO;
        let mut side = Sides::EMPTY;
        for (bin, above) in above.into_iter().enumerate().skip(1) {
            side.grow(&self.bounds[bin - 1], self.counts[bin - 1]);
            let cost = side.cost(leaf) + above;
            let is_less = cost.cmplt(least);
            least = Vec3A::select(is_less, cost, least);
            first_above = Vec3A::select(is_less, Vec3A::splat(bin as f32), first_above);
        }
        let cost = least.min_element();
        let axis = (0..3).find(|&axis| least[axis] == cost).unwrap_or(0);
        let bin = first_above[axis] as usize;
        let around = |range: Range<usize>| {
            range.fold((Aabb::EMPTY, 0.0), |(bounds, count), bin| {
                (bounds.union(self.bounds[bin][axis]), count + self.counts[bin][axis])
            })
        };
        let sides = [around(0..bin), around(bin..N)];
        let mut first_right = Vec3A::NEG_INFINITY;
        first_right[axis] = bin as f32 + INTEGERS;
        (cost, Plane { binning, first_right, sides })
    }
}

/// Contents of one side of three planes, one across each axis.
struct Sides {
    bounds: [Aabb; 3],
    count: Vec3A,
}

impl Sides {
    const EMPTY: Self = Self { bounds: [Aabb::EMPTY; 3], count: Vec3A::ZERO };

    fn grow(&mut self, bounds: &[Aabb; 3], count: Vec3A) {
        for (side, bounds) in self.bounds.iter_mut().zip(bounds) {
            *side = side.union(*bounds);
        }
        self.count += count;
    }

    /// Cost of the side for each axis, as in [`Plane::cheapest`].
    fn cost(&self, leaf: f32) -> Vec3A {
        let faces = |bounds: &Aabb| {
            let size = bounds.max - bounds.min;
            size * size.yzx()
        };
        let [x, y, z] = &self.bounds;
        let faces = Mat3A::from_cols(faces(x), faces(y), faces(z)).transpose();
        let half_areas = faces.x_axis + faces.y_axis + faces.z_axis;
        half_areas * (self.count * leaf.recip()).max(Vec3A::splat(0.5))
    }
}
