//! Eight boxes, or four triangles, at a time with AVX2 and FMA; see [`super::kernel`].

use std::arch::x86_64::{
    __m128, __m256, _CMP_LE_OQ, _mm_add_ps, _mm_and_ps, _mm_cmpge_ps, _mm_cmpgt_ps, _mm_cmple_ps,
    _mm_cmpneq_ps, _mm_div_ps, _mm_fmadd_ps, _mm_fnmadd_ps, _mm_max_ps, _mm_min_ps,
    _mm_movemask_ps, _mm_mul_ps, _mm_or_ps, _mm_set1_ps, _mm_setzero_ps, _mm_sub_ps, _mm256_cmp_ps,
    _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps, _mm256_set1_ps,
    _mm256_setzero_ps, _mm256_sub_ps,
};

use super::kernel::{BoxHits, Setup, Stack, TriangleHits, WIDEN, trace_with};
use super::mesh_bvh::{Block, LANES};
use super::wide::Node;
use super::{Accel, Hit, Ray};

/// [`super::kernel::trace`] compiled for AVX2.
#[target_feature(enable = "avx2,fma")]
pub(super) fn trace<const ANY: bool>(
    accel: &Accel,
    ray: &Ray,
    stack: &mut Stack,
    accept: impl Fn(&Hit) -> bool,
) -> Option<Hit> {
    trace_with::<ANY>(
        accel,
        ray,
        stack,
        accept,
        |node, ray, t_max| boxes(node, ray, t_max),
        |block, ray, t_max| triangles(block, ray, t_max),
    )
}

#[target_feature(enable = "avx2,fma")]
#[inline]
pub(super) fn boxes(node: &Node, ray: &Setup, t_max: f32) -> BoxHits {
    let mut enter = _mm256_setzero_ps();
    let mut leave = _mm256_set1_ps(t_max);
    for axis in 0..3 {
        let near = ray.near[axis];
        let far = if near < 3 { near + 3 } else { near - 3 };
        let origin = _mm256_set1_ps(ray.origin[axis]);
        let inverse = _mm256_set1_ps(ray.inverse[axis]);
        let widened = _mm256_set1_ps(ray.inverse[axis] * WIDEN);
        let t_near = _mm256_mul_ps(_mm256_sub_ps(load8(&node.planes[near]), origin), inverse);
        let t_far = _mm256_mul_ps(_mm256_sub_ps(load8(&node.planes[far]), origin), widened);
        enter = _mm256_max_ps(t_near, enter);
        leave = _mm256_min_ps(t_far, leave);
    }
    let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave)) as u32;
    BoxHits { mask, t: bytemuck::cast(enter) }
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
    bytemuck::cast(*lanes)
}
