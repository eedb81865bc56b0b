//! Ray tracing: finds the surface that a ray meets.
//!
//! With two levels ([`Levels`]) each mesh has a bounding-volume hierarchy in object space
//! ([`triangle_bvh`]), which [`cache`] keeps from snapshot to snapshot. A small hierarchy over the
//! placed instances is rebuilt whenever the scene has changed. With one level, a single hierarchy
//! holds all triangles of a moment.
//!
//! Hierarchies are built as binary trees by binned SAH ([`build`]) and collapsed ([`mod@collapse`])
//! to eight children a node ([`wide`]). [`walk`] traverses them, with AVX2 or NEON where the
//! processor has it ([`kernel`]).
//!
//! Triangles of one mesh that share an edge (bit-equal positions) leave no gap. The edge functions
//! of both are exact negatives of each other, and box tests err outwards. Rays are transformed
//! separately for each instance, so there may be gaps between instances.

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

/// Number of levels of hierarchies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Levels {
    /// One hierarchy for each mesh, and one over the instances. Where something moves, little is
    /// rebuilt.
    #[default]
    Two,
    /// One hierarchy over all triangles of the scene, for many samples of one moment. Rays need not
    /// pass from instance to instance. Nearest hits are 1.35 times as fast in the Breakfast room,
    /// which has 53 overlapping instances. Two levels are used where shared meshes would take far
    /// more memory.
    One,
}

/// Effort to build a hierarchy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trees {
    /// Built top down, for geometry that deforms.
    AsBuilt,
    /// Built and then improved, which takes about as long again; for geometry that lasts. Nearest
    /// hits on Sponza are 1.15 times as fast.
    #[default]
    Improved,
}

/// A ray from t = 0 (exclusive) to `t_max` (inclusive).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    /// Metres.
    pub(crate) origin: Vec3,
    /// Direction of any length above zero; t is in units of that length.
    pub(crate) direction: Vec3,
    /// End of the ray; may be infinite.
    pub(crate) t_max: f32,
}

/// Share of its length by which a shadow ray ends early (as pbrt-v4's `ShadowEpsilon`). A light may
/// lie in the plane of a surface. This share is 800 roundings of the distance. So the surface does
/// not hide the light where rays meet the plane at slopes of 1 in 100 or more.
const SHORT: f32 = 1e-4;

impl Ray {
    /// The ray from `origin` to just before the point at `origin + to`, metres.
    #[inline(always)]
    pub(crate) fn reaching(origin: Vec3, to: Vec3) -> Self {
        let direction = to.normalize_or(Vec3::Y);
        Self { origin, direction, t_max: Self::end_before(to.length()) }
    }

    /// End of a shadow ray to a point at this distance in metres.
    #[inline(always)]
    pub(crate) fn end_before(distance: f32) -> f32 {
        distance * (1.0 - SHORT)
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// Distance in units of the direction's length.
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
    /// Whether the transform is a translation, so that directions stay as they are.
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
    /// Builds the top level over instances given as (index, world_from_object, hierarchy).
    /// Instances without triangles are left out.
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

    /// World bounds of all instances; empty for an empty scene.
    pub(crate) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The only hierarchy with the instance that it counts from, if there is one and it is in world
    /// space.
    fn whole(&self) -> Option<(u32, &Arc<TriangleBvh>)> {
        match self.placed.as_slice() {
            [only] if only.object_from_world == Affine3A::IDENTITY => {
                Some((only.instance, &only.bvh))
            }
            _ => None,
        }
    }

    /// Size in bytes; hierarchies that instances share count once.
    pub(crate) fn bytes(&self) -> usize {
        let mut seen = std::collections::HashSet::new();
        let shared = self.placed.iter().filter(|p| seen.insert(Arc::as_ptr(&p.bvh)));
        size_of_val::<[Node]>(&self.nodes)
            + size_of_val(self.placed.as_slice())
            + shared.map(|p| p.bvh.bytes()).sum::<usize>()
    }

    /// Finds the nearest surface on each ray that `accept` accepts. The value that comes with a ray
    /// is passed to `accept` and `found`. Rays finish in no particular order.
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

    /// Tells whether any surface that `accept` accepts lies on each ray; otherwise like
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

/// A tree over boxes, one in each leaf. Leaf indices are indices of the boxes.
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

    /// The box around the transformed box, widened by the rounding error of the transform.
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
