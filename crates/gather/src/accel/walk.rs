//! The walk through the hierarchies.
//!
//! Several rays are in flight at once, one step of each in turn. A step waits for a node from the
//! caches and then for one instruction after another. Meanwhile the processor works on the next
//! ray. That only helps if it can predict the next instructions. So with AVX2 children are pushed
//! without a branch on which and how many they are. Sorting them by distance would cost branches;
//! the tree instead stores an order for each octant of directions (Fuetterling et al. 2017,
//! "Accelerated single ray tracing for wide vector units").
//!
//! [`trace_with`] is the walk itself. The tests of eight boxes and of a block of triangles are
//! passed in, so that it can be compiled for AVX2, NEON or neither; [`super::dispatch`] chooses.
//!
//! Boxes: the slab test, with far distances widened by 1 + 2γ(3) so that rounding errs towards
//! visiting (Ize 2013, "Robust BVH ray traversal").
//!
//! Triangles: the vertices are sheared so that the ray becomes the z axis, and the signs of the
//! edges' 2D cross products decide (Woop, Benthin and Wald 2013, "Watertight ray/triangle
//! intersection"). A vertex's sheared place does not depend on the triangle. Two triangles that
//! share an edge compute exact negatives for it, which is why there is no fused multiply-add. Zero
//! counts as inside for both. So a ray cannot slip between them, neither at edges nor at vertices.
//! The paper's fallback to f64 is not needed for that.

use glam::Vec3A;

use super::build::DEEPEST;
use super::triangle_bvh::{Block, LANES};
use super::wide::{LEAF, Node};
use super::{Accel, Hit, Placed, Ray};

/// Least absolute value of a direction's components in box tests, so that no infinities arise.
pub(super) const TINY: f32 = 1e-18;
/// 1 + 2γ(3).
pub(super) const WIDEN: f32 = 1.0 + 2.0 * 3.0 * f32::EPSILON;

/// Number of rays in flight. Three are 5 % faster where all data is in the caches (`cornell`). Six
/// are 8 % faster where none is (shuffled rays on Sponza). Whole paths take the same time.
const IN_FLIGHT: usize = 4;

/// Stacks of the rays in flight; the caller keeps them so that rays need not allocate.
#[derive(Debug, Default)]
pub(crate) struct Stacks(Box<[Stack; IN_FLIGHT]>);

/// Capacity of a stack. A tree has at most [`DEEPEST`] binary levels. Each node takes at least one
/// of them and leaves at most seven children behind: 498 entries for each of the two hierarchies.
const DEPTH: usize = 1024;
const _: () = assert!(2 * (1 + 7 * DEEPEST as usize) <= DEPTH);

/// The nodes and leaves that one ray still has to visit, the next on top.
#[derive(Debug)]
pub(super) struct Stack {
    /// Children of nodes, with [`LEAF`] for leaves.
    children: [u32; DEPTH + 8],
    /// Distances at which the ray enters the children's boxes; only kept for closest-hit rays.
    distances: [f32; DEPTH + 8],
    len: usize,
}

impl Default for Stack {
    fn default() -> Self {
        Self { children: [0; DEPTH + 8], distances: [0.0; DEPTH + 8], len: 0 }
    }
}

impl Stack {
    #[inline(always)]
    fn push(&mut self, child: u32) {
        let (children, distances) = self.room();
        children[0] = child;
        distances[0] = 0.0;
        self.len += 1;
    }

    #[inline(always)]
    fn pop<const ANY: bool>(&mut self) -> (u32, f32) {
        self.len -= 1;
        let at = self.len % DEPTH;
        (self.children[at], if ANY { 0.0 } else { self.distances[at] })
    }

    /// The child that [`Self::pop`] would take; any value where the stack is empty.
    #[inline(always)]
    fn next(&self) -> u32 {
        self.children[self.len.wrapping_sub(1) % DEPTH]
    }

    /// Room for a node's children on top of the stack. [`Self::keep`] adds the first of them.
    #[inline(always)]
    pub(super) fn room(&mut self) -> (&mut [u32; 8], &mut [f32; 8]) {
        let at = self.len % DEPTH;
        let children = self.children[at..].first_chunk_mut();
        let distances = self.distances[at..].first_chunk_mut();
        match (children, distances) {
            (Some(children), Some(distances)) => (children, distances),
            _ => unreachable!("there is room for eight above the deepest"),
        }
    }

    /// Adds the first `count` children of the room to the stack.
    #[inline(always)]
    pub(super) fn keep(&mut self, count: u32) {
        self.len += count as usize;
        debug_assert!(self.len <= DEPTH);
    }
}

/// A ray in the form that box and triangle tests need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setup {
    pub(super) origin: [f32; 3],
    pub(super) inverse: [f32; 3],
    /// A bit for each axis along which the ray goes down and meets the greatest coordinates first;
    /// x is the lowest bit.
    pub(super) octant: u32,
    /// For each axis, the offset in bytes into a node of the planes that the ray meets first.
    pub(super) near: [u32; 3],
    /// The three axes; the last is the one along which the direction is longest.
    pub(super) axes: [usize; 3],
    /// Factors of the last axis to subtract from the other two, which shear the ray upright, and
    /// the factor that turns the last coordinate into t.
    pub(super) shear: [f32; 3],
}

impl Setup {
    #[inline(always)]
    pub(super) fn new(origin: Vec3A, direction: Vec3A) -> Self {
        let direction = direction.to_array();
        let [x, y, z] = direction.map(f32::abs);
        let axes = match (x > y, x > z, y > z) {
            (true, true, _) => [1, 2, 0],
            (false, _, true) => [2, 0, 1],
            _ => [0, 1, 2],
        };
        let scale = 1.0 / direction[axes[2]];
        let shear = [direction[axes[0]] * scale, direction[axes[1]] * scale, scale];
        let safe = direction.map(|d| if d.abs() < TINY { TINY.copysign(d) } else { d });
        let down = safe.map(|d| u32::from(d < 0.0));
        Self {
            origin: origin.to_array(),
            inverse: safe.map(|d| 1.0 / d),
            octant: down[0] | down[1] << 1 | down[2] << 2,
            near: std::array::from_fn(|axis| 64 * axis as u32 + 32 * down[axis]),
            axes,
            shear,
        }
    }

    /// Whether the ray meets the greatest coordinates of an axis first.
    pub(super) fn goes_down(&self, axis: usize) -> bool {
        self.octant >> axis & 1 == 1
    }

    /// The same ray in the space of an instance.
    #[inline(always)]
    fn in_object(&self, ray: &Ray, placed: &Placed) -> Self {
        let m = &placed.object_from_world;
        if placed.only_moves {
            let origin = Vec3A::from(ray.origin) + m.translation;
            return Self { origin: origin.to_array(), ..*self };
        }
        Self::new(
            m.transform_point3a(ray.origin.into()),
            m.transform_vector3a(ray.direction.into()),
        )
    }
}

/// The boxes that a ray meets, as a set of lanes, and where it enters them.
pub(super) struct BoxHits {
    pub(super) mask: u32,
    pub(super) t: [f32; 8],
}

/// The triangles that a ray meets, as a set of lanes, with t and barycentric weights.
pub(super) struct TriangleHits {
    pub(super) mask: u32,
    pub(super) t: [f32; LANES],
    pub(super) u: [f32; LANES],
    pub(super) v: [f32; LANES],
}

/// The walk through both levels. `open` pushes the children of a node that a ray meets before
/// `t_max`, the one to visit first on top. The first is chosen by the node's order for the ray's
/// octant; with `ANY` it is the last lane.
#[inline(always)]
pub(super) fn trace_with<const ANY: bool, T: Copy>(
    accel: &Accel,
    mut rays: impl Iterator<Item = (Ray, T)>,
    stacks: &mut Stacks,
    accept: impl Fn(&T, &Hit) -> bool,
    mut found: impl FnMut(T, Option<Hit>),
    open: impl Fn(&Node, &Setup, f32, &mut Stack),
    triangles: impl Fn(&Block, &Setup, f32) -> TriangleHits,
) {
    let begin = |stack| rays.next().map(|(ray, with)| Flight::new(accel, ray, with, stack));
    let mut flights: Vec<_> = stacks.0.iter_mut().map_while(begin).collect();
    while !flights.is_empty() {
        let mut landed = None;
        for (n, flight) in flights.iter_mut().enumerate() {
            if !flight.step::<ANY>(accel, &accept, &open, &triangles) {
                continue;
            }
            found(flight.with, flight.best);
            if let Some((ray, with)) = rays.next() {
                flight.start(accel, ray, with);
            } else {
                landed = Some(n);
                break;
            }
        }
        if let Some(n) = landed {
            flights.swap_remove(n);
        }
    }
}

/// A ray in flight.
struct Flight<'a, T> {
    with: T,
    ray: Ray,
    world: Setup,
    /// The ray in the space of `nodes`.
    local: Setup,
    /// Nodes of the instance that it is in, or of the top level, which has no blocks.
    nodes: &'a [Node],
    blocks: &'a [Block],
    instance: Option<u32>,
    t_max: f32,
    best: Option<Hit>,
    stack: &'a mut Stack,
    /// Length of the stack at which the walk through the instance is done.
    floor: usize,
}

impl<'a, T: Copy> Flight<'a, T> {
    fn new(accel: &'a Accel, ray: Ray, with: T, stack: &'a mut Stack) -> Self {
        let world = Setup::new(ray.origin.into(), ray.direction.into());
        let mut flight = Self {
            with,
            ray,
            world,
            local: world,
            nodes: &[],
            blocks: &[],
            instance: None,
            t_max: ray.t_max,
            best: None,
            stack,
            floor: 0,
        };
        flight.begin(accel);
        flight
    }

    /// Restarts with another ray.
    #[inline(always)]
    fn start(&mut self, accel: &'a Accel, ray: Ray, with: T) {
        self.with = with;
        self.ray = ray;
        self.world = Setup::new(ray.origin.into(), ray.direction.into());
        self.t_max = ray.t_max;
        self.best = None;
        self.begin(accel);
    }

    /// With a single instance, rays begin in it and skip the top level. On Sponza, where each ray
    /// visits 27 nodes and leaves, that saves three steps and their branches.
    #[inline(always)]
    fn begin(&mut self, accel: &'a Accel) {
        self.stack.len = 0;
        if let [only] = accel.placed.as_slice() {
            return self.enter(only);
        }
        self.back_to_top(accel);
        self.stack.push(0);
    }

    /// Visits the top of the stack that is not beyond the nearest hit. Returns whether the ray is
    /// done.
    #[inline(always)]
    fn step<const ANY: bool>(
        &mut self,
        accel: &'a Accel,
        accept: &impl Fn(&T, &Hit) -> bool,
        open: &impl Fn(&Node, &Setup, f32, &mut Stack),
        triangles: &impl Fn(&Block, &Setup, f32) -> TriangleHits,
    ) -> bool {
        let child = loop {
            if self.stack.len == self.floor {
                if self.stack.len == 0 {
                    return true;
                }
                self.back_to_top(accel);
                return false;
            }
            let (child, t) = self.stack.pop::<ANY>();
            if ANY || t <= self.t_max {
                break child;
            }
        };
        let index = (child & !LEAF) as usize;
        if child & LEAF == 0 {
            open(&self.nodes[index], &self.local, self.t_max, self.stack);
            self.fetch_next();
            return false;
        }
        let Some(instance) = self.instance else {
            self.enter(&accel.placed[index]);
            return false;
        };
        let block = &self.blocks[index];
        let hits = triangles(block, &self.local, self.t_max);
        if hits.mask == 0 {
            return false;
        }
        let Some(hit) = nearest(block, instance, hits, |hit| accept(&self.with, hit)) else {
            return false;
        };
        self.t_max = hit.t;
        self.best = Some(hit);
        ANY
    }

    #[inline(always)]
    fn enter(&mut self, placed: &'a Placed) {
        self.local = self.world.in_object(&self.ray, placed);
        (self.nodes, self.blocks) = (&placed.bvh.nodes, &placed.bvh.blocks);
        self.instance = Some(placed.instance);
        self.floor = self.stack.len;
        self.stack.push(0);
    }

    #[inline(always)]
    fn back_to_top(&mut self, accel: &'a Accel) {
        self.local = self.world;
        (self.nodes, self.blocks) = (&accel.nodes, &[]);
        self.instance = None;
        self.floor = 0;
    }

    /// Prefetches what the next step reads; most of it comes from the third-level cache.
    #[inline(always)]
    fn fetch_next(&self) {
        let child = self.stack.next();
        let index = (child & !LEAF) as usize;
        let node = self.nodes.as_ptr().wrapping_add(index).cast::<i8>();
        let block = self.blocks.as_ptr().wrapping_add(index).cast::<i8>();
        let at = if child & LEAF == 0 { node } else { block };
        for line in 0..4 {
            fetch_line(at.wrapping_add(64 * line));
        }
    }
}

/// Pushes the children that a ray meets.
#[inline(always)]
pub(super) fn put<const ANY: bool>(node: &Node, ray: &Setup, hits: &BoxHits, stack: &mut Stack) {
    let (children, distances) = stack.room();
    let mut count = 0;
    let far_first = node.far_first[ray.octant as usize & 7];
    for n in 0..8 {
        let lane = if ANY { n } else { far_first as usize >> (4 * n) & 7 };
        if hits.mask >> lane & 1 == 1 {
            children[count] = node.child[lane];
            distances[count] = hits.t[lane];
            count += 1;
        }
    }
    stack.keep(count as u32);
}

/// Prefetches a value.
#[inline(always)]
pub(crate) fn fetch_ahead<T>(value: &T) {
    for line in (0..size_of::<T>()).step_by(64) {
        fetch_line(std::ptr::from_ref(value).cast::<i8>().wrapping_add(line));
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(super) fn fetch_line(at: *const i8) {
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
    #[expect(unsafe_code, reason = "there is no safe prefetch")]
    // SAFETY: a prefetch reads nothing and cannot fault; SSE is part of x86-64.
    unsafe {
        _mm_prefetch::<_MM_HINT_T0>(at);
    }
}

/// Prefetches a cache line; `std` has no stable function for it on this processor.
#[cfg(target_arch = "aarch64")]
#[inline(always)]
pub(super) fn fetch_line(at: *const i8) {
    #[expect(unsafe_code, reason = "there is no safe prefetch")]
    // SAFETY: a prefetch reads nothing and cannot fault.
    unsafe {
        std::arch::asm!(
            "prfm pldl1keep, [{at}]",
            at = in(reg) at,
            options(nomem, nostack, preserves_flags),
        );
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub(super) fn fetch_line(_: *const i8) {}

/// The nearest accepted one of the triangles that a test found.
#[inline(always)]
pub(super) fn nearest(
    block: &Block,
    instance: u32,
    mut hits: TriangleHits,
    accept: impl Fn(&Hit) -> bool,
) -> Option<Hit> {
    while hits.mask != 0 {
        let mut lane = hits.mask.trailing_zeros() as usize & (LANES - 1);
        let mut rest = hits.mask & (hits.mask - 1);
        while rest != 0 {
            let other = rest.trailing_zeros() as usize & (LANES - 1);
            rest &= rest - 1;
            if hits.t[other] < hits.t[lane] {
                lane = other;
            }
        }
        let hit = Hit {
            t: hits.t[lane],
            u: hits.u[lane],
            v: hits.v[lane],
            instance: instance + block.instance[lane],
            primitive: block.primitive[lane],
            triangle: block.triangle[lane],
        };
        if accept(&hit) {
            return Some(hit);
        }
        hits.mask &= !(1 << lane);
    }
    None
}
