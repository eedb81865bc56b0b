//! Shadow rays towards a directional light without a size, answered without a walk through a tree.
//!
//! These rays are all parallel, so two coordinates tell what a ray may meet ([`super::cells`];
//! Haines and Greenberg 1986, "The Light Buffer: A Shadow-Testing Accelerator"). Most rays need
//! only their cell: whatever starts below an opaque triangle that covers the cell is in shadow, and
//! empty cells occlude nothing.
//!
//! Coordinates are those of the triangle test: space is sheared so that the rays become the last
//! axis ([`Setup`]). A height is the distance along a ray from the plane through the world's
//! origin.

use glam::{Vec3, Vec3A};

use super::cells::{AHEAD, Cells, Flat, Listed, Margins, Shape, corners};
use super::kernel::Kernel;
use super::triangle_bvh::{Block, LANES};
use super::walk::{Setup, TriangleHits, nearest};
use super::{Accel, Hit, Ray, fetch_ahead};

/// Number of cells for each triangle slot of the leaves. Half or four times as many trace as fast;
/// filling takes 0.7 or 2.2 times as long.
const CELLS: f64 = 1.0;

/// The occluders between a directional light and the surfaces of a scene.
#[derive(Debug)]
pub(crate) struct LightBuffer {
    /// The setup of every ray; its origin is unused.
    setup: Setup,
    /// The unit direction of every ray, towards the light.
    direction: Vec3,
    cells: Cells,
}

impl LightBuffer {
    /// Builds the buffer for rays along `direction` (unit) from the surfaces of a scene.
    /// `is_opaque` tells whether the triangles of a primitive (instance, primitive) stop every ray
    /// that does not start at them. `slack`, metres, is how far beside its triangle a ray may
    /// start. `None` where the structure is not a single hierarchy in the world, or is empty.
    pub(crate) fn new(
        accel: &Accel,
        direction: Vec3,
        slack: f32,
        is_opaque: impl Fn(u32, u32) -> bool + Sync,
    ) -> Option<Self> {
        let (_, bvh) = accel.whole()?;
        let setup = Setup::new(Vec3A::ZERO, direction.into());
        let bounds = accel.bounds();
        let extent = f64::from(bounds.min.abs().max(bounds.max.abs()).max_element());
        // This bounds a few roundings of coordinates, each sheared by a factor of at most one.
        let aside = 32.0 * f64::from(f32::EPSILON) * extent;
        let beside = aside + 2.0 * f64::from(slack);
        let margins = Margins { aside, beside, above: aside, share: 0.0 };
        let all = Flat::around(bounds.corners().map(|corner| sheared(&setup, corner)));
        let rectangle = all.grown(4.0 * aside + f64::from(f32::MIN_POSITIVE));
        let count = CELLS * (bvh.blocks.len() * LANES) as f64;
        let shape = |block: &Block, lane: usize| {
            Some(Shape::new(corners(block, lane).map(|corner| sheared(&setup, corner))))
        };
        let cells = Cells::over(accel, &rectangle, count, margins, shape, is_opaque)?;
        Some(Self { setup, direction, cells })
    }

    /// Whether the buffer answers this ray, provided that the ray starts at a surface of the scene.
    #[inline(always)]
    pub(crate) fn answers(&self, ray: &Ray) -> bool {
        ray.direction == self.direction && ray.t_max == f32::INFINITY
    }

    /// The instruction set that its rays are tested with.
    pub(super) fn kernel(&self) -> Kernel {
        self.cells.kernel
    }

    /// [`Self::occluded`] with a given block test. Each step is taken for several rays before the
    /// next step, so that prefetches have time to arrive.
    #[inline(always)]
    pub(super) fn occluded_with<T: Copy>(
        &self,
        mut rays: impl Iterator<Item = (Ray, T)>,
        accept: impl Fn(&T, &Hit) -> bool,
        mut found: impl FnMut(T, bool),
        mut undecided: impl FnMut(Ray, T),
        triangles: impl Fn(&Block, &Setup, f32) -> TriangleHits,
    ) {
        let mut queries: Vec<Query<T>> = Vec::with_capacity(AHEAD);
        loop {
            queries.extend(rays.by_ref().take(AHEAD).map(|(ray, with)| self.query(ray, with)));
            if queries.is_empty() {
                return;
            }
            queries.retain_mut(|query| match self.look_up(query) {
                Some(occluded) => {
                    found(query.with, occluded);
                    false
                }
                None => true,
            });
            queries.retain(|query| {
                let highest = &query.listed[0];
                match self.cells.bvh.blocks.get(highest.block as usize) {
                    Some(block) => fetch_ahead(block),
                    None => undecided(query.ray, query.with),
                }
                !highest.is_too_many()
            });
            for query in queries.drain(..) {
                let setup = Setup { origin: query.ray.origin.to_array(), ..self.setup };
                let higher = query.listed.iter();
                let mut higher = higher.take_while(|listed| listed.height >= query.height);
                let occluded = higher.any(|listed| {
                    let block = &self.cells.bvh.blocks[listed.block as usize];
                    let hits = triangles(block, &setup, f32::INFINITY);
                    let accept = |hit: &Hit| accept(&query.with, hit);
                    hits.mask != 0 && nearest(block, self.cells.instance, hits, accept).is_some()
                });
                found(query.with, occluded);
            }
        }
    }

    /// Prefetches the cell over which a ray starts.
    #[inline(always)]
    fn query<T>(&self, ray: Ray, with: T) -> Query<'_, T> {
        let [x, y, z] = self.setup.axes.map(|axis| ray.origin[axis]);
        let Setup { shear, .. } = self.setup;
        let cell = self.cells.find([x - shear[0] * z, y - shear[1] * z]);
        Query { with, ray, height: z * shear[2], cell, listed: &[] }
    }

    /// Answers the ray by its cell alone; otherwise gives the query the cell's list.
    #[inline(always)]
    fn look_up<'a, T>(&'a self, query: &mut Query<'a, T>) -> Option<bool> {
        let Some(over) = self.cells.look_up(query.cell) else { return Some(false) };
        if query.height < over.covered_below {
            return Some(true);
        }
        query.listed = over.listed;
        over.listed.is_empty().then_some(false)
    }
}

/// Coordinates of a point in the rays' sheared space.
fn sheared(setup: &Setup, point: [f64; 3]) -> [f64; 3] {
    let shear = setup.shear.map(f64::from);
    let [x, y, z] = setup.axes.map(|axis| point[axis]);
    [x - shear[0] * z, y - shear[1] * z, z * shear[2]]
}

/// A ray on its way through the steps of a lookup.
struct Query<'a, T> {
    with: T,
    ray: Ray,
    /// Height of the ray's origin.
    height: f32,
    cell: usize,
    /// Blocks over the cell, the highest first.
    listed: &'a [Listed],
}
