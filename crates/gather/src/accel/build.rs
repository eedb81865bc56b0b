//! Binary trees by the surface-area heuristic, binned (Wald 2007, "On fast construction of
//! SAH-based bounding volume hierarchies").

use glam::Vec3A;
use rayon::prelude::*;

use super::Aabb;

const BINS: usize = 16;
/// Below this depth, splits halve the number of items, so that depth is bounded whatever the input.
const SAH_DEPTH: u32 = 40;
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
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, centers: Aabb::EMPTY };

    fn of(items: &[Item]) -> Self {
        items.iter().fold(Self::EMPTY, |mut extent, item| {
            extent.add(item);
            extent
        })
    }

    fn add(&mut self, item: &Item) {
        self.bounds = self.bounds.union(item.bounds);
        self.centers = self.centers.with(item.bounds.center());
    }
}

/// Builds a tree whose leaves hold at most `leaf` items. Reorders the items.
pub(super) fn tree(items: &mut [Item], leaf: usize) -> Tree<'_> {
    let extent = Extent::of(items);
    split(items, extent, leaf, 0)
}

fn split(items: &mut [Item], extent: Extent, leaf: usize, depth: u32) -> Tree<'_> {
    let bounds = extent.bounds;
    if items.len() <= 1 {
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
}

impl Binning {
    fn new(centers: &Aabb, items: usize) -> Self {
        // Few items need no more; most ranges are small, and clearing bins takes time.
        let count = if items > BINS { BINS } else { BINS / 2 };
        let extent = (centers.max - centers.min).max(Vec3A::splat(f32::MIN_POSITIVE));
        Self { origin: centers.min, scale: count as f32 * 0.9999 / extent, count }
    }

    /// Where an item's centre lies, in bins.
    fn place(&self, item: &Item) -> Vec3A {
        (item.bounds.center() - self.origin) * self.scale
    }

    /// The bin along each axis.
    fn bins(&self, item: &Item) -> [usize; 3] {
        // Adding 2²³ leaves the number, rounded, in the last bits: conversions that saturate take
        // several times as long.
        let bits = (self.place(item) - 0.5).max(Vec3A::ZERO) + 8_388_608.0;
        bits.to_array().map(|bits| (bits.to_bits() as usize & (BINS - 1)).min(self.count - 1))
    }

    /// Whether an item lies in the bins below `bin` of an axis.
    fn is_below(&self, item: &Item, axis: usize, bin: usize) -> bool {
        // As `bins` rounds: to the nearest, and halves to even.
        let place = ((self.place(item)[axis] - 0.5).max(0.0) + 8_388_608.0) - 8_388_608.0;
        place < bin as f32
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
    let bins = fill_in_parallel(items, &binning);
    let mut best = (f32::INFINITY, 0, 0);
    for axis in (0..3).filter(|&a| size[a] > f32::MIN_POSITIVE) {
        let (cost, bin) = sweep(&bins[axis][..binning.count], leaf);
        if cost < best.0 {
            best = (cost, axis, bin);
        }
    }
    let area = extent.bounds.half_area();
    if items.len() <= leaf && leaf_cost(items.len(), leaf) * area <= NODE_COST * area + best.0 {
        return Some(Split::Leaf);
    }
    best.0.is_finite().then_some(Split::At(Plane { axis: best.1, bin: best.2, binning }))
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
    let mut extents = [Extent::EMPTY; 2];
    let mut middle = 0;
    for i in 0..items.len() {
        let is_left = plane.binning.is_below(&items[i], plane.axis, plane.bin);
        extents[usize::from(!is_left)].add(&items[i]);
        if is_left {
            items.swap(i, middle);
            middle += 1;
        }
    }
    debug_assert!(0 < middle && middle < items.len(), "binning and partition agree");
    (middle, extents)
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
