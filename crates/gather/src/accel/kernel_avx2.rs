//! Eight boxes, or eight triangles, at a time with AVX2 and FMA; see [`super::kernel`].

use std::arch::x86_64::{
    __m256, _CMP_GE_OQ, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_NEQ_OQ, _mm256_add_ps, _mm256_and_ps,
    _mm256_andnot_ps, _mm256_cmp_ps, _mm256_div_ps, _mm256_fmadd_ps, _mm256_fmsub_ps,
    _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps, _mm256_or_ps, _mm256_set1_ps,
    _mm256_setzero_ps, _mm256_sub_ps,
};

use super::kernel::{BoxHits, Setup, Stack, TriangleHits, WIDEN, trace_with};
use super::mesh_bvh::Block;
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

type V3 = [__m256; 3];

#[target_feature(enable = "avx2,fma")]
#[inline]
fn boxes(node: &Node, ray: &Setup, t_max: f32) -> BoxHits {
    let mut enter = _mm256_setzero_ps();
    let mut leave = _mm256_set1_ps(t_max);
    for axis in 0..3 {
        let near = ray.near[axis];
        let far = if near < 3 { near + 3 } else { near - 3 };
        let origin = _mm256_set1_ps(ray.origin[axis]);
        let inverse = _mm256_set1_ps(ray.inverse[axis]);
        let widened = _mm256_set1_ps(ray.inverse[axis] * WIDEN);
        let t_near = _mm256_mul_ps(_mm256_sub_ps(load(&node.planes[near]), origin), inverse);
        let t_far = _mm256_mul_ps(_mm256_sub_ps(load(&node.planes[far]), origin), widened);
        enter = _mm256_max_ps(t_near, enter);
        leave = _mm256_min_ps(t_far, leave);
    }
    let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave)) as u32;
    BoxHits { mask, t: bytemuck::cast(enter) }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn triangles(block: &Block, ray: &Setup, t_max: f32) -> TriangleHits {
    let origin = ray.origin.map(|x| _mm256_set1_ps(x));
    let direction = ray.direction.map(|x| _mm256_set1_ps(x));
    let v0 = sub(load3(&block.corners[0]), origin);
    let v1 = sub(load3(&block.corners[1]), origin);
    let v2 = sub(load3(&block.corners[2]), origin);
    let (e0, e1, e2) = (sub(v2, v0), sub(v0, v1), sub(v1, v2));
    let u = dot(cross(e0, add(v2, v0)), direction);
    let v = dot(cross(e1, add(v0, v1)), direction);
    let w = dot(cross(e2, add(v1, v2)), direction);
    let sum = _mm256_add_ps(_mm256_add_ps(u, v), w);

    let sign = _mm256_set1_ps(-0.0);
    let slack = _mm256_mul_ps(_mm256_set1_ps(f32::EPSILON), _mm256_andnot_ps(sign, sum));
    let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
    let most = _mm256_max_ps(_mm256_max_ps(u, v), w);
    let negative = _mm256_sub_ps(_mm256_setzero_ps(), slack);
    let inside = _mm256_or_ps(
        _mm256_cmp_ps::<_CMP_GE_OQ>(least, negative),
        _mm256_cmp_ps::<_CMP_LE_OQ>(most, slack),
    );
    if _mm256_movemask_ps(inside) == 0 {
        return TriangleHits { mask: 0, t: [0.0; 8], u: [0.0; 8], v: [0.0; 8] };
    }

    let zero = _mm256_setzero_ps();
    let normal = cross(e1, e0);
    let across = dot(normal, direction);
    let t = _mm256_div_ps(dot(normal, v0), across);
    let valid = _mm256_and_ps(
        _mm256_and_ps(inside, _mm256_cmp_ps::<_CMP_NEQ_OQ>(across, zero)),
        _mm256_and_ps(
            _mm256_cmp_ps::<_CMP_NEQ_OQ>(sum, zero),
            _mm256_and_ps(
                _mm256_cmp_ps::<_CMP_GT_OQ>(t, zero),
                _mm256_cmp_ps::<_CMP_LE_OQ>(t, _mm256_set1_ps(t_max)),
            ),
        ),
    );
    TriangleHits {
        mask: _mm256_movemask_ps(valid) as u32,
        t: bytemuck::cast(t),
        u: bytemuck::cast(_mm256_div_ps(u, sum)),
        v: bytemuck::cast(_mm256_div_ps(v, sum)),
    }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn load(lanes: &[f32; 8]) -> __m256 {
    bytemuck::cast(*lanes)
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn load3(axes: &[[f32; 8]; 3]) -> V3 {
    [load(&axes[0]), load(&axes[1]), load(&axes[2])]
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn sub(a: V3, b: V3) -> V3 {
    [_mm256_sub_ps(a[0], b[0]), _mm256_sub_ps(a[1], b[1]), _mm256_sub_ps(a[2], b[2])]
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn add(a: V3, b: V3) -> V3 {
    [_mm256_add_ps(a[0], b[0]), _mm256_add_ps(a[1], b[1]), _mm256_add_ps(a[2], b[2])]
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn dot(a: V3, b: V3) -> __m256 {
    _mm256_fmadd_ps(a[0], b[0], _mm256_fmadd_ps(a[1], b[1], _mm256_mul_ps(a[2], b[2])))
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn cross(a: V3, b: V3) -> V3 {
    [
        _mm256_fmsub_ps(a[1], b[2], _mm256_mul_ps(a[2], b[1])),
        _mm256_fmsub_ps(a[2], b[0], _mm256_mul_ps(a[0], b[2])),
        _mm256_fmsub_ps(a[0], b[1], _mm256_mul_ps(a[1], b[0])),
    ]
}
