//! Binary trees by the surface-area heuristic, binned (Wald 2007, "On fast construction of
//! SAH-based bounding volume hierarchies").

use glam::Vec3A;

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

/// Builds a tree whose leaves hold at most `leaf` items. Reorders the items.
pub(super) fn tree(items: &mut [Item], leaf: usize) -> Tree<'_> {
    split(items, leaf, 0)
}

fn split(items: &mut [Item], leaf: usize, depth: u32) -> Tree<'_> {
    let bounds = items.iter().fold(Aabb::EMPTY, |b, i| b.union(i.bounds));
    if items.len() <= 1 {
        return Tree::Leaf(bounds, items);
    }
    let middle = match best_split(items, bounds, leaf, depth) {
        Some(Split::Leaf) => return Tree::Leaf(bounds, items),
        Some(Split::At(plane)) => partition(items, &plane),
        None => halve(items),
    };
    let (left, right) = items.split_at_mut(middle);
    let children = if left.len() + right.len() > PARALLEL {
        rayon::join(|| split(left, leaf, depth + 1), || split(right, leaf, depth + 1))
    } else {
        (split(left, leaf, depth + 1), split(right, leaf, depth + 1))
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
}

impl Binning {
    fn bin(&self, item: &Item, axis: usize) -> usize {
        let at = (item.bounds.center()[axis] - self.origin[axis]) * self.scale[axis];
        (at as usize).min(BINS - 1)
    }
}

/// Cost of testing `n` items, in full leaves.
fn leaf_cost(n: usize, leaf: usize) -> f32 {
    (n as f32 / leaf as f32).max(0.5)
}

/// The cheapest of the binned planes, or that a leaf is cheaper; `None` where centres coincide or
/// the tree is deep already.
fn best_split(items: &[Item], bounds: Aabb, leaf: usize, depth: u32) -> Option<Split> {
    let centers = items.iter().fold(Aabb::EMPTY, |b, i| b.with(i.bounds.center()));
    let extent = centers.max - centers.min;
    if depth >= SAH_DEPTH || extent.max_element() <= f32::MIN_POSITIVE {
        return (items.len() <= leaf).then_some(Split::Leaf);
    }
    let binning = Binning {
        origin: centers.min,
        scale: BINS as f32 * 0.9999 / extent.max(Vec3A::splat(f32::MIN_POSITIVE)),
    };
    let mut best = (f32::INFINITY, 0, 0);
    for axis in (0..3).filter(|&a| extent[a] > f32::MIN_POSITIVE) {
        let (cost, bin) = sweep(items, &binning, axis, leaf);
        if cost < best.0 {
            best = (cost, axis, bin);
        }
    }
    let area = bounds.half_area();
    if items.len() <= leaf && leaf_cost(items.len(), leaf) * area <= NODE_COST * area + best.0 {
        return Some(Split::Leaf);
    }
    best.0.is_finite().then_some(Split::At(Plane { axis: best.1, bin: best.2, binning }))
}

/// Cheapest plane along one axis: its cost (times area) and the first bin of its right side.
fn sweep(items: &[Item], binning: &Binning, axis: usize, leaf: usize) -> (f32, usize) {
    let mut bins = [(Aabb::EMPTY, 0); BINS];
    for item in items {
        let bin = &mut bins[binning.bin(item, axis)];
        bin.0 = bin.0.union(item.bounds);
        bin.1 += 1;
    }
    let mut right = [(0.0, 0); BINS];
    let mut side = (Aabb::EMPTY, 0);
    for b in (1..BINS).rev() {
        side = (side.0.union(bins[b].0), side.1 + bins[b].1);
        right[b] = (side.0.half_area() * leaf_cost(side.1, leaf), side.1);
    }
    let mut best = (f32::INFINITY, 0);
    let mut side = (Aabb::EMPTY, 0);
    for b in 1..BINS {
        side = (side.0.union(bins[b - 1].0), side.1 + bins[b - 1].1);
        let cost = side.0.half_area() * leaf_cost(side.1, leaf) + right[b].0;
        if side.1 > 0 && right[b].1 > 0 && cost < best.0 {
            best = (cost, b);
        }
    }
    best
}

/// Brings the left side to the front and returns its length.
fn partition(items: &mut [Item], plane: &Plane) -> usize {
    let mut middle = 0;
    for i in 0..items.len() {
        if plane.binning.bin(&items[i], plane.axis) < plane.bin {
            items.swap(i, middle);
            middle += 1;
        }
    }
    middle
}

/// Splits at the median of the widest axis.
fn halve(items: &mut [Item]) -> usize {
    let centers = items.iter().fold(Aabb::EMPTY, |b, i| b.with(i.bounds.center()));
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
    middle
}
