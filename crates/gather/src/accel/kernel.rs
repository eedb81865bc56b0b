//! The walk through the hierarchies.
//!
//! The walk itself ([`trace_with`]) is written once; what tests eight boxes or eight triangles is
//! passed in, so that it can be compiled for AVX2 or NEON or neither; [`Kernel::detect`] chooses.
//!
//! Boxes: the slab test with far distances widened by 1 + 2γ(3), so that rounding errs towards
//! visiting (Ize 2013, "Robust BVH ray traversal"). Triangles: the vertices are sheared so that the
//! ray becomes the z axis, and the signs of the edges' 2D cross products decide (Woop, Benthin and
//! Wald 2013, "Watertight ray/triangle intersection"). A vertex's sheared place does not depend on
//! the triangle, and for an edge that two triangles share both compute exact negatives (so no
//! fused multiply-add there); zero counts as inside for both. So a ray cannot slip between them,
//! neither at edges nor at vertices, and the paper's second try in f64 is not needed for that.

use glam::Vec3A;

use super::mesh_bvh::{Block, LANES};
use super::wide::{LEAF, Node};
use super::{Accel, Hit, Placed, Ray};

/// Directions' components are kept at least this far from zero, so that no infinities arise.
pub(super) const TINY: f32 = 1e-18;
/// 1 + 2γ(3).
pub(super) const WIDEN: f32 = 1.0 + 2.0 * 3.0 * f32::EPSILON;

/// Which instructions to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kernel {
    /// Plain Rust.
    Portable,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// NEON, which every aarch64 processor has.
    #[cfg(target_arch = "aarch64")]
    Neon,
}

/// Proof that the processor has AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Avx2(());

impl Kernel {
    /// The fastest that this processor has.
    pub(crate) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            return Self::Avx2(Avx2(()));
        }
        // Never false; asked so that `Portable`, which tests compare with, is no dead code.
        #[cfg(target_arch = "aarch64")]
        if cfg!(target_feature = "neon") {
            return Self::Neon;
        }
        Self::Portable
    }
}

/// What is still to be visited; kept by the caller so that rays need not allocate.
#[derive(Debug, Default)]
pub(crate) struct Stack(Vec<Entry>);

#[derive(Clone, Copy, Debug)]
struct Entry {
    child: u32,
    t: f32,
}

/// A ray as the box and triangle tests want it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setup {
    pub(super) origin: [f32; 3],
    pub(super) inverse: [f32; 3],
    /// Rows of [`Node::planes`] that the ray meets first.
    pub(super) near: [usize; 3],
    /// The axes, the direction's longest last.
    pub(super) axes: [usize; 3],
    /// What to subtract of the last axis to shear the ray upright, and what scales t.
    pub(super) shear: [f32; 3],
}

impl Setup {
    #[inline(always)]
    pub(super) fn new(origin: Vec3A, direction: Vec3A) -> Self {
        let origin = origin.to_array();
        let direction = direction.to_array();
        let mut inverse = [0.0; 3];
        let mut near = [0; 3];
        for axis in 0..3 {
            let d = direction[axis];
            let safe = if d.abs() < TINY { TINY.copysign(d) } else { d };
            inverse[axis] = 1.0 / safe;
            near[axis] = if safe < 0.0 { axis + 3 } else { axis };
        }
        let [x, y, z] = direction.map(f32::abs);
        let axes = match (x > y, x > z, y > z) {
            (true, true, _) => [1, 2, 0],
            (false, _, true) => [2, 0, 1],
            _ => [0, 1, 2],
        };
        let scale = 1.0 / direction[axes[2]];
        let shear = [direction[axes[0]] * scale, direction[axes[1]] * scale, scale];
        Self { origin, inverse, near, axes, shear }
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

/// Lanes that a test found, and what it found there.
pub(super) struct BoxHits {
    pub(super) mask: u32,
    pub(super) t: [f32; 8],
}

/// Lanes of the triangles that a test found.
pub(super) struct TriangleHits {
    pub(super) mask: u32,
    pub(super) t: [f32; LANES],
    pub(super) u: [f32; LANES],
    pub(super) v: [f32; LANES],
}

/// The nearest hit, or with `ANY` the first found.
#[inline]
pub(super) fn trace<const ANY: bool>(
    accel: &Accel,
    ray: &Ray,
    stack: &mut Stack,
    accept: impl Fn(&Hit) -> bool,
) -> Option<Hit> {
    match accel.kernel {
        Kernel::Portable => {
            trace_with::<ANY>(accel, ray, stack, accept, boxes_portable, triangles_portable)
        }
        #[cfg(target_arch = "x86_64")]
        Kernel::Avx2(_) => {
            #[expect(unsafe_code, reason = "calls code compiled for AVX2")]
            // SAFETY: `Avx2` is made only by `Kernel::detect`, after the check for AVX2 and FMA.
            unsafe {
                super::kernel_avx2::trace::<ANY>(accel, ray, stack, accept)
            }
        }
        #[cfg(target_arch = "aarch64")]
        Kernel::Neon => {
            #[expect(unsafe_code, reason = "calls code compiled for NEON")]
            // SAFETY: `kernel_neon` refuses to compile for a target without NEON.
            unsafe {
                super::kernel_neon::trace::<ANY>(accel, ray, stack, accept)
            }
        }
    }
}

/// The walk, both levels.
#[inline(always)]
pub(super) fn trace_with<const ANY: bool>(
    accel: &Accel,
    ray: &Ray,
    stack: &mut Stack,
    accept: impl Fn(&Hit) -> bool,
    boxes: impl Fn(&Node, &Setup, f32) -> BoxHits,
    triangles: impl Fn(&Block, &Setup, f32) -> TriangleHits,
) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    let world = Setup::new(ray.origin.into(), ray.direction.into());
    stack.0.clear();
    walk::<ANY>(
        &accel.nodes,
        &world,
        ray.t_max,
        stack,
        &boxes,
        |instance, t_max, stack| {
            let placed = &accel.placed[instance as usize];
            let (nodes, blocks): (&[Node], &[Block]) = (&placed.bvh.nodes, &placed.bvh.blocks);
            let local = world.in_object(ray, placed);
            let ahead = |child: u32| match child & LEAF {
                0 => fetch_ahead(&nodes[child as usize]),
                _ => fetch_ahead(&blocks[(child & !LEAF) as usize]),
            };
            walk::<ANY>(
                nodes,
                &local,
                t_max,
                stack,
                &boxes,
                |block, t_max, _| {
                    let block = &blocks[block as usize];
                    match nearest(block, placed.instance, triangles(block, &local, t_max), &accept)
                    {
                        Some(hit) => {
                            best = Some(hit);
                            hit.t
                        }
                        None => t_max,
                    }
                },
                ahead,
            )
        },
        |_| {},
    );
    best
}

/// Visits the leaves that the ray meets before `t_max`, near ones first; `leaf` returns the new
/// `t_max`. Returns the last `t_max`. With `ANY` leaves come before nodes, and it ends as soon as a
/// leaf lowers `t_max`. `ahead` is told of every child that is going to be visited.
#[inline(always)]
fn walk<const ANY: bool>(
    nodes: &[Node],
    ray: &Setup,
    mut t_max: f32,
    stack: &mut Stack,
    boxes: &impl Fn(&Node, &Setup, f32) -> BoxHits,
    mut leaf: impl FnMut(u32, f32, &mut Stack) -> f32,
    ahead: impl Fn(u32),
) -> f32 {
    let base = stack.0.len();
    let mut current = 0;
    loop {
        if current & LEAF != 0 {
            let shorter = leaf(current & !LEAF, t_max, stack);
            if ANY && shorter < t_max {
                stack.0.truncate(base);
                return shorter;
            }
            t_max = shorter;
        } else {
            let node = &nodes[current as usize];
            if let Some(next) = enter::<ANY>(node, boxes(node, ray, t_max), stack, &ahead) {
                current = next;
                continue;
            }
        }
        loop {
            if stack.0.len() == base {
                return t_max;
            }
            let Some(next) = stack.0.pop() else { return t_max };
            if next.t <= t_max {
                current = next.child;
                break;
            }
        }
    }
}

/// Puts the children that a ray meets on the stack, but for the one to visit next.
#[inline(always)]
fn enter<const ANY: bool>(
    node: &Node,
    mut hits: BoxHits,
    stack: &mut Stack,
    ahead: &impl Fn(u32),
) -> Option<u32> {
    let mut next = || {
        let lane = hits.mask.trailing_zeros() as usize & 7;
        hits.mask &= hits.mask.checked_sub(1)?;
        let child = node.child[lane];
        ahead(child);
        Some(Entry { child, t: hits.t[lane] })
    };
    let mut first = next()?;
    let base = stack.0.len();
    while let Some(entry) = next() {
        let is_first = if ANY { entry.child & LEAF != 0 } else { entry.t < first.t };
        stack.0.push(if is_first { std::mem::replace(&mut first, entry) } else { entry });
    }
    if !ANY {
        far_first(&mut stack.0[base..]);
    }
    Some(first.child)
}

/// Asks for a node or block that will be visited soon: most come from the third level of cache.
#[inline(always)]
pub(crate) fn fetch_ahead<T>(value: &T) {
    for line in (0..size_of::<T>()).step_by(64) {
        fetch_line(std::ptr::from_ref(value).cast::<i8>().wrapping_add(line));
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn fetch_line(at: *const i8) {
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
    #[expect(unsafe_code, reason = "there is no safe prefetch")]
    // SAFETY: a prefetch reads nothing and cannot fault; SSE is part of x86-64.
    unsafe {
        _mm_prefetch::<_MM_HINT_T0>(at);
    }
}

/// `std` has no stable prefetch here.
#[cfg(target_arch = "aarch64")]
#[inline(always)]
fn fetch_line(at: *const i8) {
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
fn fetch_line(_: *const i8) {}

/// Insertion sort by falling distance: at most eight entries, mostly one or two.
#[inline(always)]
fn far_first(entries: &mut [Entry]) {
    for i in 1..entries.len() {
        let entry = entries[i];
        let mut at = i;
        while at > 0 && entries[at - 1].t < entry.t {
            entries[at] = entries[at - 1];
            at -= 1;
        }
        entries[at] = entry;
    }
}

/// The nearest of the triangles found that is accepted.
#[inline(always)]
fn nearest(
    block: &Block,
    instance: u32,
    mut hits: TriangleHits,
    accept: &impl Fn(&Hit) -> bool,
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
            instance,
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

#[inline(always)]
pub(super) fn boxes_portable(node: &Node, ray: &Setup, t_max: f32) -> BoxHits {
    let mut hits = BoxHits { mask: 0, t: [0.0; 8] };
    for lane in 0..8 {
        let mut enter = 0.0f32;
        let mut leave = t_max;
        for axis in 0..3 {
            let near = ray.near[axis];
            let far = if near < 3 { near + 3 } else { near - 3 };
            let (o, i) = (ray.origin[axis], ray.inverse[axis]);
            enter = enter.max((node.planes[near][lane] - o) * i);
            leave = leave.min((node.planes[far][lane] - o) * i * WIDEN);
        }
        hits.t[lane] = enter;
        hits.mask |= u32::from(enter <= leave) << lane;
    }
    hits
}

pub(super) fn triangles_portable(block: &Block, ray: &Setup, t_max: f32) -> TriangleHits {
    let mut hits = TriangleHits { mask: 0, t: [0.0; LANES], u: [0.0; LANES], v: [0.0; LANES] };
    // Sheared x and y, and z, of a corner.
    let corner = |vertex: usize, lane: usize| {
        let at = |k: usize| block.corners[vertex][ray.axes[k]][lane] - ray.origin[ray.axes[k]];
        let z = at(2);
        [at(0) - ray.shear[0] * z, at(1) - ray.shear[1] * z, z]
    };
    for lane in 0..LANES {
        let [a, b, c] = [corner(0, lane), corner(1, lane), corner(2, lane)];
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let sum = u + v + w;
        if !(u.min(v).min(w) >= 0.0 || u.max(v).max(w) <= 0.0) || sum == 0.0 {
            continue;
        }
        let t = (u * a[2] + v * b[2] + w * c[2]) * ray.shear[2] / sum;
        if t > 0.0 && t <= t_max {
            hits.mask |= 1 << lane;
            (hits.t[lane], hits.u[lane], hits.v[lane]) = (t, v / sum, w / sum);
        }
    }
    hits
}
