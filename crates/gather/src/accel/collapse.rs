//! Turns a binary tree into nodes of eight children.
//!
//! Dynamic programming over the tree chooses the inner nodes to remove so that the expected cost of
//! a ray is least (Ylitie, Karras and Laine 2017, "Efficient incoherent ray traversal on GPUs
//! through compressed wide BVHs", section 3.2).

use bytemuck::Pod;
use rayon::prelude::*;

use super::build::{BinaryTree, Item, Subtree};
use super::pages::{Pages, split};
use super::wide::{LEAF, Node};

/// Cost of visiting a node; visiting a leaf costs one.
const NODE_COST: f32 = 1.0;

/// Subtrees above this depth are planned on several threads.
const PARALLEL_DEPTH: u32 = 6;

/// A cut of an inner node: for forests of at most 1, 2, … 8 children, the number of children on its
/// left side. It is 0 where one child fewer is as good.
type Cut = [u8; 8];

/// Least costs of a subtree as a forest of at most 1, 2, … 8 children. It stores each node's cut at
/// the node's place in `cuts`.
fn plan(tree: Subtree<'_>, cuts: &mut [Cut], depth: u32) -> [f32; 8] {
    let area = tree.bounds().half_area();
    let Some(([left, right], second)) = tree.sides().zip(tree.right()) else { return [area; 8] };
    let (first, second) = cuts.split_at_mut(second);
    let Some((cut, first)) = first.split_first_mut() else { unreachable!("a node has a place") };
    let (left, right) = if depth < PARALLEL_DEPTH {
        rayon::join(|| plan(left, first, depth + 1), || plan(right, second, depth + 1))
    } else {
        (plan(left, first, depth + 1), plan(right, second, depth + 1))
    };
    let mut costs = [0.0; 8];
    for roots in 2..=8 {
        // The first of the cheapest wins.
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
    // As a single child it is a node with eight children of its own.
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

/// A subtree and the cuts of its nodes.
#[derive(Clone, Copy)]
struct Planned<'p, 'a> {
    tree: Subtree<'a>,
    cuts: &'p [Cut],
}

impl Planned<'_, '_> {
    fn sides(&self) -> Option<[Self; 2]> {
        let [left, right] = self.tree.sides()?;
        let second = self.tree.right()?;
        let side = |tree, from: usize| Self { tree, cuts: &self.cuts[from..] };
        Some([side(left, 1), side(right, second)])
    }
}

/// Appends the forest of at most `roots` children that [`plan`] chose.
fn open<'p, 'a>(planned: Planned<'p, 'a>, roots: usize, children: &mut Vec<Planned<'p, 'a>>) {
    match planned.sides() {
        Some([left, right]) if roots > 1 => match usize::from(planned.cuts[0][roots - 1]) {
            0 => open(planned, roots - 1, children),
            k => {
                open(left, k, children);
                open(right, roots - k, children);
            }
        },
        _ => children.push(planned),
    }
}

/// Nodes of eight children, with the items of their leaves.
#[derive(Debug, Default)]
struct Part<'a> {
    /// Parents come before their children; the root is the first.
    nodes: Vec<Node>,
    leaves: Vec<&'a [Item]>,
}

/// A child whose subtree is in another part.
struct Deferred<'p, 'a> {
    /// The node that it is a child of, and its lane there.
    node: usize,
    lane: usize,
    planned: Planned<'p, 'a>,
}

impl<'a> Part<'a> {
    /// Adds a node and `levels` levels of nodes below it; subtrees below those are deferred.
    /// Returns the node's index.
    fn add<'p>(
        &mut self,
        planned: Planned<'p, 'a>,
        levels: u32,
        deferred: &mut Vec<Deferred<'p, 'a>>,
    ) -> u32 {
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let mut children = Vec::with_capacity(8);
        match planned.sides() {
            Some([low, high]) => {
                let k = usize::from(planned.cuts[0][7]);
                open(low, k, &mut children);
                open(high, 8 - k, &mut children);
            }
            None if planned.tree.items().is_empty() => {}
            None => children.push(planned),
        }
        // Any-hit rays visit the last lane first; leaves come last, since a hit in one ends the
        // ray.
        children.sort_by_key(|child| child.tree.right().is_none());
        for (lane, planned) in children.into_iter().enumerate() {
            self.nodes[index].set_bounds(lane, planned.tree.bounds());
            self.nodes[index].child[lane] = if planned.tree.right().is_none() {
                self.leaves.push(planned.tree.items());
                LEAF | (self.leaves.len() - 1) as u32
            } else if levels > 0 {
                self.add(planned, levels - 1, deferred)
            } else {
                deferred.push(Deferred { node: index, lane, planned });
                0
            };
        }
        index as u32
    }

    /// The whole subtree of a node.
    fn of(planned: Planned<'_, 'a>) -> Self {
        let mut part = Self::default();
        part.add(planned, u32::MAX, &mut Vec::new());
        part
    }

    /// Writes the finished nodes and leaves to their places; `places.begin` holds their first
    /// indices.
    fn put<T: Send>(&self, places: Places<'_, T>, leaf: impl Fn(&[Item]) -> T + Sync) {
        let [node, first_leaf] = places.begin;
        for (place, from) in places.nodes.iter_mut().zip(&self.nodes) {
            *place = *from;
            for child in &mut place.child {
                *child += if *child & LEAF == 0 { node } else { first_leaf };
            }
            place.set_order();
        }
        let leaves = places.leaves.par_iter_mut().with_min_len(RUN).zip(&self.leaves);
        leaves.for_each(|(place, items)| *place = leaf(items));
    }
}

/// The places of a part's nodes and leaves, and the indices of the first of each.
struct Places<'p, T> {
    nodes: &'p mut [Node],
    leaves: &'p mut [T],
    begin: [u32; 2],
}

/// In trees of at least [`LARGE`] places, the number of levels that one thread builds before others
/// build the rest.
const UPPER: u32 = 2;
const LARGE: usize = 1 << 13;

/// Least number of leaves that a thread makes.
const RUN: usize = 64;

/// Collapses a binary tree. Returns the nodes, parents before their children and the root first,
/// and the leaves made of their items.
pub(super) fn collapse<T: Pod + Send + Sync>(
    tree: &BinaryTree,
    leaf: impl Fn(&[Item]) -> T + Sync,
) -> (Pages<Node>, Pages<T>) {
    let mut cuts = vec![[0; 8]; tree.len()];
    plan(tree.root(), &mut cuts, 0);
    let (mut upper, mut deferred) = (Part::default(), Vec::new());
    let levels = if tree.len() < LARGE { u32::MAX } else { UPPER };
    upper.add(Planned { tree: tree.root(), cuts: &cuts }, levels, &mut deferred);
    let lower: Vec<_> = deferred.par_iter().map(|child| Part::of(child.planned)).collect();

    // First node and first leaf of each part.
    let mut count = [upper.nodes.len(), upper.leaves.len()].map(|n| n as u32);
    let mut begins = vec![[0; 2]];
    for (child, part) in deferred.iter().zip(&lower) {
        upper.nodes[child.node].child[child.lane] = count[0];
        begins.push(count);
        count[0] += part.nodes.len() as u32;
        count[1] += part.leaves.len() as u32;
    }
    let parts: Vec<_> = std::iter::once(upper).chain(lower).collect();
    let (mut nodes, mut leaves) =
        (Pages::zeroed(count[0] as usize), Pages::zeroed(count[1] as usize));
    let places = split(&mut nodes, parts.iter().map(|part| part.nodes.len()))
        .into_par_iter()
        .zip(split(&mut leaves, parts.iter().map(|part| part.leaves.len())))
        .zip(begins)
        .map(|((nodes, leaves), begin)| Places { nodes, leaves, begin });
    places.zip(&parts).for_each(|(places, part)| part.put(places, &leaf));
    (nodes, leaves)
}
