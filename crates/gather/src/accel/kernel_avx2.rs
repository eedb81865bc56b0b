//! Eight boxes, or four triangles, at a time with AVX2 and FMA; see [`super::kernel`].

use std::arch::x86_64::{
    __m128, __m128i, __m256, __m256i, _CMP_LE_OQ, _mm_add_ps, _mm_and_ps, _mm_blend_epi32,
    _mm_cmpge_ps, _mm_cmpgt_ps, _mm_cmple_ps, _mm_cmpneq_ps, _mm_cvtsi64_si128, _mm_div_ps,
    _mm_fmadd_ps, _mm_fnmadd_ps, _mm_max_epi32, _mm_max_ps, _mm_min_epi32, _mm_min_ps,
    _mm_movemask_ps, _mm_mul_ps, _mm_or_ps, _mm_set1_ps, _mm_setzero_ps, _mm_shuffle_epi32,
    _mm_sub_ps, _mm_unpackhi_epi32, _mm_unpacklo_epi32, _mm256_andnot_si256, _mm256_castps_si256,
    _mm256_castsi128_si256, _mm256_castsi256_ps, _mm256_castsi256_si128, _mm256_cmp_ps,
    _mm256_cvtepi8_epi32, _mm256_loadu_ps, _mm256_loadu_si256, _mm256_max_ps, _mm256_min_ps,
    _mm256_movemask_ps, _mm256_mul_ps, _mm256_or_si256, _mm256_permutevar8x32_epi32,
    _mm256_set1_epi32, _mm256_set1_ps, _mm256_setzero_ps, _mm256_sub_ps,
};

#[cfg(test)]
use super::kernel::BoxHits;
use super::kernel::{LANE_BITS, Setup, Stacks, TriangleHits, trace_with};
use super::mesh_bvh::{Block, LANES};
use super::wide::Node;
use super::{Accel, Hit, Ray};

/// [`super::kernel::trace`] compiled for AVX2.
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
            // All in one place: called as a function, it would pass its vectors through memory.
            let (mask, t) = slabs(node, ray, t_max);
            let child = load8_bits(&node.child);
            let count = mask.count_ones();
            if ANY {
                let room = stack.any_room();
                let is_leaf = _mm256_movemask_ps(_mm256_castsi256_ps(child)) as u32;
                let (nodes, leaves) = (mask & !is_leaf, mask & is_leaf);
                let first = _mm256_permutevar8x32_epi32(child, members(nodes));
                let last = _mm256_permutevar8x32_epi32(child, members(leaves));
                let at = nodes.count_ones().min(8) as usize;
                room[..8].copy_from_slice(&bytemuck::cast::<_, [u32; 8]>(first));
                room[at..at + 8].copy_from_slice(&bytemuck::cast::<_, [u32; 8]>(last));
            } else {
                let room = stack.near_room();
                // Distances are not negative, so as whole numbers they have the same order. Their
                // last bits make room for the lane; lanes that were not met come last.
                let lane_bits = _mm256_set1_epi32(LANE_BITS as i32);
                let t = _mm256_andnot_si256(lane_bits, _mm256_castps_si256(t));
                let lanes = members(mask);
                let keys = _mm256_or_si256(_mm256_permutevar8x32_epi32(t, lanes), lanes);
                // The permutation takes the lane and leaves the rest.
                if count <= 4 {
                    let keys = far_first_of_4(_mm256_castsi256_si128(keys));
                    let child = _mm256_permutevar8x32_epi32(child, _mm256_castsi128_si256(keys));
                    let child = _mm256_castsi256_si128(child);
                    let low = _mm_unpacklo_epi32(child, keys);
                    let high = _mm_unpackhi_epi32(child, keys);
                    room[..4].copy_from_slice(&bytemuck::cast::<_, [u64; 4]>([low, high]));
                } else {
                    *room = far_first_of_8(keys, &node.child);
                }
            }
            stack.keep(count);
        },
        |block, ray, t_max| triangles(block, ray, t_max),
    );
}

/// [`slabs`] as tests want it.
#[cfg(test)]
#[target_feature(enable = "avx2,fma")]
pub(super) fn boxes(node: &Node, ray: &Setup, t_max: f32) -> BoxHits {
    let (mask, t) = slabs(node, ray, t_max);
    BoxHits { mask, t: bytemuck::cast(t) }
}

/// Which boxes the ray meets before `t_max`, and where.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn slabs(node: &Node, ray: &Setup, t_max: f32) -> (u32, __m256) {
    let mut enter = _mm256_setzero_ps();
    let mut leave = _mm256_set1_ps(t_max);
    for axis in 0..3 {
        let (planes, down) = (&node.planes[axis], ray.down[axis]);
        let origin = _mm256_set1_ps(ray.origin[axis]);
        let near = _mm256_sub_ps(load8(&planes[usize::from(down)]), origin);
        let far = _mm256_sub_ps(load8(&planes[usize::from(!down)]), origin);
        enter = _mm256_max_ps(_mm256_mul_ps(near, _mm256_set1_ps(ray.inverse[axis])), enter);
        leave = _mm256_min_ps(_mm256_mul_ps(far, _mm256_set1_ps(ray.widened[axis])), leave);
    }
    (_mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave)) as u32, enter)
}

/// For every set of lanes its members, eight bits each, the lowest first; then ones.
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

/// The members of a set of lanes, for a permutation that puts them first, and behind them −1.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn members(set: u32) -> __m256i {
    _mm256_cvtepi8_epi32(_mm_cvtsi64_si128(MEMBERS[set as usize & 0xff] as i64))
}

/// The greatest first.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn far_first_of_4(k: __m128i) -> __m128i {
    // A network of three stages: neighbours, halves, the middle two.
    let other = _mm_shuffle_epi32::<0b10_11_00_01>(k);
    let k = _mm_blend_epi32::<0b1010>(_mm_max_epi32(k, other), _mm_min_epi32(k, other));
    let other = _mm_shuffle_epi32::<0b01_00_11_10>(k);
    let k = _mm_blend_epi32::<0b1100>(_mm_max_epi32(k, other), _mm_min_epi32(k, other));
    let other = _mm_shuffle_epi32::<0b11_01_10_00>(k);
    _mm_blend_epi32::<0b1100>(_mm_max_epi32(k, other), _mm_min_epi32(k, other))
}

/// Entries of the stack for keys whose last bits are lanes, the greatest first.
#[cold]
fn far_first_of_8(keys: __m256i, child: &[u32; 8]) -> [u64; 8] {
    let mut keys: [i32; 8] = bytemuck::cast(keys);
    keys.sort_unstable_by(|a, b| b.cmp(a));
    keys.map(|key| u64::from(key as u32) << 32 | u64::from(child[key as usize & 7]))
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

/// Sheared x and y, and z, of a corner of each triangle.
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

/// Of x and y. Not fused: swapping `a` and `b` must give the exact negative.
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
fn load8(lanes: &[f32; 8]) -> __m256 {
    #[expect(unsafe_code, reason = "copies by value are spilled to the stack")]
    // SAFETY: the reference is valid for reads of eight numbers.
    unsafe {
        _mm256_loadu_ps(lanes.as_ptr())
    }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn load8_bits(lanes: &[u32; 8]) -> __m256i {
    #[expect(unsafe_code, reason = "copies by value are spilled to the stack")]
    // SAFETY: the reference is valid for reads of eight numbers.
    unsafe {
        _mm256_loadu_si256(lanes.as_ptr().cast())
    }
}
