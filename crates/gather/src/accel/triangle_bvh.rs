//! A hierarchy over triangles: of one mesh in object space, or of a whole scene in world space.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3A};
use lumencast_scene::{Instance, Mesh, Vertices};
use rayon::prelude::*;

use super::build::{BinaryTree, Item};
use super::collapse::collapse;
use super::pages::Pages;
use super::triangles::{Triangle, Triangles};
use super::wide::{LEAF, Node};
use super::{Aabb, Trees};

/// Number of triangles in a leaf.
pub(super) const LANES: usize = 4;
/// Ratio of the tree's cost to its cost when built. When refitting exceeds it, the tree is rebuilt.
pub(super) const REBUILD_COST: f32 = 1.8;
const UNUSED: u32 = u32::MAX;

/// Up to four triangles, laid out so that one instruction tests all of them: three cache lines.
/// Blocks of eight cost more memory traffic than they save in visits (any-hit rays on Sponza are 5
/// % slower).
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// Corners by vertex, axis and lane. Unused lanes hold a triangle without area, which no ray
    /// meets.
    pub(super) corners: [[[f32; LANES]; 3]; 3],
    pub(super) primitive: [u32; LANES],
    pub(super) triangle: [u32; LANES],
    /// Index relative to the instance that the hierarchy is placed as.
    pub(super) instance: [u32; LANES],
}

impl Block {
    /// A block of at most [`LANES`] triangles.
    pub(super) fn of<'t>(triangles: impl Iterator<Item = &'t Triangle>) -> Self {
        let mut lanes = [Triangle::new([Vec3A::ZERO; 3], [0, 0, UNUSED]); LANES];
        lanes.iter_mut().zip(triangles).for_each(|(lane, triangle)| *lane = *triangle);
        let axes = [0, 1, 2].map(|vertex| {
            let [a, b, c, d] = lanes.map(|triangle| triangle.0[vertex]);
            Mat4::from_cols(a, b, c, d).transpose().to_cols_array_2d()
        });
        let [instance, primitive, triangle] = axes.map(|[.., name]| name.map(f32::to_bits));
        let corners = axes.map(|[x, y, z, _]| [x, y, z]);
        Self { corners, primitive, triangle, instance }
    }

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

/// A bounding-volume hierarchy over triangles.
#[derive(Clone, Debug)]
pub(crate) struct TriangleBvh {
    pub(super) nodes: Pages<Node>,
    pub(super) blocks: Pages<Block>,
    bounds: Aabb,
    /// SAH cost of the tree when it was built.
    cost: f32,
}

impl TriangleBvh {
    /// Builds over the mesh at rest, or over `deformed` vertices (one entry a primitive).
    pub(crate) fn build(mesh: &Mesh, deformed: Option<&[Vertices]>, trees: Trees) -> Self {
        Self::over(Triangles::of_mesh(mesh, deformed), trees)
    }

    /// Builds over all triangles of instances, in world space.
    pub(crate) fn whole(instances: &[Instance], trees: Trees) -> Self {
        Self::over(Triangles::of_instances(instances), trees)
    }

    fn over(Triangles { all, items }: Triangles, trees: Trees) -> Self {
        let tree = BinaryTree::new(items, LANES);
        let tree = match trees {
            Trees::AsBuilt => tree,
            Trees::Improved => tree.improved(),
        };
        let (nodes, blocks) = collapse(&tree, |items| {
            Block::of(items.iter().flat_map(Item::indices).map(|index| &all[index]))
        });
        let cost = cost(&nodes);
        Self { nodes, blocks, bounds: tree.root().bounds(), cost }
    }

    /// Size of its nodes and triangles in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val::<[Node]>(&self.nodes) + size_of_val::<[Block]>(&self.blocks)
    }

    /// Bounds in the hierarchy's space: object space or the world.
    pub(crate) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Updates the hierarchy to new vertices of the same mesh. It refits the boxes, and rebuilds
    /// the tree where refitting makes it too poor. Refitting costs about a tenth of building.
    pub(crate) fn refit(&mut self, mesh: &Mesh, deformed: &[Vertices]) {
        let fitted = self.fit(mesh, deformed);
        // Triangles that were not finite when the tree was built are not in it, so fewer are
        // fitted.
        let lacks_some = fitted < mesh.triangle_count();
        if lacks_some || cost(&self.nodes) > REBUILD_COST * self.cost {
            *self = Self::build(mesh, Some(deformed), Trees::AsBuilt);
        }
    }

    /// Fits boxes and triangles to new vertices without regard to the tree's quality. Returns the
    /// number of finite triangles.
    pub(super) fn fit(&mut self, mesh: &Mesh, deformed: &[Vertices]) -> usize {
        let mut finite = 0;
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
                finite += usize::from(corners.iter().all(|corner| corner.is_finite()));
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
        finite
    }
}

/// Expected number of nodes and leaves visited by a random ray through the root's box.
pub(super) fn cost(nodes: &[Node]) -> f32 {
    let area = |node: &Node| -> f32 {
        node.lanes().map(|(lane, _)| node.lane_bounds(lane).half_area()).sum()
    };
    // The chunks are fixed, so the sum does not depend on the threads.
    let chunks = nodes.par_chunks(CHUNK).map(|nodes| nodes.iter().map(area).sum());
    let areas: Vec<f32> = chunks.collect();
    areas.iter().sum::<f32>() / nodes[0].bounds().half_area().max(f32::MIN_POSITIVE)
}

/// Number of nodes that a thread takes together.
const CHUNK: usize = 1024;

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
