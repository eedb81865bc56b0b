//! The box and triangle tests with AVX2 and FMA: eight boxes or four triangles at a time; see
//! [`super::walk`].

use std::arch::x86_64::{
    __m128, __m256, __m256i, _CMP_LE_OQ, _mm_add_ps, _mm_and_ps, _mm_cmpge_ps, _mm_cmpgt_ps,
    _mm_cmple_ps, _mm_cmpneq_ps, _mm_cvtsi64_si128, _mm_div_ps, _mm_fmadd_ps, _mm_fnmadd_ps,
    _mm_max_ps, _mm_min_ps, _mm_movemask_ps, _mm_mul_ps, _mm_or_ps, _mm_set1_ps, _mm_setzero_ps,
    _mm_sub_ps, _mm256_broadcast_ss, _mm256_cmp_ps, _mm256_cvtepi8_epi32, _mm256_loadu_ps,
    _mm256_loadu_si256, _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps,
    _mm256_permutevar8x32_epi32, _mm256_permutevar8x32_ps, _mm256_set1_epi32, _mm256_set1_ps,
    _mm256_setr_epi32, _mm256_setzero_ps, _mm256_srlv_epi32, _mm256_sub_ps,
};

use super::item_buffer::ItemBuffer;
use super::light_buffer::LightBuffer;
use super::triangle_bvh::{Block, LANES};
#[cfg(test)]
use super::walk::BoxHits;
use super::walk::{Setup, Stacks, TriangleHits, WIDEN, trace_with};
use super::wide::Node;
use super::{Accel, Hit, Ray};

/// [`super::dispatch::trace`] compiled for AVX2.
#[target_feature(enable = "avx2,fma,popcnt")]
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
        |node, ray, t_max, stack| {
            // This is written in one place: a function of its own would pass its vectors through
            // memory.
            let (enter, leave) = slabs(node, ray, t_max);
            let (children, distances) = stack.room();
            let met = if ANY {
                let met = not_after(enter, leave);
                *children = bytemuck::cast(permuted_bits(&node.child, members(met)));
                met
            } else {
                let order = four_bits_each(node.far_first[ray.octant as usize & 7]);
                let met = _mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave);
                let met = _mm256_movemask_ps(_mm256_permutevar8x32_ps(met, order)) as u32;
                let places = _mm256_permutevar8x32_epi32(order, members(met));
                *children = bytemuck::cast(permuted_bits(&node.child, places));
                *distances = bytemuck::cast(_mm256_permutevar8x32_ps(enter, places));
                met
            };
            stack.keep(met.count_ones());
        },
        |block, ray, t_max| triangles(block, ray, t_max),
    );
}

/// [`LightBuffer::occluded`] compiled for AVX2.
#[target_feature(enable = "avx2,fma,popcnt")]
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

/// [`ItemBuffer::closest`] compiled for AVX2.
#[target_feature(enable = "avx2,fma,popcnt")]
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

/// [`slabs`] in the form that tests compare.
#[cfg(test)]
#[target_feature(enable = "avx2,fma")]
pub(super) fn boxes(node: &Node, ray: &Setup, t_max: f32) -> BoxHits {
    let (enter, leave) = slabs(node, ray, t_max);
    BoxHits { mask: not_after(enter, leave), t: bytemuck::cast(enter) }
}

/// The distances at which the ray enters and leaves each box, between 0 and `t_max`. It misses a
/// box that it leaves before it enters.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn slabs(node: &Node, ray: &Setup, t_max: f32) -> (__m256, __m256) {
    let mut enter = _mm256_setzero_ps();
    let mut leave = _mm256_set1_ps(f32::INFINITY);
    for axis in 0..3 {
        // These are read where they are needed. Before a branch, the compiler would load adjacent
        // numbers as one vector and then extract them again.
        let origin = _mm256_broadcast_ss(&ray.origin[axis]);
        let inverse = _mm256_broadcast_ss(&ray.inverse[axis]);
        let [near, far] = planes(node, ray, axis).map(|plane| _mm256_sub_ps(plane, origin));
        enter = _mm256_max_ps(_mm256_mul_ps(near, inverse), enter);
        leave = _mm256_min_ps(_mm256_mul_ps(far, inverse), leave);
    }
    let leave = _mm256_mul_ps(leave, _mm256_set1_ps(WIDEN));
    (enter, _mm256_min_ps(leave, _mm256_set1_ps(t_max)))
}

/// The boxes' planes across an axis: those that the ray meets first, then those that it meets last.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn planes(node: &Node, ray: &Setup, axis: usize) -> [__m256; 2] {
    let near = ray.near[axis] as usize;
    let read = |at: usize| {
        debug_assert!(at.is_multiple_of(32) && at < size_of_val(&node.planes));
        let plane = std::ptr::from_ref(&node.planes).wrapping_byte_add(at).cast::<f32>();
        #[expect(unsafe_code, reason = "from an index, the place takes three instructions more")]
        // SAFETY: six arrays of eight numbers begin here. `Setup` gives the nearer planes at
        // multiples of 32 bytes up to 160. The other plane of the pair differs in the bit of 32.
        unsafe {
            _mm256_loadu_ps(plane)
        }
    };
    [read(near), read(near ^ 32)]
}

/// The lanes where `a` is not greater than `b`.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn not_after(a: __m256, b: __m256) -> u32 {
    _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32
}

/// Splits a number into eight of four bits each, for a permutation, which reads three bits of each.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn four_bits_each(numbers: u32) -> __m256i {
    let places = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
    _mm256_srlv_epi32(_mm256_set1_epi32(numbers as i32), places)
}

/// For every set of lanes its members, eight bits each, the lowest first; the rest is filled with
/// ones.
static MEMBERS: [u64; 256] = {
    let mut table = [u64::MAX; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            if set >> lane & 1 == 1 {
                table[set] ^= (lane ^ 0xff) << (8 * count);
                count += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
};

/// The members of a set of lanes, followed by −1. A permutation by them moves the members to the
/// front.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn members(set: u32) -> __m256i {
    _mm256_cvtepi8_epi32(_mm_cvtsi64_si128(MEMBERS[set as usize & 0xff] as i64))
}

#[target_feature(enable = "avx2,fma")]
#[inline]
pub(super) fn triangles(block: &Block, ray: &Setup, t_max: f32) -> TriangleHits {
    let a = corner(block, 0, ray);
    let b = corner(block, 1, ray);
    let c = corner(block, 2, ray);
    let u = cross(c, b);
    let v = cross(a, c);
    let w = cross(b, a);
    let zero = _mm_setzero_ps();
    let least = _mm_min_ps(_mm_min_ps(u, v), w);
    let most = _mm_max_ps(_mm_max_ps(u, v), w);
    let inside = _mm_or_ps(_mm_cmpge_ps(least, zero), _mm_cmple_ps(most, zero));
    let sum = _mm_add_ps(_mm_add_ps(u, v), w);
    let inside = _mm_and_ps(inside, _mm_cmpneq_ps(sum, zero));
    if _mm_movemask_ps(inside) == 0 {
        return TriangleHits { mask: 0, t: [0.0; LANES], u: [0.0; LANES], v: [0.0; LANES] };
    }

    let scale = _mm_div_ps(_mm_set1_ps(1.0), sum);
    let z = _mm_fmadd_ps(u, a[2], _mm_fmadd_ps(v, b[2], _mm_mul_ps(w, c[2])));
    let t = _mm_mul_ps(_mm_mul_ps(z, _mm_set1_ps(ray.shear[2])), scale);
    let before = _mm_cmple_ps(t, _mm_set1_ps(t_max));
    let ahead = _mm_cmpgt_ps(t, zero);
    TriangleHits {
        mask: _mm_movemask_ps(_mm_and_ps(inside, _mm_and_ps(before, ahead))) as u32,
        t: bytemuck::cast(t),
        u: bytemuck::cast(_mm_mul_ps(v, scale)),
        v: bytemuck::cast(_mm_mul_ps(w, scale)),
    }
}

/// Sheared x and y, and unsheared z, of a corner of each triangle.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn corner(block: &Block, vertex: usize, ray: &Setup) -> [__m128; 3] {
    let at = |k: usize| {
        let axis = ray.axes[k];
        _mm_sub_ps(load4(&block.corners[vertex][axis]), _mm_set1_ps(ray.origin[axis]))
    };
    let z = at(2);
    let sheared = |k: usize| _mm_fnmadd_ps(_mm_set1_ps(ray.shear[k]), z, at(k));
    [sheared(0), sheared(1), z]
}

/// The cross product of x and y. It is not fused: swapping `a` and `b` must give the exact
/// negative.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn cross(a: [__m128; 3], b: [__m128; 3]) -> __m128 {
    _mm_sub_ps(_mm_mul_ps(a[0], b[1]), _mm_mul_ps(a[1], b[0]))
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn load4(lanes: &[f32; LANES]) -> __m128 {
    bytemuck::cast(*lanes)
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn permuted_bits(lanes: &[u32; 8], permutation: __m256i) -> __m256i {
    #[expect(unsafe_code, reason = "copies by value are spilled to the stack")]
    // SAFETY: the reference is valid for reads of eight numbers.
    let lanes = unsafe { _mm256_loadu_si256(lanes.as_ptr().cast()) };
    _mm256_permutevar8x32_epi32(lanes, permutation)
}

/// Runs `work`, compiled for AVX2 as far as it is inlined here.
#[target_feature(enable = "avx2,fma,popcnt")]
pub(super) fn run(work: impl FnOnce()) {
    work();
}
