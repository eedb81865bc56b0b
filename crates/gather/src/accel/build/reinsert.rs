//! Improves binary trees: moves subtrees to where they add less surface (Bittner, Hapala and Havran
//! 2013, "Fast insertion-based optimization of bounding volume hierarchies"). The search starts at
//! a subtree's place and goes upwards, for many subtrees in parallel (Meister and Bittner 2018,
//! "Parallel reinsertion for bounding volume hierarchy optimization").

use rayon::prelude::*;

use super::{Aabb, BinaryNode, BinaryTree, DEEPEST, INNER};
use crate::accel::pages::Pages;

/// A round examines one in this many subtrees, those with the largest surface; the others gain
/// little.
const SHARE: usize = 10;
/// Greatest number of rounds.
const ROUNDS: usize = 12;
/// A round that removes less than this share of all surface is the last.
const ENOUGH: f32 = 1e-3;
/// Least number of subtrees that a thread examines.
const FEW: usize = 64;

impl BinaryTree {
    /// Moves subtrees to where they add less surface; takes about as long as building the tree.
    pub(in crate::accel) fn improved(self) -> Self {
        let mut nodes = Vec::with_capacity(self.len());
        add(&mut nodes, &self.nodes, NONE);
        let mut loose = Loose(nodes);
        let mut all: f32 = loose.0.iter().map(|node| node.area).sum();
        for _ in 0..ROUNDS {
            let gain = loose.improve();
            all -= gain;
            if gain <= ENOUGH * all {
                break;
            }
        }
        if loose.depth() > DEEPEST {
            return self;
        }
        let mut nodes = Pages::zeroed(loose.0.len());
        loose.put(ROOT, &mut nodes, 0);
        Self { nodes, ..self }
    }
}

/// Index that stands for no node.
const NONE: u32 = u32::MAX;
const ROOT: u32 = 0;

/// A tree whose nodes may lie in any order; the root is the first.
struct Loose(Vec<LooseNode>);

#[derive(Clone, Copy)]
struct LooseNode {
    bounds: Aabb,
    /// Half of the surface area.
    area: f32,
    parent: u32,
    below: Below,
}

#[derive(Clone, Copy)]
enum Below {
    Nodes([u32; 2]),
    /// Items of the tree, `count` of them from `first` on.
    Items {
        first: u32,
        count: u32,
    },
}

/// A better place for a subtree.
#[derive(Clone, Copy)]
struct Move {
    /// The half surface area that it removes.
    gain: f32,
    node: u32,
    /// The node that is to become its sibling.
    beside: u32,
}

/// Appends a subtree to the nodes; returns its index.
fn add(nodes: &mut Vec<LooseNode>, tree: &[BinaryNode], parent: u32) -> u32 {
    let BinaryNode { min, max, first, rest } = tree[0];
    let bounds = Aabb { min: min.into(), max: max.into() };
    let index = nodes.len() as u32;
    let below = Below::Items { first, count: rest };
    nodes.push(LooseNode { bounds, area: bounds.half_area(), parent, below });
    if rest & INNER != 0 {
        let left = add(nodes, &tree[1..], index);
        let right = add(nodes, &tree[(rest & !INNER) as usize..], index);
        nodes[index as usize].below = Below::Nodes([left, right]);
    }
    index
}

impl Loose {
    fn at(&self, node: u32) -> &LooseNode {
        &self.0[node as usize]
    }

    fn parent(&self, node: u32) -> u32 {
        self.at(node).parent
    }

    /// The other child of its parent; the node must have a parent.
    fn sibling(&self, node: u32) -> u32 {
        match self.at(self.parent(node)).below {
            Below::Nodes([left, right]) if left == node => right,
            Below::Nodes([left, _]) => left,
            Below::Items { .. } => unreachable!("a parent has nodes below it"),
        }
    }

    /// Whether a node is `other` or lies below it.
    fn is_within(&self, mut node: u32, other: u32) -> bool {
        while node != NONE && node != other {
            node = self.parent(node);
        }
        node == other
    }

    /// Moves subtrees, best first. It skips moves that touch a node of an earlier move. Returns the
    /// surface area that the moves remove if they do not influence each other.
    fn improve(&mut self) -> f32 {
        let has_grandparent = |&n: &u32| ![ROOT, NONE].contains(&self.parent(n));
        let mut largest: Vec<u32> = (0..self.0.len() as u32).filter(has_grandparent).collect();
        let count = self.0.len().div_ceil(SHARE).min(largest.len());
        if count == 0 {
            return 0.0;
        }
        let by_area = |a: &u32, b: &u32| self.at(*b).area.total_cmp(&self.at(*a).area);
        largest.select_nth_unstable_by(count - 1, |a, b| by_area(a, b).then(a.cmp(b)));
        largest.truncate(count);
        let moves = largest.par_iter().with_min_len(FEW).filter_map(|&n| self.better_place(n));
        let mut moves: Vec<Move> = moves.collect();
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));

        let mut touched = vec![false; self.0.len()];
        let mut gain = 0.0;
        for m in moves {
            let (parent, above) = (self.parent(m.node), self.parent(m.beside));
            let both = [m.node, self.sibling(m.node), parent, self.parent(parent), m.beside, above];
            let is_free = |&n: &u32| n != NONE && !touched[n as usize];
            if both.iter().all(is_free) && !self.is_within(m.beside, m.node) {
                both.iter().for_each(|&n| touched[n as usize] = true);
                self.reinsert(m);
                gain += m.gain;
            }
        }
        gain
    }

    /// The best new place for a node that has a grandparent; `None` where no place removes surface.
    fn better_place(&self, node: u32) -> Option<Move> {
        let LooseNode { bounds, area, parent, .. } = *self.at(node);
        let mut best = Move { gain: 0.0, node, beside: NONE };
        // Surface saved above the place that is examined, once the node's parent is gone and all
        // boxes above fit.
        let mut saved = self.at(parent).area;
        // Box around what remains below the pivot.
        let mut left = self.at(self.sibling(node)).bounds;
        let (mut pivot, mut beside) = (parent, self.sibling(node));
        let mut open = Vec::with_capacity(64);
        loop {
            open.push((saved, beside));
            while let Some((saved, beside)) = open.pop() {
                if saved - area <= best.gain {
                    continue;
                }
                let place = self.at(beside);
                // The box of the node's new parent at this place.
                let gain = saved - place.bounds.union(bounds).half_area();
                if gain > best.gain {
                    best = Move { gain, beside, ..best };
                }
                if let Below::Nodes(sides) = place.below {
                    // Farther below, this place grows to the box of that parent.
                    open.extend(sides.map(|side| (gain + place.area, side)));
                }
            }
            if pivot != parent {
                left = left.union(self.at(beside).bounds);
                saved += self.at(pivot).area - left.half_area();
            }
            if pivot == ROOT {
                break;
            }
            beside = self.sibling(pivot);
            pivot = self.parent(pivot);
        }
        let is_elsewhere = ![NONE, parent, self.sibling(node)].contains(&best.beside);
        is_elsewhere.then_some(best)
    }

    /// Moves a node, together with its parent, beside another node.
    fn reinsert(&mut self, Move { node, beside, .. }: Move) {
        let (parent, sibling) = (self.parent(node), self.sibling(node));
        let grandparent = self.parent(parent);
        self.replace(parent, sibling);
        self.fit(grandparent);
        self.replace(beside, parent);
        self.0[parent as usize].below = Below::Nodes([beside, node]);
        self.0[beside as usize].parent = parent;
        self.fit(parent);
    }

    /// Puts the node `to` in the place of `from`.
    fn replace(&mut self, from: u32, to: u32) {
        let parent = self.parent(from);
        self.0[to as usize].parent = parent;
        if let Below::Nodes(sides) = &mut self.0[parent as usize].below {
            sides.iter_mut().filter(|side| **side == from).for_each(|side| *side = to);
        }
    }

    /// Refits the boxes of a node and all nodes above it.
    fn fit(&mut self, mut node: u32) {
        while node != NONE {
            if let Below::Nodes(sides) = self.at(node).below {
                let [left, right] = sides.map(|side| self.at(side).bounds);
                let bounds = left.union(right);
                let fitted = &mut self.0[node as usize];
                (fitted.bounds, fitted.area) = (bounds, bounds.half_area());
            }
            node = self.parent(node);
        }
    }

    /// Number of levels of nodes.
    fn depth(&self) -> u32 {
        let mut deepest = 0;
        let mut open = vec![(ROOT, 1)];
        while let Some((node, depth)) = open.pop() {
            deepest = deepest.max(depth);
            if let Below::Nodes(sides) = self.at(node).below {
                open.extend(sides.map(|side| (side, depth + 1)));
            }
        }
        deepest
    }

    /// Writes a subtree to places from `at` on; returns the index behind it.
    fn put(&self, node: u32, places: &mut [BinaryNode], at: usize) -> usize {
        let LooseNode { bounds, below, .. } = *self.at(node);
        let (min, max) = (bounds.min.to_array(), bounds.max.to_array());
        let (first, rest, end) = match below {
            Below::Items { first, count } => (first, count, at + 1),
            Below::Nodes([left, right]) => {
                let middle = self.put(left, places, at + 1);
                let end = self.put(right, places, middle);
                (0, (middle - at) as u32 | INNER, end)
            }
        };
        places[at] = BinaryNode { min, max, first, rest };
        end
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::super::Item;
    use super::super::tests::{items, leaves};
    use super::*;
    use crate::accel::tests::random;

    /// Long and thin boxes along each axis, like parts of houses.
    fn beams(count: u32) -> Vec<Item> {
        let beam = |n: u32| {
            let min = Vec3A::from(random(60, n));
            let size = 0.005 + Vec3A::AXES[n as usize % 3] * random(61, n).x;
            Item::new(Aabb { min, max: min + size }, n, 1)
        };
        (0..count).map(beam).collect()
    }

    fn surface(tree: &BinaryTree) -> f32 {
        let mut nodes = Vec::new();
        add(&mut nodes, &tree.nodes, NONE);
        nodes.iter().map(|node| node.area).sum()
    }

    fn indices(tree: &BinaryTree) -> Vec<Vec<usize>> {
        let mut all = Vec::new();
        leaves(tree.root(), &mut all);
        all
    }

    #[test]
    fn nothing_is_lost_and_surface_is_gained_whatever_the_threads() {
        let few = [0, 1, 2, 7, 100].map(|count| (items(count), 0.0));
        let many = [(items(50_000), 0.001), (beams(200), 0.01), (beams(20_000), 0.1)];
        for (items, gain) in few.into_iter().chain(many) {
            let built = BinaryTree::new(items.clone().into(), 4);
            let [one, three] = [1, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let tree = || BinaryTree::new(items.clone().into(), 4).improved();
                pool.expect("threads").install(tree)
            });
            assert_eq!(indices(&one), indices(&three));
            let sorted = |tree: &BinaryTree| {
                let mut leaves = indices(tree);
                leaves.sort();
                leaves
            };
            assert_eq!(sorted(&built), sorted(&one));
            let (before, after) = (surface(&built), surface(&one));
            assert!(after <= (1.0 - gain) * before, "{}: {before} to {after}", items.len());
        }
    }

    /// A move's stated gain is the surface area that it removes.
    #[test]
    fn gains_are_what_they_are_said_to_be() {
        let tree = BinaryTree::new(beams(500).into(), 4);
        let mut loose = Loose(Vec::new());
        add(&mut loose.0, &tree.nodes, NONE);
        let mut moved = 0;
        for node in 1..loose.0.len() as u32 {
            if [ROOT, NONE].contains(&loose.parent(node)) {
                continue;
            }
            let Some(better) = loose.better_place(node) else { continue };
            let sum = |loose: &Loose| loose.0.iter().map(|node| f64::from(node.area)).sum::<f64>();
            let before = sum(&loose);
            loose.reinsert(better);
            let gain = before - sum(&loose);
            assert!(
                (gain - f64::from(better.gain)).abs() < 1e-4 * before,
                "{gain} {}",
                better.gain
            );
            moved += 1;
        }
        assert!(moved > 20, "{moved}");
    }

    /// Equal boxes, boxes without size, and boxes in a row, each twice as large as the one before.
    #[test]
    fn strange_boxes() {
        let cube = |at: f32, size: f32| Aabb {
            min: glam::Vec3A::splat(at),
            max: glam::Vec3A::splat(at + size),
        };
        let shapes: [fn(u32) -> (f32, f32); 4] = [
            |_| (0.0, 1.0),
            |_| (0.0, 0.0),
            |n| (2f32.powi(n as i32 % 120), 2f32.powi(n as i32 % 120)),
            |n| (0.0, 1.0 + n as f32),
        ];
        for shape in shapes {
            let item = |n: u32| {
                let (at, size) = shape(n);
                Item::new(cube(at, size), n, 1)
            };
            let items: Vec<_> = (0..3000).map(item).collect();
            let tree = BinaryTree::new(items.into(), 4).improved();
            let mut found = indices(&tree).concat();
            found.sort_unstable();
            assert!(found.into_iter().eq(0..3000));
        }
    }
}
