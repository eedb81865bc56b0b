//! Binary trees by the surface-area heuristic, binned (Wald 2007, "On fast construction of
//! SAH-based bounding volume hierarchies").

mod bins;
mod few;
mod reinsert;

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec3A, Vec4};

use super::Aabb;
use super::pages::Pages;
use bins::Plane;
use few::{FEW, Parting};

/// Below this depth, splits halve the number of items, which bounds the depth for any input.
const SAH_DEPTH: u32 = 40;
/// Greatest number of levels of a tree: the at most 2³⁰ items below [`SAH_DEPTH`] are halved.
pub(super) const DEEPEST: u32 = SAH_DEPTH + 31;
/// Ranges smaller than this are built by one thread.
const PARALLEL: usize = 1024;
/// Ranges of at least this size are scanned by several threads.
const LARGE: usize = 16 * PARALLEL;
/// Cost of visiting a node, in units of testing one full leaf.
const NODE_COST: f32 = 0.6;

/// An entry of a tree: one thing (a triangle or an instance), or several that stay together.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Item {
    /// The box's least coordinates. The bits of `w` hold the index of the first thing and
    /// [`ORDINARY`].
    low: Vec4,
    /// The box's greatest coordinates. The bits of `w` hold the number of things and [`ORDINARY`].
    high: Vec4,
}

/// A bit that makes the bits of small integers normal numbers; arithmetic with subnormals is slow.
const ORDINARY: u32 = 1 << 30;

impl Item {
    /// An item of `count` things from `index` on, within a box.
    ///
    /// # Panics
    ///
    /// If an index or a count is 2³⁰ or more.
    pub(super) fn new(bounds: Aabb, index: u32, count: u32) -> Self {
        assert!(index < ORDINARY && count < ORDINARY, "more than 2³⁰ triangles");
        let corner = |at: Vec3A, number: u32| at.extend(f32::from_bits(number | ORDINARY));
        Self { low: corner(bounds.min, index), high: corner(bounds.max, count) }
    }

    pub(super) fn bounds(&self) -> Aabb {
        Aabb { min: Vec3A::from_vec4(self.low), max: Vec3A::from_vec4(self.high) }
    }

    /// The sum of its box's corners.
    fn center_twice(&self) -> Vec3A {
        Vec3A::from_vec4(self.low) + Vec3A::from_vec4(self.high)
    }

    fn count(&self) -> u32 {
        self.high.w.to_bits() & !ORDINARY
    }

    /// The indices of its things.
    pub(super) fn indices(&self) -> Range<usize> {
        let first = (self.low.w.to_bits() & !ORDINARY) as usize;
        first..first + self.count() as usize
    }
}

/// A binary tree over items.
#[derive(Debug)]
pub(super) struct BinaryTree {
    nodes: Pages<BinaryNode>,
    items: Pages<Item>,
}

/// A leaf, or a node with two children.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct BinaryNode {
    min: [f32; 3],
    /// A leaf's first item.
    first: u32,
    max: [f32; 3],
    /// A leaf's number of items. For an inner node, [`INNER`] and the offset from the node to its
    /// right child; the left child follows the node.
    rest: u32,
}

const INNER: u32 = 1 << 31;

/// The subtree below a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Subtree<'a> {
    nodes: &'a [BinaryNode],
    items: &'a [Item],
}

impl BinaryTree {
    /// Builds a tree whose leaves hold at most `leaf` things. No item may have more.
    pub(super) fn new(mut items: Pages<Item>, leaf: usize) -> Self {
        let mut nodes = Pages::zeroed((2 * items.len()).max(1));
        let extent = Extent::of(&items);
        let builder = Builder { nodes: &mut nodes, items: &mut items, first: 0, extent, depth: 0 };
        builder.build(leaf as f32);
        Self { nodes, items }
    }

    pub(super) fn root(&self) -> Subtree<'_> {
        Subtree { nodes: &self.nodes, items: &self.items }
    }

    /// Number of places for nodes; where leaves hold several items, some places stay empty.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }
}

impl<'a> Subtree<'a> {
    pub(super) fn bounds(&self) -> Aabb {
        let BinaryNode { min, max, .. } = self.nodes[0];
        Aabb { min: min.into(), max: max.into() }
    }

    /// Offset from this node to its right child; `None` for a leaf. The left subtree has the places
    /// between.
    pub(super) fn right(&self) -> Option<usize> {
        let rest = self.nodes[0].rest;
        (rest & INNER != 0).then_some((rest & !INNER) as usize)
    }

    /// Both children; `None` for a leaf.
    pub(super) fn sides(&self) -> Option<[Self; 2]> {
        let side = |from: usize| Self { nodes: &self.nodes[from..], ..*self };
        self.right().map(|right| [side(1), side(right)])
    }

    /// The items of a leaf.
    pub(super) fn items(&self) -> &'a [Item] {
        let BinaryNode { first, rest, .. } = self.nodes[0];
        &self.items[first as usize..(first + rest) as usize]
    }
}

/// Bounds and size of a range of items.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// Box around the items.
    bounds: Aabb,
    /// Box around the items' centres, times two.
    centers: Aabb,
    /// Number of things in the items, as exactly as an `f32` counts.
    count: f32,
}

impl Extent {
    fn of(items: &[Item]) -> Self {
        if items.len() >= LARGE {
            let (front, back) = items.split_at(items.len() / 2);
            let (front, back) = rayon::join(|| Self::of(front), || Self::of(back));
            return front.union(&back);
        }
        let bounds = items.iter().fold(Aabb::EMPTY, |bounds, item| bounds.union(item.bounds()));
        let count = items.iter().map(|item| item.count() as f32).sum();
        Self { bounds, centers: centers(items), count }
    }

    fn union(&self, other: &Self) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            centers: self.centers.union(other.centers),
            count: self.count + other.count,
        }
    }
}

/// Box around the items' centres, times two.
fn centers(items: &[Item]) -> Aabb {
    if items.len() >= LARGE {
        let (front, back) = items.split_at(items.len() / 2);
        let (front, back) = rayon::join(|| centers(front), || centers(back));
        return front.union(back);
    }
    items.iter().fold(Aabb::EMPTY, |centers, item| centers.with(item.center_twice()))
}

/// A subtree under construction.
struct Builder<'a> {
    /// Places for nodes: at least twice the number of items less one.
    nodes: &'a mut [BinaryNode],
    items: &'a mut [Item],
    /// Index of the first item among all items of the tree.
    first: u32,
    extent: Extent,
    depth: u32,
}

impl Builder<'_> {
    fn build(mut self, leaf: f32) {
        let Extent { bounds, count, .. } = self.extent;
        let is_small = self.items.len() <= 1 || leaf_cost(count, leaf) <= NODE_COST;
        let split = if is_small { None } else { self.split(leaf) };
        let Aabb { min, max } = bounds;
        let (min, max) = (min.to_array(), max.to_array());
        let Some((middle, extents)) = split else {
            let rest = self.items.len() as u32;
            self.nodes[0] = BinaryNode { min, max, first: self.first, rest };
            return;
        };
        let right = 2 * middle;
        self.nodes[0] = BinaryNode { min, max, first: self.first, rest: right as u32 | INNER };
        let (nodes, items) = (self.nodes.split_at_mut(right), self.items.split_at_mut(middle));
        let is_parallel = items.0.len() + items.1.len() > PARALLEL;
        let side = |nodes, items, first, extent| {
            let depth = self.depth + 1;
            move || Builder { nodes, items, first, extent, depth }.build(leaf)
        };
        let left = side(&mut nodes.0[1..], items.0, self.first, extents[0]);
        let right = side(nodes.1, items.1, self.first + middle as u32, extents[1]);
        if is_parallel {
            rayon::join(left, right);
        } else {
            left();
            right();
        }
    }

    /// Splits the items. Returns the number of items on the left and the extents of both sides;
    /// `None` where a leaf is cheaper.
    fn split(&mut self, leaf: f32) -> Option<(usize, [Extent; 2])> {
        let Extent { bounds, centers, count } = self.extent;
        let area = bounds.half_area();
        let is_leaf =
            |cost| count <= leaf && leaf_cost(count, leaf) * area <= NODE_COST * area + cost;
        if self.items.len() <= FEW && self.depth < SAH_DEPTH {
            let parting = Parting::cheapest(self.items, leaf);
            return (!is_leaf(parting.cost)).then(|| {
                let middle = parting.bring_left(self.items);
                let (left, right) = self.items.split_at(middle);
                (middle, [Extent::of(left), Extent::of(right)])
            });
        }
        let size = centers.max - centers.min;
        if self.depth >= SAH_DEPTH || size.max_element() <= f32::MIN_POSITIVE {
            return (count > leaf).then(|| self.halve());
        }
        let (cost, plane) = Plane::cheapest(self.items, &self.extent, leaf);
        if is_leaf(cost) {
            return None;
        }
        Some(if cost.is_finite() { self.partition(&plane) } else { self.halve() })
    }

    /// Moves the items left of a plane to the front.
    fn partition(&mut self, plane: &Plane) -> (usize, [Extent; 2]) {
        let middle = bring_left(self.items, plane);
        debug_assert!(0 < middle && middle < self.items.len(), "binning and partition agree");
        let (left, right) = self.items.split_at(middle);
        let [left, right] = [(left, plane.sides[0]), (right, plane.sides[1])]
            .map(|(items, (bounds, count))| Extent { bounds, centers: centers(items), count });
        (middle, [left, right])
    }

    /// Splits at the median of the widest axis.
    fn halve(&mut self) -> (usize, [Extent; 2]) {
        let Aabb { min, max } = self.extent.centers;
        let axis = Vec3::from(max - min).max_position();
        let middle = self.items.len() / 2;
        self.items.select_nth_unstable_by(middle, |a, b| {
            a.center_twice()[axis].total_cmp(&b.center_twice()[axis])
        });
        let (left, right) = self.items.split_at(middle);
        (middle, [Extent::of(left), Extent::of(right)])
    }
}

/// Moves the items left of a plane to the front; returns their number.
fn bring_left(items: &mut [Item], plane: &Plane) -> usize {
    if items.len() >= LARGE {
        let (front, back) = items.split_at_mut(items.len() / 2);
        let (a, b) = rayon::join(|| bring_left(front, plane), || bring_left(back, plane));
        // Swaps the right items of the front half with the left items of the back half.
        let moved = b.min(front.len() - a);
        front[a..a + moved].swap_with_slice(&mut back[b - moved..b]);
        return a + b;
    }
    let mut middle = 0;
    for n in 0..items.len() {
        let is_left = plane.is_left(&items[n]);
        // It also swaps items that stay right, which avoids an unpredictable branch.
        items.swap(n, middle);
        middle += usize::from(is_left);
    }
    middle
}

/// Cost of testing `n` things, in units of full leaves.
fn leaf_cost(n: f32, leaf: f32) -> f32 {
    (n / leaf).max(0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::random;

    /// Boxes of many sizes, every third of two things, with a cluster of equal boxes.
    pub(super) fn items(count: u32) -> Vec<Item> {
        let item = |n: u32| {
            let at = if n.is_multiple_of(8) { Vec3A::ONE } else { Vec3A::from(random(50, n)) };
            let size = 0.1 * Vec3A::from(random(51, n)).powf(4.0);
            Item::new(
                Aabb { min: at, max: at + size },
                2 * n,
                if n.is_multiple_of(3) { 2 } else { 1 },
            )
        };
        (0..count).map(item).collect()
    }

    /// Collects indices by leaf, in order, and checks that boxes enclose what is below them.
    pub(super) fn leaves(tree: Subtree<'_>, all: &mut Vec<Vec<usize>>) {
        let holds = |inner: Aabb| assert_eq!(tree.bounds().union(inner), tree.bounds());
        if let Some(sides) = tree.sides() {
            for side in sides {
                holds(side.bounds());
                leaves(side, all);
            }
        } else {
            tree.items().iter().for_each(|item| holds(item.bounds()));
            all.push(tree.items().iter().flat_map(Item::indices).collect());
        }
    }

    #[test]
    fn every_thing_is_in_one_leaf_whatever_the_threads() {
        for count in [0, 1, 2, 7, 100, 3 * LARGE as u32] {
            let [one, three] = [1, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let tree =
                    pool.expect("threads").install(|| BinaryTree::new(items(count).into(), 4));
                let mut all = Vec::new();
                leaves(tree.root(), &mut all);
                all
            });
            assert_eq!(one, three);
            assert!(one.iter().all(|leaf| leaf.len() <= 4));
            let mut found = one.concat();
            found.sort_unstable();
            let wanted: Vec<_> = items(count).iter().flat_map(Item::indices).collect();
            assert_eq!(found, wanted);
        }
    }
}
