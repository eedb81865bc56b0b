//! Binary trees by the surface-area heuristic, binned (Wald 2007, "On fast construction of
//! SAH-based bounding volume hierarchies").

use glam::Vec3A;
use rayon::prelude::*;

use super::Aabb;

/// The most bins, a power of two.
const BINS: usize = 16;
/// Below this depth, splits halve the number of items, so that depth is bounded whatever the input.
pub(super) const SAH_DEPTH: u32 = 40;
/// Ranges smaller than this are built by one thread.
const PARALLEL: usize = 4096;
/// Cost of visiting a node, in units of testing one full leaf.
const NODE_COST: f32 = 0.6;

/// A thing to be put into a tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) bounds: Aabb,
    pub(super) index: u32,
}

/// A binary tree over items; leaves own a range of the reordered items.
#[derive(Debug)]
pub(super) enum Tree<'a> {
    Leaf(Aabb, &'a [Item]),
    /// The last is for [`super::wide::collapse`].
    Inner(Aabb, Box<[Tree<'a>; 2]>, [u8; 8]),
}

impl Tree<'_> {
    pub(super) fn bounds(&self) -> Aabb {
        match self {
            Self::Leaf(bounds, _) | Self::Inner(bounds, ..) => *bounds,
        }
    }
}

/// What is known of a range of items.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// Around the items.
    bounds: Aabb,
    /// Around their centres.
    centers: Aabb,
}

impl Extent {
    fn of(items: &[Item]) -> Self {
        let bounds = items.iter().fold(Aabb::EMPTY, |bounds, item| bounds.union(item.bounds));
        Self { bounds, centers: centers(items) }
    }
}

/// Builds a tree whose leaves hold at most `leaf` items. Reorders the items.
pub(super) fn tree(items: &mut [Item], leaf: usize) -> Tree<'_> {
    let extent = Extent::of(items);
    split(items, extent, leaf, 0)
}

fn split(items: &mut [Item], extent: Extent, leaf: usize, depth: u32) -> Tree<'_> {
    let bounds = extent.bounds;
    if items.len() <= 1 || leaf_cost(items.len(), leaf) <= NODE_COST {
        return Tree::Leaf(bounds, items);
    }
    let (middle, extents) = match best_split(items, &extent, leaf, depth) {
        Some(Split::Leaf) => return Tree::Leaf(bounds, items),
        Some(Split::At(plane)) => partition(items, &plane),
        None => halve(items, &extent.centers),
    };
    let (left, right) = items.split_at_mut(middle);
    let children = if left.len() + right.len() > PARALLEL {
        rayon::join(
            || split(left, extents[0], leaf, depth + 1),
            || split(right, extents[1], leaf, depth + 1),
        )
    } else {
        (split(left, extents[0], leaf, depth + 1), split(right, extents[1], leaf, depth + 1))
    };
    Tree::Inner(bounds, Box::new([children.0, children.1]), [0; 8])
}

/// Items whose centre lies in bins below `bin` go left.
struct Plane {
    axis: usize,
    bin: usize,
    binning: Binning,
    /// Around the items of each side.
    bounds: [Aabb; 2],
}

enum Split {
    Leaf,
    At(Plane),
}

#[derive(Clone, Copy)]
struct Binning {
    origin: Vec3A,
    scale: Vec3A,
    /// Bins along each axis, at most [`BINS`].
    count: usize,
    /// The last of them, along each axis.
    last: Vec3A,
}

impl Binning {
    fn new(centers: &Aabb, items: usize) -> Self {
        // Most ranges are small, and sweeping over bins takes time.
        let count = (8 + items / 16).min(BINS);
        let extent = (centers.max - centers.min).max(Vec3A::splat(f32::MIN_POSITIVE));
        let scale = (count as f32 * 0.9999 / extent).min(Vec3A::splat(f32::MAX));
        Self { origin: centers.min, scale, count, last: Vec3A::splat(count as f32 - 1.0) }
    }

    /// The bin along each axis.
    fn bins(&self, item: &Item) -> [usize; 3] {
        // Adding 2²³ leaves the number, rounded, in the last bits: conversions that saturate take
        // several times as long.
        let place = (item.bounds.center() - self.origin) * self.scale - 0.5;
        let bits = place.clamp(Vec3A::ZERO, self.last) + 8_388_608.0;
        bits.to_array().map(|bits| bits.to_bits() as usize & (BINS - 1))
    }

    /// Which items lie in the bins below `bin` of an axis.
    fn is_below(&self, axis: usize, bin: usize) -> impl Fn(&Item) -> bool {
        let (origin, scale, bin) = (self.origin[axis], self.scale[axis], bin as f32);
        move |item| {
            // As `bins` rounds: to the nearest, and halves to even.
            let center = 0.5 * (item.bounds.min[axis] + item.bounds.max[axis]);
            let place = (center - origin) * scale - 0.5;
            (place.max(0.0) + 8_388_608.0) - 8_388_608.0 < bin
        }
    }
}

/// Boxes and numbers of items by axis and bin.
type Bins = [[(Aabb, u32); BINS]; 3];

fn fill(items: &[Item], binning: &Binning) -> Bins {
    let mut bins = [[(Aabb::EMPTY, 0); BINS]; 3];
    for item in items {
        for (axis, bin) in binning.bins(item).into_iter().enumerate() {
            let bin = &mut bins[axis][bin];
            bin.0 = bin.0.union(item.bounds);
            bin.1 += 1;
        }
    }
    bins
}

fn fill_in_parallel(items: &[Item], binning: &Binning) -> Bins {
    if items.len() < 8 * PARALLEL {
        return fill(items, binning);
    }
    let merge = |mut a: Bins, b: Bins| {
        for (a, b) in a.iter_mut().flatten().zip(b.into_iter().flatten()) {
            *a = (a.0.union(b.0), a.1 + b.1);
        }
        a
    };
    let chunks = items.par_chunks(2 * PARALLEL).map(|chunk| fill(chunk, binning));
    chunks.reduce(|| fill(&[], binning), merge)
}

/// Cost of testing `n` items, in full leaves.
fn leaf_cost(n: usize, leaf: usize) -> f32 {
    (n as f32 / leaf as f32).max(0.5)
}

/// The cheapest of the binned planes, or that a leaf is cheaper; `None` where centres coincide or
/// the tree is deep already.
fn best_split(items: &[Item], extent: &Extent, leaf: usize, depth: u32) -> Option<Split> {
    let size = extent.centers.max - extent.centers.min;
    if depth >= SAH_DEPTH || size.max_element() <= f32::MIN_POSITIVE {
        return (items.len() <= leaf).then_some(Split::Leaf);
    }
    let binning = Binning::new(&extent.centers, items.len());
    let (cost, plane) = cheapest(&fill_in_parallel(items, &binning), binning, leaf);
    let area = extent.bounds.half_area();
    if items.len() <= leaf && leaf_cost(items.len(), leaf) * area <= NODE_COST * area + cost {
        return Some(Split::Leaf);
    }
    cost.is_finite().then_some(Split::At(plane))
}

/// The cheapest plane along any axis, and its cost (times area); infinite where there is none.
fn cheapest(bins: &Bins, binning: Binning, leaf: usize) -> (f32, Plane) {
    let mut best = (f32::INFINITY, 0, 0);
    for (axis, bins) in bins.iter().enumerate() {
        let (cost, bin) = sweep(&bins[..binning.count], leaf);
        if cost < best.0 {
            best = (cost, axis, bin);
        }
    }
    let (cost, axis, bin) = best;
    let around = |bins: &[(Aabb, u32)]| bins.iter().fold(Aabb::EMPTY, |b, bin| b.union(bin.0));
    let (below, above) = bins[axis][..binning.count].split_at(bin);
    (cost, Plane { axis, bin, binning, bounds: [around(below), around(above)] })
}

/// Cheapest plane along one axis: its cost (times area) and the first bin of its right side.
fn sweep(bins: &[(Aabb, u32)], leaf: usize) -> (f32, usize) {
    let mut right = [(0.0, 0); BINS];
    let mut side = (Aabb::EMPTY, 0);
    for b in (1..bins.len()).rev() {
        side = (side.0.union(bins[b].0), side.1 + bins[b].1);
        right[b] = (side.0.half_area() * leaf_cost(side.1 as usize, leaf), side.1);
    }
    let mut best = (f32::INFINITY, 0);
    let mut side = (Aabb::EMPTY, 0);
    for b in 1..bins.len() {
        side = (side.0.union(bins[b - 1].0), side.1 + bins[b - 1].1);
        let cost = side.0.half_area() * leaf_cost(side.1 as usize, leaf) + right[b].0;
        if side.1 > 0 && right[b].1 > 0 && cost < best.0 {
            best = (cost, b);
        }
    }
    best
}

/// Brings the left side to the front; returns its length and what is known of both sides.
fn partition(items: &mut [Item], plane: &Plane) -> (usize, [Extent; 2]) {
    let is_below = plane.binning.is_below(plane.axis, plane.bin);
    let mut middle = 0;
    for i in 0..items.len() {
        let is_left = is_below(&items[i]);
        // Also where it stays right, so that there is no branch to guess.
        items.swap(i, middle);
        middle += usize::from(is_left);
    }
    debug_assert!(0 < middle && middle < items.len(), "binning and partition agree");
    let (left, right) = items.split_at(middle);
    let extent =
        |side: usize, items| Extent { bounds: plane.bounds[side], centers: centers(items) };
    (middle, [extent(0, left), extent(1, right)])
}

/// Around the centres of items.
fn centers(items: &[Item]) -> Aabb {
    items.iter().fold(Aabb::EMPTY, |centers, item| centers.with(item.bounds.center()))
}

/// Splits at the median of the widest axis.
fn halve(items: &mut [Item], centers: &Aabb) -> (usize, [Extent; 2]) {
    let extent = centers.max - centers.min;
    let axis = if extent.x >= extent.y.max(extent.z) {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        a.bounds.center()[axis].total_cmp(&b.bounds.center()[axis])
    });
    let (left, right) = items.split_at(middle);
    (middle, [Extent::of(left), Extent::of(right)])
}
