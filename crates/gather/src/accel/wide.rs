//! Nodes of eight children, laid out so that one instruction tests all eight.

use bytemuck::{Pod, Zeroable};

use glam::Vec3A;

use super::Aabb;
use super::build::{Item, Tree, tree};

/// Marks a child as a leaf; the other bits are its index.
pub(super) const LEAF: u32 = 1 << 31;

/// Eight boxes and what they contain: four cache lines.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// For each axis the least and the greatest coordinates of the children; (∞, −∞) where there is none.
    pub(super) planes: [[[f32; 8]; 2]; 3],
    /// Index of a node, or [`LEAF`] and the index of a leaf.
    pub(super) child: [u32; 8],
    /// For each octant of directions (see [`Setup::octant`]) the children's lanes, four bits each, the
    /// farthest first.
    ///
    /// [`Setup::octant`]: super::kernel::Setup::octant
    pub(super) far_first: [u32; 8],
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        planes: [[[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]]; 3],
        child: [LEAF; 8],
        far_first: [0x7654_3210; 8],
    };

    pub(super) fn set_bounds(&mut self, lane: usize, bounds: Aabb) {
        for axis in 0..3 {
            self.planes[axis][0][lane] = bounds.min[axis];
            self.planes[axis][1][lane] = bounds.max[axis];
        }
    }

    pub(super) fn lane_bounds(&self, lane: usize) -> Aabb {
        let at = |side: usize| {
            let [x, y, z] = &self.planes;
            glam::Vec3A::new(x[side][lane], y[side][lane], z[side][lane])
        };
        Aabb { min: at(0), max: at(1) }
    }

    pub(super) fn bounds(&self) -> Aabb {
        (0..8).fold(Aabb::EMPTY, |b, lane| b.union(self.lane_bounds(lane)))
    }

    pub(super) fn lanes(&self) -> impl Iterator<Item = (usize, u32)> + '_ {
        self.child
            .iter()
            .copied()
            .enumerate()
            .filter(|&(lane, _)| self.planes[0][0][lane] <= self.planes[0][1][lane])
    }
}

/// Collapses a binary tree; `leaf` stores a leaf's items and returns its index. Parents come before
/// their children; the root is node 0.
///
/// Which inner nodes vanish is chosen so that the expected cost of a ray is least, by dynamic
/// programming over the tree (Ylitie, Karras and Laine 2017, "Efficient incoherent ray traversal on
/// GPUs through compressed wide BVHs", section 3.2).
pub(super) fn collapse<'a>(
    root: &mut Tree<'a>,
    leaf: &mut impl FnMut(&'a [Item]) -> u32,
) -> Vec<Node> {
    plan(root, 0);
    let mut nodes = Vec::new();
    emit(root, &mut nodes, leaf);
    nodes
}

/// Cost of visiting a node, of visiting a leaf: one.
const NODE_COST: f32 = 1.0;

/// Down to this depth, subtrees are planned on several threads.
const PARALLEL_DEPTH: u32 = 6;

/// Least cost of a subtree as a forest of at most 1, 2, … 8 children. Notes at every inner node how
/// many of them go to its left side.
fn plan(tree: &mut Tree<'_>, depth: u32) -> [f32; 8] {
    let area = tree.bounds().half_area();
    let Tree::Inner(_, pair, cut) = tree else { return [area; 8] };
    let [left, right] = &mut **pair;
    let (left, right) = if depth < PARALLEL_DEPTH {
        rayon::join(|| plan(left, depth + 1), || plan(right, depth + 1))
    } else {
        (plan(left, depth + 1), plan(right, depth + 1))
    };
    let mut costs = [0.0; 8];
    for roots in 2..=8 {
        // The first that is cheapest.
        let (mut best, mut least) = (1, f32::INFINITY);
        for k in 1..roots {
            let cost = left[k - 1] + right[roots - k - 1];
            if cost < least {
                (best, least) = (k, cost);
            }
        }
        costs[roots - 1] = least;
        cut[roots - 1] = best as u8;
    }
    // As one child: a node of its own, with eight.
    costs[0] = NODE_COST * area + costs[7];
    for roots in 2..=8 {
        if costs[roots - 2] <= costs[roots - 1] {
            costs[roots - 1] = costs[roots - 2];
            if roots < 8 {
                cut[roots - 1] = 0;
            }
        }
    }
    costs
}

fn emit<'a>(
    tree: &Tree<'a>,
    nodes: &mut Vec<Node>,
    leaf: &mut impl FnMut(&'a [Item]) -> u32,
) -> u32 {
    let index = nodes.len();
    nodes.push(Node::EMPTY);
    let mut node = Node::EMPTY;
    let mut children = Vec::with_capacity(8);
    match tree {
        Tree::Leaf(_, []) => {}
        Tree::Leaf(..) => children.push(tree),
        Tree::Inner(_, pair, cut) => {
            let k = usize::from(cut[7]);
            open(&pair[0], k, &mut children);
            open(&pair[1], 8 - k, &mut children);
        }
    }
    // Rays to any hit take the last first, and leaves may end them.
    children.sort_by_key(|child| matches!(child, Tree::Leaf(..)));
    node.far_first = std::array::from_fn(|octant| far_first(&children, octant as u32));
    for (lane, child) in children.into_iter().enumerate() {
        node.set_bounds(lane, child.bounds());
        node.child[lane] = match child {
            Tree::Leaf(_, items) => LEAF | leaf(items),
            Tree::Inner(..) => emit(child, nodes, leaf),
        };
    }
    nodes[index] = node;
    index as u32
}

/// Children in the order in which rays of an octant of directions should not visit them, four bits
/// each: by the corner at which such a ray leaves their boxes, the farthest first. By that corner
/// large boxes come after small ones in front of them; by centres rays visit 5 % more leaves, by
/// the nearest corners 27 %.
fn far_first(children: &[&Tree<'_>], octant: u32) -> u32 {
    let direction = Vec3A::from_array(std::array::from_fn(|axis| match octant >> axis & 1 {
        0 => 1.0,
        _ => -1.0,
    }));
    let leaves_at = |lane: u32| match children.get(lane as usize) {
        Some(child) => {
            let Aabb { min, max } = child.bounds();
            (min * direction).max(max * direction).element_sum()
        }
        None => f32::NEG_INFINITY,
    };
    let mut lanes: [u32; 8] = std::array::from_fn(|lane| lane as u32);
    lanes.sort_by(|&a, &b| leaves_at(b).total_cmp(&leaves_at(a)));
    lanes.iter().rev().fold(0, |order, lane| order << 4 | lane)
}

/// The forest of at most `roots` children that [`plan`] chose.
fn open<'t, 'a>(tree: &'t Tree<'a>, roots: usize, children: &mut Vec<&'t Tree<'a>>) {
    match tree {
        Tree::Inner(_, pair, cut) if roots > 1 => match usize::from(cut[roots - 1]) {
            0 => open(tree, roots - 1, children),
            k => {
                open(&pair[0], k, children);
                open(&pair[1], roots - k, children);
            }
        },
        _ => children.push(tree),
    }
}

/// A tree over boxes, one a leaf; leaf indices are those of the boxes.
pub(super) fn over_boxes(boxes: &[Aabb]) -> (Vec<Node>, Aabb) {
    let mut items: Vec<_> =
        (0..).zip(boxes).map(|(index, &bounds)| Item { bounds, index }).collect();
    let mut root = tree(&mut items, 1);
    let nodes = collapse(&mut root, &mut |items| items[0].index);
    (nodes, root.bounds())
}
