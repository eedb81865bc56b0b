//! The box and triangle tests with NEON: eight boxes or four triangles at a time; see
//! [`super::walk`].

use std::arch::aarch64::{
    float32x4_t, uint32x4_t, vaddq_f32, vaddvq_u32, vandq_u32, vceqq_f32, vcgeq_f32, vcgtq_f32,
    vcleq_f32, vdivq_f32, vdupq_n_f32, vfmaq_f32, vfmsq_f32, vmaxnmq_f32, vminnmq_f32, vmulq_f32,
    vmvnq_u32, vorrq_u32, vsubq_f32,
};

use super::item_buffer::ItemBuffer;
use super::light_buffer::LightBuffer;
use super::triangle_bvh::{Block, LANES};
use super::walk::{BoxHits, Setup, Stacks, TriangleHits, WIDEN, put, trace_with};
use super::wide::Node;
use super::{Accel, Hit, Ray};

// This makes it sound to call code compiled for NEON wherever this module exists.
const _: () = assert!(cfg!(target_feature = "neon"), "the target has no NEON");

/// [`super::dispatch::trace`] compiled for NEON.
#[target_feature(enable = "neon")]
pub(super) fn trace<const ANY: bool, T: Copy>(
    accel: &Accel,
    rays: impl Iterator<Item = (Ray, T)>,
    stacks: &mut Stacks,
    accept: impl Fn(&T, &Hit) -> bool,
    found: impl FnMut(T, Option<Hit>),
) {
    trace_with::<ANY, T>(
        accel,
        rays,
        stacks,
        accept,
        found,
        |node, ray, t_max, stack| put::<ANY>(node, ray, &boxes(node, ray, t_max), stack),
        |block, ray, t_max| triangles(block, ray, t_max),
    );
}

/// [`LightBuffer::occluded`] compiled for NEON.
#[target_feature(enable = "neon")]
pub(super) fn occluded<T: Copy>(
    buffer: &LightBuffer,
    rays: impl Iterator<Item = (Ray, T)>,
    accept: impl Fn(&T, &Hit) -> bool,
    found: impl FnMut(T, bool),
    undecided: impl FnMut(Ray, T),
) {
    let triangles = |block: &Block, ray: &Setup, t_max| triangles(block, ray, t_max);
    buffer.occluded_with(rays, accept, found, undecided, triangles);
}

/// [`ItemBuffer::closest`] compiled for NEON.
#[target_feature(enable = "neon")]
pub(super) fn closest_seen<T: Copy>(
    buffer: &ItemBuffer,
    rays: impl Iterator<Item = (Ray, T)>,
    accept: impl Fn(&T, &Hit) -> bool,
    found: impl FnMut(T, Option<Hit>),
    undecided: impl FnMut(Ray, T),
) {
    let triangles = |block: &Block, ray: &Setup, t_max| triangles(block, ray, t_max);
    buffer.closest_with(rays, accept, found, undecided, triangles);
}

/// Minima and maxima ignore a NaN, as `f32::min` and `f32::max` do. For a ray that is not finite,
/// only the finite axes count.
#[target_feature(enable = "neon")]
#[inline]
pub(super) fn boxes(node: &Node, ray: &Setup, t_max: f32) -> BoxHits {
    let mut enter = [vdupq_n_f32(0.0); 2];
    let mut leave = [vdupq_n_f32(f32::INFINITY); 2];
    for axis in 0..3 {
        let origin = vdupq_n_f32(ray.origin[axis]);
        let inverse = vdupq_n_f32(ray.inverse[axis]);
        let (planes, down) = (&node.planes[axis], ray.goes_down(axis));
        let (near, far) = (load8(&planes[usize::from(down)]), load8(&planes[usize::from(!down)]));
        for half in 0..2 {
            let t_near = vmulq_f32(vsubq_f32(near[half], origin), inverse);
            let t_far = vmulq_f32(vsubq_f32(far[half], origin), inverse);
            enter[half] = vmaxnmq_f32(enter[half], t_near);
            leave[half] = vminnmq_f32(leave[half], t_far);
        }
    }
    let (widen, end) = (vdupq_n_f32(WIDEN), vdupq_n_f32(t_max));
    let leave = leave.map(|leave| vminnmq_f32(vmulq_f32(leave, widen), end));
    let met = [vcleq_f32(enter[0], leave[0]), vcleq_f32(enter[1], leave[1])];
    let low = vandq_u32(met[0], bytemuck::cast([1, 2, 4, 8]));
    let high = vandq_u32(met[1], bytemuck::cast([16, 32, 64, 128]));
    BoxHits { mask: vaddvq_u32(vorrq_u32(low, high)), t: bytemuck::cast(enter) }
}

#[target_feature(enable = "neon")]
#[inline]
pub(super) fn triangles(block: &Block, ray: &Setup, t_max: f32) -> TriangleHits {
    let a = corner(block, 0, ray);
    let b = corner(block, 1, ray);
    let c = corner(block, 2, ray);
    let u = cross(c, b);
    let v = cross(a, c);
    let w = cross(b, a);
    let zero = vdupq_n_f32(0.0);
    let least = vminnmq_f32(vminnmq_f32(u, v), w);
    let most = vmaxnmq_f32(vmaxnmq_f32(u, v), w);
    let inside = vorrq_u32(vcgeq_f32(least, zero), vcleq_f32(most, zero));
    let sum = vaddq_f32(vaddq_f32(u, v), w);
    let inside = vandq_u32(inside, vmvnq_u32(vceqq_f32(sum, zero)));
    if mask(inside) == 0 {
        return TriangleHits { mask: 0, t: [0.0; LANES], u: [0.0; LANES], v: [0.0; LANES] };
    }

    let scale = vdivq_f32(vdupq_n_f32(1.0), sum);
    let z = vfmaq_f32(vfmaq_f32(vmulq_f32(w, c[2]), v, b[2]), u, a[2]);
    let t = vmulq_f32(vmulq_f32(z, vdupq_n_f32(ray.shear[2])), scale);
    let before = vcleq_f32(t, vdupq_n_f32(t_max));
    let ahead = vcgtq_f32(t, zero);
    TriangleHits {
        mask: mask(vandq_u32(inside, vandq_u32(before, ahead))),
        t: bytemuck::cast(t),
        u: bytemuck::cast(vmulq_f32(v, scale)),
        v: bytemuck::cast(vmulq_f32(w, scale)),
    }
}

/// Sheared x and y, and unsheared z, of a corner of each triangle.
#[target_feature(enable = "neon")]
#[inline]
fn corner(block: &Block, vertex: usize, ray: &Setup) -> [float32x4_t; 3] {
    let at = |k: usize| {
        let axis = ray.axes[k];
        vsubq_f32(load4(&block.corners[vertex][axis]), vdupq_n_f32(ray.origin[axis]))
    };
    let z = at(2);
    let sheared = |k: usize| vfmsq_f32(at(k), vdupq_n_f32(ray.shear[k]), z);
    [sheared(0), sheared(1), z]
}

/// The cross product of x and y. It is not fused: swapping `a` and `b` must give the exact
/// negative.
#[target_feature(enable = "neon")]
#[inline]
fn cross(a: [float32x4_t; 3], b: [float32x4_t; 3]) -> float32x4_t {
    vsubq_f32(vmulq_f32(a[0], b[1]), vmulq_f32(a[1], b[0]))
}

/// Packs lanes into one bit each, for which NEON has no instruction.
#[target_feature(enable = "neon")]
#[inline]
fn mask(lanes: uint32x4_t) -> u32 {
    vaddvq_u32(vandq_u32(lanes, bytemuck::cast([1, 2, 4, 8])))
}

#[target_feature(enable = "neon")]
#[inline]
fn load4(lanes: &[f32; LANES]) -> float32x4_t {
    bytemuck::cast(*lanes)
}

#[target_feature(enable = "neon")]
#[inline]
fn load8(lanes: &[f32; 8]) -> [float32x4_t; 2] {
    bytemuck::cast(*lanes)
}

/// Runs `work`, compiled for NEON as far as it is inlined here.
#[target_feature(enable = "neon")]
pub(super) fn run(work: impl FnOnce()) {
    work();
}
