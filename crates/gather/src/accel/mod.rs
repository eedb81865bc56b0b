//! Which surface does a ray meet?
//!
//! Two levels: one bounding-volume hierarchy a mesh in object space ([`triangle_bvh`]), kept from
//! snapshot to snapshot by [`cache`], and a small one over the placed instances, rebuilt whenever
//! the scene has changed. Or one, over all triangles of a moment ([`Levels`]). All are built as binary
//! trees by binned SAH ([`build`]), collapsed ([`mod@collapse`]) to eight children a node ([`wide`]) and walked by the
//! code in [`kernel`], with AVX2 or NEON where the processor has it.
//!
//! What holds at edges: triangles of one mesh that share an edge (bit-equal positions) leave no gap,
//! since the edge functions of both are exact negatives of each other and box tests err outwards.
//! Between different instances rays are transformed separately, so no such promise is made.

mod build;
mod cache;
mod cells;
mod collapse;
mod dispatch;
mod item_buffer;
mod kernel;
#[cfg(target_arch = "x86_64")]
mod kernel_avx2;
#[cfg(target_arch = "aarch64")]
mod kernel_neon;
mod kernel_portable;
mod light_buffer;
mod pages;
#[cfg(test)]
mod tests;
mod triangle_bvh;
mod triangles;
mod walk;
mod wide;

use std::sync::Arc;

use glam::{Affine3A, Mat3A, Vec3, Vec3A};

pub(crate) use cache::AccelCache;
pub(crate) use item_buffer::{ItemBuffer, Pyramid};
pub(crate) use kernel::Kernel;
pub(crate) use light_buffer::LightBuffer;
pub(crate) use triangle_bvh::TriangleBvh;
pub(crate) use walk::{Stacks, fetch_ahead};

use build::{BinaryTree, Item};
use pages::Pages;
use wide::{LEAF, Node};

/// How many hierarchies lie above each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Levels {
    /// One a mesh, and one over the instances: where something moves, little has to be built anew.
    #[default]
    Two,
    /// One over all triangles of the scene: for many samples of one moment, since rays need not pass
    /// from instance to instance (the Breakfast room, of 53 overlapping ones: nearest hits 1.35 times
    /// as fast). Where instances share meshes so often that it would take far more memory, two.
    One,
}

/// How much is done for a hierarchy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trees {
    /// Built top down, and that is it: for what changes its shape.
    AsBuilt,
    /// Then improved, for about as long again: for what lasts (Sponza: nearest hits 1.15 times as fast).
    #[default]
    Improved,
}

/// A ray from t = 0 (exclusive) to `t_max` (inclusive).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    /// Metres.
    pub(crate) origin: Vec3,
    /// Any length above zero; t counts in its lengths.
    pub(crate) direction: Vec3,
    /// Where it ends; may be infinite.
    pub(crate) t_max: f32,
}

/// Of its way, how far before what it reaches for a ray ends (as pbrt-v4's `ShadowEpsilon`). A light may
/// lie in the very plane of a surface: 800 roundings of its distance let it be seen beside that surface
/// where the plane is as flat as 1 in 100.
const SHORT: f32 = 1e-4;

impl Ray {
    /// From `origin` to what lies `to` from there, metres, and ends just before that.
    #[inline(always)]
    pub(crate) fn reaching(origin: Vec3, to: Vec3) -> Self {
        let direction = to.normalize_or(Vec3::Y);
        Self { origin, direction, t_max: Self::end_before(to.length()) }
    }

    /// Where a ray ends that reaches for what lies so many metres away.
    #[inline(always)]
    pub(crate) fn end_before(distance: f32) -> f32 {
        distance * (1.0 - SHORT)
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// Distance in lengths of the ray's direction.
    pub(crate) t: f32,
    /// Barycentric weight of the triangle's second vertex.
    pub(crate) u: f32,
    /// Barycentric weight of the triangle's third vertex.
    pub(crate) v: f32,
    /// Index into the snapshot's instances.
    pub(crate) instance: u32,
    /// Index into the mesh's primitives.
    pub(crate) primitive: u32,
    /// Index into the primitive's triangles.
    pub(crate) triangle: u32,
}

/// An instance at its place, ready to be traced.
#[derive(Debug)]
struct Placed {
    /// Index into the snapshot's instances.
    instance: u32,
    object_from_world: Affine3A,
    /// The transform only moves, so that directions stay as they are.
    only_moves: bool,
    bvh: Arc<TriangleBvh>,
}

impl Hit {
    /// Barycentric weights of the triangle's vertices.
    #[inline]
    pub(crate) fn weights(&self) -> Vec3 {
        Vec3::new(1.0 - self.u - self.v, self.u, self.v)
    }
}

/// The acceleration structure of one snapshot.
#[derive(Debug)]
pub(crate) struct Accel {
    nodes: Pages<Node>,
    placed: Vec<Placed>,
    bounds: Aabb,
    kernel: Kernel,
}

impl Accel {
    /// Builds the top level over instances given as (index, transform, hierarchy). Those without
    /// triangles are left out.
    pub(crate) fn new(
        instances: impl IntoIterator<Item = (u32, Affine3A, Arc<TriangleBvh>)>,
        kernel: Kernel,
    ) -> Self {
        let mut placed = Vec::new();
        let mut boxes = Vec::new();
        for (instance, world_from_object, bvh) in instances {
            if bvh.bounds().is_empty() {
                continue;
            }
            boxes.push(bvh.bounds().transformed(&world_from_object));
            let object_from_world = world_from_object.inverse();
            let only_moves = object_from_world.matrix3 == Mat3A::IDENTITY;
            placed.push(Placed { instance, object_from_world, only_moves, bvh });
        }
        let (nodes, bounds) = over_boxes(&boxes);
        Self { nodes, placed, bounds, kernel }
    }

    pub(crate) fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// World bounds of everything; empty for an empty scene.
    pub(crate) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The only hierarchy there is, if it lies in the world, and the instance that it counts from.
    fn whole(&self) -> Option<(u32, &Arc<TriangleBvh>)> {
        match self.placed.as_slice() {
            [only] if only.object_from_world == Affine3A::IDENTITY => {
                Some((only.instance, &only.bvh))
            }
            _ => None,
        }
    }

    /// Bytes that it takes, hierarchies that instances share counted once.
    pub(crate) fn bytes(&self) -> usize {
        let mut seen = std::collections::HashSet::new();
        let shared = self.placed.iter().filter(|p| seen.insert(Arc::as_ptr(&p.bvh)));
        size_of_val::<[Node]>(&self.nodes)
            + size_of_val(self.placed.as_slice())
            + shared.map(|p| p.bvh.bytes()).sum::<usize>()
    }

    /// The nearest surface on each ray that `accept` lets count. What comes with a ray tells `accept`
    /// and `found` which it is; they are done in no particular order.
    #[inline]
    pub(crate) fn closest<T: Copy>(
        &self,
        rays: impl Iterator<Item = (Ray, T)>,
        stacks: &mut Stacks,
        accept: impl Fn(&T, &Hit) -> bool,
        found: impl FnMut(T, Option<Hit>),
    ) {
        dispatch::trace::<false, T>(self, rays, stacks, accept, found);
    }

    /// Whether any surface that `accept` lets count lies on each ray; otherwise like
    /// [`Self::closest`].
    #[inline]
    pub(crate) fn occluded<T: Copy>(
        &self,
        rays: impl Iterator<Item = (Ray, T)>,
        stacks: &mut Stacks,
        accept: impl Fn(&T, &Hit) -> bool,
        mut found: impl FnMut(T, bool),
    ) {
        dispatch::trace::<true, T>(self, rays, stacks, accept, |with, hit| {
            found(with, hit.is_some())
        });
    }
}

/// A tree over boxes, one a leaf; leaf indices are those of the boxes.
fn over_boxes(boxes: &[Aabb]) -> (Pages<Node>, Aabb) {
    let items = (0..).zip(boxes).map(|(index, &bounds)| Item::new(bounds, index, 1));
    let tree = BinaryTree::new(items.collect::<Vec<_>>().into(), 1);
    let (mut nodes, leaves) = collapse::collapse(&tree, |items| items[0].indices().start as u32);
    for child in nodes.iter_mut().flat_map(|node| &mut node.child) {
        if let Some(index) = leaves.get((*child ^ LEAF) as usize) {
            *child = LEAF | index;
        }
    }
    (nodes, tree.root().bounds())
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    pub(crate) min: Vec3A,
    pub(crate) max: Vec3A,
}

impl Aabb {
    pub(crate) const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    pub(crate) fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    #[must_use]
    pub(crate) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    #[must_use]
    pub(crate) fn with(self, point: Vec3A) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// Half the surface area, 0 when empty.
    pub(crate) fn half_area(&self) -> f32 {
        let d = (self.max - self.min).max(Vec3A::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    pub(crate) fn center(&self) -> Vec3A {
        0.5 * (self.min + self.max)
    }

    fn corners(&self) -> impl Iterator<Item = [f64; 3]> + use<> {
        let ends = [self.min, self.max].map(|end| end.to_array());
        let corner = move |n: usize| [0, 1, 2].map(|axis| f64::from(ends[n >> axis & 1][axis]));
        (0..8).map(corner)
    }

    /// The box around the transformed box, widened by the rounding of the transform.
    fn transformed(&self, to: &Affine3A) -> Self {
        let center = to.transform_point3a(self.center());
        let half = 0.5 * (self.max - self.min);
        let extent = abs(&to.matrix3) * half;
        let rounding =
            8.0 * f32::EPSILON * (center.abs() + extent + abs(&to.matrix3) * self.center().abs());
        Self { min: center - extent - rounding, max: center + extent + rounding }
    }
}

/// The matrix of absolute values.
pub(crate) fn abs(m: &Mat3A) -> Mat3A {
    Mat3A::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}
