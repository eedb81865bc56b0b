//! The hierarchy over triangles: of one mesh, in object space, or of a whole scene, in the world.

use bytemuck::{Pod, Zeroable};
use glam::Vec3A;
use lumencast_scene::{Instance, Mesh, Vertices};
use rayon::prelude::*;

use super::build::{BinaryTree, Item};
use super::collapse::collapse;
use super::pages::Pages;
use super::wide::{LEAF, Node};
use super::{Aabb, Trees};

/// Triangles a leaf.
pub(super) const LANES: usize = 4;
/// When refitting has made the tree this much dearer than it was when built, it is built anew.
const REBUILD_COST: f32 = 1.8;
const UNUSED: u32 = u32::MAX;

/// Up to four triangles, laid out so that one instruction tests all: three cache lines. Eight to a
/// block cost more memory traffic than the fewer visits save (any-hit rays on Sponza 5 % slower).
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// Vertex, axis, lane. Unused lanes hold a triangle without area, which no ray meets.
    pub(super) corners: [[[f32; LANES]; 3]; 3],
    pub(super) primitive: [u32; LANES],
    pub(super) triangle: [u32; LANES],
    /// Counted from the instance that the hierarchy is placed as.
    pub(super) instance: [u32; LANES],
}

impl Block {
    pub(super) const EMPTY: Self = Self {
        corners: [[[0.0; LANES]; 3]; 3],
        primitive: [0; LANES],
        triangle: [UNUSED; LANES],
        instance: [0; LANES],
    };

    /// Which lanes hold a triangle.
    pub(super) fn is_used(&self) -> [bool; LANES] {
        self.triangle.map(|triangle| triangle != UNUSED)
    }

    pub(super) fn set(&mut self, lane: usize, corners: [Vec3A; 3]) {
        for (vertex, corner) in corners.iter().enumerate() {
            for axis in 0..3 {
                self.corners[vertex][axis][lane] = corner[axis];
            }
        }
    }
}

/// Names a triangle.
#[derive(Clone, Copy)]
struct Id {
    instance: u32,
    primitive: u32,
    triangle: u32,
}

/// The triangles of a mesh.
fn ids(instance: u32, mesh: &Mesh) -> impl Iterator<Item = Id> + '_ {
    (0..).zip(&mesh.primitives).flat_map(move |(primitive, p)| {
        let count = p.triangles.len() as u32;
        (0..count).map(move |triangle| Id { instance, primitive, triangle })
    })
}

/// A bounding-volume hierarchy over triangles.
#[derive(Clone, Debug)]
pub(crate) struct TriangleBvh {
    pub(super) nodes: Pages<Node>,
    pub(super) blocks: Pages<Block>,
    bounds: Aabb,
    /// SAH cost when built.
    cost: f32,
}

impl TriangleBvh {
    /// Builds over the mesh at rest, or over `deformed` vertices (one entry a primitive).
    pub(crate) fn build(mesh: &Mesh, deformed: Option<&[Vertices]>, trees: Trees) -> Self {
        let source = Source { mesh, deformed };
        Self::over(ids(0, mesh).collect(), trees, |id| source.corners(id.primitive, id.triangle))
    }

    /// Builds over all triangles of instances, in world space.
    pub(crate) fn whole(instances: &[Instance], trees: Trees) -> Self {
        let all = (0..).zip(instances).flat_map(|(n, instance)| ids(n, &instance.mesh));
        Self::over(all.collect(), trees, |id| {
            let instance = &instances[id.instance as usize];
            let deformed = instance.deformation.as_ref().map(|d| d.vertices());
            let source = Source { mesh: &instance.mesh, deformed };
            let to_world = |corner| instance.world_from_object.transform_point3a(corner);
            source.corners(id.primitive, id.triangle).map(to_world)
        })
    }

    fn over(ids: Vec<Id>, trees: Trees, corners: impl Fn(Id) -> [Vec3A; 3] + Sync) -> Self {
        let chunks = ids.par_chunks(CHUNK).enumerate();
        let items: Vec<_> = chunks
            .map(|(n, chunk)| paired(n * CHUNK, chunk.iter().map(|&id| around(corners(id)))))
            .collect();
        let tree = BinaryTree::new(items.concat(), LANES);
        let tree = match trees {
            Trees::AsBuilt => tree,
            Trees::Improved => tree.improved(),
        };
        let (nodes, leaves) = collapse(&tree);
        let block = |leaf: usize| {
            let mut block = Block::EMPTY;
            let things = leaves[leaf].iter().flat_map(Item::indices);
            for (lane, id) in things.map(|index| ids[index]).enumerate() {
                block.instance[lane] = id.instance;
                block.primitive[lane] = id.primitive;
                block.triangle[lane] = id.triangle;
                block.set(lane, corners(id));
            }
            block
        };
        let blocks = Pages::filled(leaves.len(), block);
        let cost = cost(&nodes);
        Self { nodes, blocks, bounds: tree.root().bounds(), cost }
    }

    /// Bytes of its nodes and triangles.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val::<[Node]>(&self.nodes) + size_of_val::<[Block]>(&self.blocks)
    }

    /// Object-space bounds.
    pub(crate) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Brings the hierarchy to new vertices of the same mesh: its boxes are fitted anew, and where
    /// that leaves too poor a tree it is rebuilt. Costs about a tenth of building.
    pub(crate) fn refit(&mut self, mesh: &Mesh, deformed: &[Vertices]) {
        let source = Source { mesh, deformed: Some(deformed) };
        let mut boxes = Vec::with_capacity(self.blocks.len());
        for block in self.blocks.iter_mut() {
            let mut bounds = Aabb::EMPTY;
            for lane in 0..LANES {
                if !block.is_used()[lane] {
                    continue;
                }
                let corners = source.corners(block.primitive[lane], block.triangle[lane]);
                block.set(lane, corners);
                bounds = bounds.union(around(corners));
            }
            boxes.push(bounds);
        }
        for n in (0..self.nodes.len()).rev() {
            let mut node = self.nodes[n];
            for (lane, child) in self.nodes[n].lanes() {
                let bounds = match child & LEAF {
                    0 => self.nodes[child as usize].bounds(),
                    _ => boxes[(child & !LEAF) as usize],
                };
                node.set_bounds(lane, bounds);
            }
            self.nodes[n] = node;
        }
        self.bounds = self.nodes[0].bounds();
        if !self.bounds.min.is_finite() || cost(&self.nodes) > REBUILD_COST * self.cost {
            *self = Self::build(mesh, Some(deformed), Trees::AsBuilt);
        }
    }
}

/// Triangles that a thread looks at together when a tree is built.
const CHUNK: usize = 4096;
/// Two triangles stay together if the box around both has at most this share of the sum of their own
/// boxes' areas.
const PAIRED: f32 = 0.9;

/// Triangles from an index on, given by their boxes, as items: neighbours that are two halves of a
/// quad, as most are, as one. Nearly as good a tree over half as many items. What is not finite is
/// left out.
fn paired(first: usize, boxes: impl Iterator<Item = Aabb>) -> Vec<Item> {
    let mut items = Vec::with_capacity(boxes.size_hint().0);
    let mut last: Option<(u32, Aabb)> = None;
    let alone = |(index, bounds)| Item::new(bounds, index, 1);
    for (index, bounds) in (first as u32..).zip(boxes) {
        if !(bounds.min.is_finite() && bounds.max.is_finite()) {
            continue;
        }
        if let Some((before, other)) = last.filter(|(before, _)| before + 1 == index) {
            let both = other.union(bounds);
            if both.half_area() <= PAIRED * (other.half_area() + bounds.half_area()) {
                items.push(Item::new(both, before, 2));
                last = None;
                continue;
            }
        }
        items.extend(last.replace((index, bounds)).map(alone));
    }
    items.extend(last.map(alone));
    items
}

/// Expected number of nodes and leaves that a random ray through the root's box visits.
fn cost(nodes: &[Node]) -> f32 {
    let area: f32 =
        nodes.iter().flat_map(|n| n.lanes().map(|(lane, _)| n.lane_bounds(lane).half_area())).sum();
    area / nodes[0].bounds().half_area().max(f32::MIN_POSITIVE)
}

fn around(corners: [Vec3A; 3]) -> Aabb {
    corners.into_iter().fold(Aabb::EMPTY, Aabb::with)
}

struct Source<'a> {
    mesh: &'a Mesh,
    deformed: Option<&'a [Vertices]>,
}

impl Source<'_> {
    fn corners(&self, primitive: u32, triangle: u32) -> [Vec3A; 3] {
        let p = &self.mesh.primitives[primitive as usize];
        let vertices = self.deformed.map_or(&p.vertices, |d| &d[primitive as usize]);
        p.triangles[triangle as usize].map(|i| vertices.positions[i as usize].into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_a_quad_stay_together() {
        let at = |min: [f32; 3], max: [f32; 3]| Aabb { min: min.into(), max: max.into() };
        let quad = at([0.0; 3], [1.0, 1.0, 0.0]);
        let aside = at([5.0, 0.0, 0.0], [6.0, 1.0, 0.0]);
        let lost = at([f32::NAN; 3], [1.0; 3]);
        let found = |boxes: &[Aabb]| -> Vec<_> {
            paired(7, boxes.iter().copied()).iter().map(Item::indices).collect()
        };
        assert_eq!(found(&[quad, quad, aside]), [7..9, 9..10]);
        assert_eq!(found(&[aside, quad, quad, quad]), [7..8, 8..10, 10..11]);
        assert_eq!(found(&[quad, lost, quad]), [7..8, 9..10]);
        // Side by side, their box is as large as both.
        let beside = at([1.0, 0.0, 0.0], [2.0, 1.0, 0.0]);
        assert_eq!(found(&[quad, beside]), [7..8, 8..9]);
        assert!(found(&[lost]).is_empty() && found(&[]).is_empty());
    }
}
