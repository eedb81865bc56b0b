//! Nodes of eight children, laid out so that one instruction tests all eight.

use super::Aabb;
use super::build::{Item, Tree, tree};

/// Marks a child as a leaf; the other bits are its index.
pub(super) const LEAF: u32 = 1 << 31;

/// Eight boxes and what they contain: 224 bytes, padded to four cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// min x, y, z, max x, y, z of the children; (∞, −∞) where there is none.
    pub(super) planes: [[f32; 8]; 6],
    /// Index of a node, or [`LEAF`] and the index of a leaf.
    pub(super) child: [u32; 8],
}

impl Node {
    const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; 8],
            [f32::INFINITY; 8],
            [f32::INFINITY; 8],
            [f32::NEG_INFINITY; 8],
            [f32::NEG_INFINITY; 8],
            [f32::NEG_INFINITY; 8],
        ],
        child: [LEAF; 8],
    };

    pub(super) fn set_bounds(&mut self, lane: usize, bounds: Aabb) {
        for axis in 0..3 {
            self.planes[axis][lane] = bounds.min[axis];
            self.planes[axis + 3][lane] = bounds.max[axis];
        }
    }

    pub(super) fn lane_bounds(&self, lane: usize) -> Aabb {
        let at = |first: usize| {
            glam::Vec3A::new(
                self.planes[first][lane],
                self.planes[first + 1][lane],
                self.planes[first + 2][lane],
            )
        };
        Aabb { min: at(0), max: at(3) }
    }

    pub(super) fn bounds(&self) -> Aabb {
        (0..8).fold(Aabb::EMPTY, |b, lane| b.union(self.lane_bounds(lane)))
    }

    pub(super) fn lanes(&self) -> impl Iterator<Item = (usize, u32)> + '_ {
        self.child
            .iter()
            .copied()
            .enumerate()
            .filter(|&(lane, _)| self.planes[0][lane] <= self.planes[3][lane])
    }
}

/// Collapses a binary tree; `leaf` stores a leaf's items and returns its index. Parents come before
/// their children; the root is node 0.
pub(super) fn collapse(root: &Tree<'_>, leaf: &mut impl FnMut(&[Item]) -> u32) -> Vec<Node> {
    let mut nodes = Vec::new();
    emit(root, &mut nodes, leaf);
    nodes
}

fn emit<'a>(
    tree: &'a Tree<'a>,
    nodes: &mut Vec<Node>,
    leaf: &mut impl FnMut(&[Item]) -> u32,
) -> u32 {
    let index = nodes.len();
    nodes.push(Node::EMPTY);
    let mut node = Node::EMPTY;
    for (lane, child) in eight(tree).into_iter().enumerate() {
        node.set_bounds(lane, child.bounds());
        node.child[lane] = match child {
            Tree::Leaf(_, items) => LEAF | leaf(items),
            Tree::Inner(..) => emit(child, nodes, leaf),
        };
    }
    nodes[index] = node;
    index as u32
}

/// Opens the largest child until there are eight.
fn eight<'a>(tree: &'a Tree<'a>) -> Vec<&'a Tree<'a>> {
    let mut children = Vec::with_capacity(8);
    match tree {
        Tree::Leaf(_, []) => {}
        Tree::Leaf(..) => children.push(tree),
        Tree::Inner(_, pair) => children.extend(pair.iter()),
    }
    while children.len() < 8 {
        let area = |i: usize| children[i].bounds().half_area();
        let largest = (0..children.len())
            .filter(|&i| matches!(children[i], Tree::Inner(..)))
            .max_by(|&a, &b| area(a).total_cmp(&area(b)));
        let Some(i) = largest else { break };
        if let Tree::Inner(_, pair) = children.swap_remove(i) {
            children.extend(pair.iter());
        }
    }
    children
}

/// A tree over boxes, one a leaf; leaf indices are those of the boxes.
pub(super) fn over_boxes(boxes: &[Aabb]) -> (Vec<Node>, Aabb) {
    let mut items: Vec<_> =
        (0..).zip(boxes).map(|(index, &bounds)| Item { bounds, index }).collect();
    let root = tree(&mut items, 1);
    (collapse(&root, &mut |items| items[0].index), root.bounds())
}
