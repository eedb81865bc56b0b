//! Rays towards a directional light without a size, answered without a walk through a tree.
//!
//! They are all parallel, so that which triangles one may meet depends on two coordinates alone.
//! A plane across them is divided into cells, and each cell knows what lies over it (Haines and
//! Greenberg 1986, "The Light Buffer: A Shadow-Testing Accelerator"): blocks of triangles, the highest
//! first, down to a height below which all is in shadow, because one opaque triangle covers the
//! whole cell there. Most rays end at that height, the others meet few blocks; and a ray's cell is
//! known before it is looked at, so that it can be asked for early. Cells over which too many blocks
//! lie (a car in a desert) leave their rays to the hierarchy.
//!
//! Blocks are those of the hierarchy and are tested by the same instructions, so that a ray finds
//! here what it finds there. What a cell lists, and what covers it, errs towards testing.
//!
//! Coordinates are those of the triangle test: what is sheared so that the rays become the last axis
//! ([`Setup`]); a height is the distance along a ray from the plane through the world's origin.

mod fill;

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec3A};

use super::kernel::{Kernel, Setup, TriangleHits, fetch_line, nearest, triangles_portable};
use super::pages::Pages;
use super::triangle_bvh::Block;
use super::{Accel, Hit, Ray, TriangleBvh, fetch_ahead};
use fill::{Filled, Grid, Margins};

/// Rays whose cells are asked for before the first of them is looked at.
const AHEAD: usize = 16;

/// What lies between a directional light and the surfaces of a scene.
#[derive(Debug)]
pub(crate) struct LightBuffer {
    kernel: Kernel,
    /// Of every ray, but for its origin.
    setup: Setup,
    /// Along every ray.
    direction: Vec3,
    grid: Grid,
    /// Row by row, and one that ends the last one's list.
    cells: Pages<Cell>,
    blockers: Pages<Blocker>,
    /// Whose blocks they are.
    bvh: Arc<TriangleBvh>,
    /// The instance that the blocks count from.
    instance: u32,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Cell {
    /// Whatever lies lower is in shadow.
    covered_below: f32,
    /// Its first blocker; the last is the one before the next cell's.
    first: u32,
}

/// A block with triangles over a cell.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Blocker {
    /// No point of its triangles over the cell lies higher.
    height: f32,
    block: u32,
}

impl Blocker {
    /// In place of more than are worth listing.
    const TOO_MANY: Self = Self { height: f32::INFINITY, block: u32::MAX };
}

impl LightBuffer {
    /// For rays along `direction` (unit) from the surfaces of a scene. `is_opaque` tells of the
    /// primitives (instance, primitive) whose triangles stop every ray that does not start at them;
    /// `slack`, metres, is how far beside its triangle a ray may start. `None` where the structure is
    /// not a single hierarchy in the world, or is empty.
    pub(crate) fn new(
        accel: &Accel,
        direction: Vec3,
        slack: f32,
        is_opaque: impl Fn(u32, u32) -> bool + Sync,
    ) -> Option<Self> {
        let (instance, bvh) = accel.whole()?;
        let setup = Setup::new(Vec3A::ZERO, direction.into());
        let is_opaque = |block: &Block, lane: usize| {
            is_opaque(instance + block.instance[lane], block.primitive[lane])
        };
        let bounds = accel.bounds();
        let extent = f64::from(bounds.min.abs().max(bounds.max.abs()).max_element());
        let Filled { grid, cells, blockers } =
            fill::over(&bvh.blocks, &setup, Margins::new(extent, slack.into()), is_opaque)?;
        Some(Self {
            kernel: accel.kernel(),
            setup,
            direction,
            grid,
            cells,
            blockers,
            bvh: bvh.clone(),
            instance,
        })
    }

    /// Whether it is for this ray, if that starts at a surface of the scene.
    #[inline(always)]
    pub(crate) fn answers(&self, ray: &Ray) -> bool {
        ray.direction == self.direction && ray.t_max == f32::INFINITY
    }

    /// Whether any surface that `accept` lets count lies on each of the rays, which it must be for;
    /// otherwise like [`Accel::occluded`]. Rays that it cannot tell of are passed to `left`.
    #[inline]
    pub(crate) fn occluded<T: Copy>(
        &self,
        rays: impl Iterator<Item = (Ray, T)>,
        accept: impl Fn(&T, &Hit) -> bool,
        found: impl FnMut(T, bool),
        left: impl FnMut(Ray, T),
    ) {
        match self.kernel {
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2(_) => {
                #[expect(unsafe_code, reason = "calls code compiled for AVX2")]
                // SAFETY: `Avx2` is made only by `Kernel::detect`, after the check for what it needs.
                unsafe {
                    super::kernel_avx2::occluded(self, rays, accept, found, left);
                }
            }
            #[cfg(target_arch = "aarch64")]
            Kernel::Neon => {
                #[expect(unsafe_code, reason = "calls code compiled for NEON")]
                // SAFETY: `kernel_neon` refuses to compile for a target without NEON.
                unsafe {
                    super::kernel_neon::occluded(self, rays, accept, found, left);
                }
            }
            Kernel::Portable => {
                self.occluded_with(rays, accept, found, left, triangles_portable);
            }
        }
    }

    /// [`Self::occluded`], by what tests a block. Each step is taken for several rays before the next,
    /// while what they ask for is on its way.
    #[inline(always)]
    pub(super) fn occluded_with<T: Copy>(
        &self,
        mut rays: impl Iterator<Item = (Ray, T)>,
        accept: impl Fn(&T, &Hit) -> bool,
        mut found: impl FnMut(T, bool),
        mut left: impl FnMut(Ray, T),
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
                match self.bvh.blocks.get(query.blockers[0].block as usize) {
                    Some(block) => fetch_ahead(block),
                    None => left(query.ray, query.with),
                }
                query.blockers[0].block != Blocker::TOO_MANY.block
            });
            for query in queries.drain(..) {
                let setup = Setup { origin: query.ray.origin.to_array(), ..self.setup };
                let higher = query.blockers.iter();
                let mut higher = higher.take_while(|blocker| blocker.height >= query.height);
                let occluded = higher.any(|blocker| {
                    let block = &self.bvh.blocks[blocker.block as usize];
                    let hits = triangles(block, &setup, f32::INFINITY);
                    let accept = |hit: &Hit| accept(&query.with, hit);
                    hits.mask != 0 && nearest(block, self.instance, hits, accept).is_some()
                });
                found(query.with, occluded);
            }
        }
    }

    /// Asks for the cell over which a ray starts.
    #[inline(always)]
    fn query<T>(&self, ray: Ray, with: T) -> Query<'_, T> {
        let [x, y, z] = self.setup.axes.map(|axis| ray.origin[axis]);
        let Setup { shear, .. } = self.setup;
        let cell = self.grid.cell([x - shear[0] * z, y - shear[1] * z]);
        // Beyond the last nothing lies.
        let cell = cell.unwrap_or(self.cells.len());
        fetch_line(self.cells.as_ptr().wrapping_add(cell).cast());
        Query { with, ray, height: z * shear[2], cell, blockers: &[] }
    }

    /// What the cell alone tells; else asks for what lies over it.
    #[inline(always)]
    fn look_up<'a, T>(&'a self, query: &mut Query<'a, T>) -> Option<bool> {
        let Some([cell, next]) = self.cells.get(query.cell..query.cell + 2) else {
            return Some(false);
        };
        if query.height < cell.covered_below {
            return Some(true);
        }
        query.blockers = &self.blockers[cell.first as usize..next.first as usize];
        fetch_line(query.blockers.as_ptr().cast());
        query.blockers.is_empty().then_some(false)
    }
}

/// A ray on its way through the steps.
struct Query<'a, T> {
    with: T,
    ray: Ray,
    /// Where it starts.
    height: f32,
    cell: usize,
    /// What lies over the cell.
    blockers: &'a [Blocker],
}
