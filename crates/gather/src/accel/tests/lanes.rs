//! Tests of each kernel on a single node and a single block of triangles.

use glam::{DVec3, Vec3, Vec3A};

use super::{Aabb, Kernel, kernels, random};
#[cfg(target_arch = "x86_64")]
use crate::accel::kernel_avx2 as compiled;
#[cfg(target_arch = "aarch64")]
use crate::accel::kernel_neon as compiled;
use crate::accel::kernel_portable::{boxes_portable, triangles_portable};
use crate::accel::triangle_bvh::{Block, LANES};
use crate::accel::walk::{BoxHits, Setup, TINY, TriangleHits};
use crate::accel::wide::Node;

pub(super) fn boxes(kernel: Kernel, node: &Node, ray: &Setup, t_max: f32) -> BoxHits {
    match kernel {
        Kernel::Portable => boxes_portable(node, ray, t_max),
        #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
        #[expect(unsafe_code, reason = "calls code compiled for one kind of processor")]
        // SAFETY: the kernel is what `Kernel::detect` found.
        _ => unsafe { compiled::boxes(node, ray, t_max) },
    }
}

pub(super) fn triangles(kernel: Kernel, block: &Block, ray: &Setup, t_max: f32) -> TriangleHits {
    match kernel {
        Kernel::Portable => triangles_portable(block, ray, t_max),
        #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
        #[expect(unsafe_code, reason = "calls code compiled for one kind of processor")]
        // SAFETY: the kernel is what `Kernel::detect` found.
        _ => unsafe { compiled::triangles(block, ray, t_max) },
    }
}

pub(super) fn setup(origin: Vec3, direction: Vec3) -> Setup {
    Setup::new(origin.into(), direction.into())
}

pub(super) fn has(mask: u32, lane: usize) -> bool {
    mask & (1 << lane) != 0
}

/// Eight boxes of up to unit size in a cube of side two, from the `i`-th set of random numbers.
pub(super) fn random_node(i: u32) -> Node {
    let mut node = Node::EMPTY;
    for lane in 0..8 {
        let [a, b] = [0, 1].map(|k| Vec3A::from(random(20 + 2 * lane + k, i)));
        let at = Vec3A::from(random(40 + lane, i));
        node.set_bounds(lane as usize, Aabb::EMPTY.with(at + a).with(at + b));
    }
    node
}

/// The direction; in half of the cases some components are replaced by zeros of either sign.
pub(super) fn with_zeros(direction: Vec3, i: u32) -> Vec3 {
    let zero = |bit: u32| if i & bit == 0 { 0.0 } else { -0.0 };
    match i / 8 % 8 {
        0 => direction * Vec3::new(0.0, 1.0, 1.0) + Vec3::new(zero(1), -0.0, -0.0),
        1 => Vec3::new(zero(1), zero(2), direction.z),
        2 => Vec3::new(direction.x, zero(1), zero(2)),
        3 => Vec3::new(zero(1), direction.y, 1e-30),
        _ => direction,
    }
}

#[test]
fn every_set_of_lanes_is_told_from_every_other() {
    let aside = Vec3A::new(9.0, 0.0, 0.0);
    for kernel in kernels() {
        for side in [1.0, -1.0] {
            let ray = setup(Vec3::new(0.1, 0.2, 0.0), side * Vec3::Z);
            for set in 0..256 {
                let mut node = Node::EMPTY;
                for lane in 0..8 {
                    let near = 1.0 + lane as f32;
                    let offset = if has(set, lane) { Vec3A::ZERO } else { aside };
                    let ends = [Vec3A::new(-1.0, -1.0, near), Vec3A::new(1.0, 1.0, near + 0.5)];
                    let ends = ends.map(|p| offset + Vec3A::new(1.0, 1.0, side) * p);
                    node.set_bounds(lane, Aabb::EMPTY.with(ends[0]).with(ends[1]));
                }
                for (t_max, before) in [(f32::INFINITY, 0xff), (5.0, 0x1f), (4.9, 0x0f)] {
                    let hits = boxes(kernel, &node, &ray, t_max);
                    assert_eq!(hits.mask, set & before, "{kernel:?} to {t_max}");
                    let t_is = |lane: usize| hits.t[lane] == 1.0 + lane as f32;
                    assert!((0..8).all(|lane| !has(set, lane) || t_is(lane)), "{:?}", hits.t);
                }
            }
            for set in 0..16 {
                let mut block = Block::of([].into_iter());
                for lane in 0..LANES {
                    let at = Vec3A::Z * side * (1.0 + lane as f32);
                    let at = if has(set, lane) { at } else { at + aside };
                    block.set(lane, [at, at + Vec3A::X, at + Vec3A::Y]);
                }
                for (t_max, before) in [(f32::INFINITY, 0xf), (3.0, 0b111), (2.9, 0b11)] {
                    let hits = triangles(kernel, &block, &ray, t_max);
                    assert_eq!(hits.mask, set & before, "{kernel:?} to {t_max}");
                    for lane in (0..LANES).filter(|&lane| has(hits.mask, lane)) {
                        let found = Vec3::new(hits.t[lane], hits.u[lane], hits.v[lane]);
                        let expected = Vec3::new(1.0 + lane as f32, 0.1, 0.2);
                        assert!(found.abs_diff_eq(expected, 1e-6), "{kernel:?} {found}");
                    }
                }
            }
        }
    }
}

/// Where a ray enters and leaves a box, in f64, for directions with `TINY` in place of zero.
fn through(bounds: &Aabb, origin: Vec3, direction: Vec3) -> (f64, f64) {
    let d = direction.to_array().map(|d| if d.abs() < TINY { TINY.copysign(d) } else { d });
    let d = Vec3::from(d).as_dvec3();
    let at = |corner: Vec3A| (Vec3::from(corner).as_dvec3() - origin.as_dvec3()) / d;
    let (a, b) = (at(bounds.min), at(bounds.max));
    (a.min(b).max_element().max(0.0), a.max(b).min_element())
}

/// Rays aimed at edges and corners of boxes. No box that is barely met is missed. None is visited
/// that is missed by more than rounding.
#[test]
fn boxes_err_outwards_only() {
    for kernel in kernels() {
        let (mut met, mut barely, mut missed) = (0, 0, 0);
        for i in 0..20_000 {
            let node = random_node(i);
            let bounds = node.lane_bounds(i as usize % 8);
            let (min, max) = (Vec3::from(bounds.min), Vec3::from(bounds.max));
            let corner = Vec3::select(Vec3::cmpgt(random(50, i), Vec3::splat(0.5)), min, max);
            let target = match i % 3 {
                0 => corner,
                1 => Vec3 { x: min.lerp(max, random(51, i).x).x, ..corner },
                _ => Vec3 { y: min.lerp(max, random(51, i).y).y, ..corner },
            };
            let origin = 6.0 * random(52, i) - 2.0;
            let direction = with_zeros(target - origin, i);
            let hits = boxes(kernel, &node, &setup(origin, direction), f32::INFINITY);
            for lane in 0..8 {
                let (enter, leave) = through(&node.lane_bounds(lane), origin, direction);
                let t = f64::from(hits.t[lane]);
                assert!((t - enter).abs() <= 4e-7 * enter, "{kernel:?} {i}: {t}, not {enter}");
                if enter <= leave {
                    met += 1;
                    barely += u32::from(leave < enter * (1.0 + 1e-6));
                    assert!(has(hits.mask, lane), "{kernel:?} {i}: misses box {lane}");
                } else if enter > leave * (1.0 + 2e-6) {
                    missed += 1;
                    assert!(!has(hits.mask, lane), "{kernel:?} {i}: visits box {lane}");
                }
            }
        }
        assert!(met > 10_000 && barely > 2000 && missed > 10_000, "{met} {barely} {missed}");
    }
}

/// A box that begins exactly where the ray ends counts; one that begins later does not.
#[test]
fn rays_end_at_t_max() {
    for kernel in kernels() {
        let mut ended = 0;
        for i in 0..2000 {
            let node = random_node(i);
            let origin = 4.0 * random(52, i) - 1.0;
            let ray = setup(origin, with_zeros(random(51, i) + 0.5 - origin, i));
            let all = boxes(kernel, &node, &ray, f32::INFINITY);
            for lane in (0..8).filter(|&lane| has(all.mask, lane) && all.t[lane] > 0.0) {
                let t = all.t[lane];
                assert!(has(boxes(kernel, &node, &ray, t).mask, lane));
                assert!(!has(boxes(kernel, &node, &ray, t.next_down()).mask, lane));
                ended += 1;
            }
        }
        assert!(ended > 500, "{ended}");
    }
}

/// Triangles agree with f64, and so every kernel agrees with the portable one. The tolerance
/// depends on how thin the triangle looks from the ray.
#[test]
fn triangles_are_met_where_f64_says() {
    for kernel in kernels() {
        let (mut met, mut missed) = (0, 0);
        for i in 0..20_000 {
            let corner =
                |lane: u64, k: u64| random(60 + 3 * lane + k, i) + Vec3::splat(0.2 * lane as f32);
            let mut block = Block::of([].into_iter());
            for lane in 0..4 {
                block.set(lane as usize, [0, 1, 2].map(|k| corner(lane, k).into()));
            }
            let origin = 4.0 * random(52, i) - 1.5;
            let direction = with_zeros(random(51, i) + 0.3 - origin, i);
            let t_max = if i % 2 == 0 { f32::INFINITY } else { 1.0 };
            let hits = triangles(kernel, &block, &setup(origin, direction), t_max);
            let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
            for lane in 0..LANES {
                let [a, b, c] = [0, 1, 2].map(|k| corner(lane as u64, k).as_dvec3());
                let normal = (b - a).cross(c - a);
                let det = -d.dot(normal);
                let t = (o - a).dot(normal) / det;
                let u = (c - a).dot((o - a).cross(d)) / det;
                let v = -(b - a).dot((o - a).cross(d)) / det;
                let size = [a, b, c].map(|p| (p - o).length_squared()).into_iter().sum::<f64>();
                let slack = 4e-7 * size * d.abs().max_element() / det.abs();
                let within = u.min(v).min(1.0 - u - v);
                let ahead = t.min(f64::from(t_max) - t);
                if within > slack && ahead > slack {
                    met += 1;
                    assert!(has(hits.mask, lane), "{kernel:?} {i}: misses triangle {lane}");
                    let found = [hits.t[lane], hits.u[lane], hits.v[lane]].map(f64::from);
                    let error = (DVec3::from(found) - DVec3::new(t, u, v)).abs();
                    assert!(error.x <= slack * t.max(1.0) && error.y <= slack && error.z <= slack);
                } else if within < -slack || ahead < -slack * t.abs().max(1.0) {
                    missed += 1;
                    assert!(!has(hits.mask, lane), "{kernel:?} {i}: hits triangle {lane}");
                }
            }
        }
        assert!(met > 1000 && missed > 20_000, "{met} {missed}");
    }
}

/// A ray aimed at the shared edge of two triangles meets at least one of them.
#[test]
fn shared_edges_have_no_gap() {
    for kernel in kernels() {
        let mut both = 0;
        for i in 0..50_000 {
            let [a, b, c, origin] = [0, 1, 2, 3].map(|k| random(70 + k, i));
            let target = a.lerp(b, random(74, i).x);
            let d = target + (target - c) + 0.1 * (random(75, i) - 0.5);
            let mut block = Block::of([].into_iter());
            block.set(1, [a, b, c].map(Vec3A::from));
            block.set(2, [b, a, d].map(Vec3A::from));
            let origin = 3.0 * origin - 1.0;
            let direction = target - origin;
            // Seen edge-on, the two may lie behind each other, so that the edge is the outline of
            // both.
            let side = |p: Vec3| direction.dot((b - a).cross(p - a)) / direction.length();
            if side(c) * side(d) > -1e-4 {
                continue;
            }
            let hits = triangles(kernel, &block, &setup(origin, direction), f32::INFINITY);
            assert!(hits.mask != 0, "{kernel:?} {i}: slips through");
            both += u32::from(hits.mask == 0b110);
        }
        assert!(both > 1000, "{both}");
    }
}

#[test]
fn triangles_with_equal_corners_are_never_met() {
    for kernel in kernels() {
        for i in 0..20_000 {
            let [a, b, origin] = [0, 1, 2].map(|k| random(70 + k, i));
            let mut block = Block::of([].into_iter());
            let corners = [[a, a, b], [a, b, a], [b, a, a], [a, a, a]];
            for (lane, corners) in corners.into_iter().enumerate() {
                block.set(lane, corners.map(Vec3A::from));
            }
            for target in [a, b, a.lerp(b, random(74, i).x)] {
                let ray = setup(origin, target - origin);
                let hits = triangles(kernel, &block, &ray, f32::INFINITY);
                assert_eq!(hits.mask, 0, "{kernel:?} {i}");
            }
        }
    }
}

/// All kernels treat a ray that is not finite alike. An axis that is NaN excludes no box, and no
/// triangle is met.
#[test]
fn rays_that_are_not_finite_are_treated_alike() {
    let mut met = 0;
    for i in 0..2000 {
        let node = random_node(i);
        let mut block = Block::of([].into_iter());
        for lane in 0..LANES as u64 {
            let corners = [0, 1, 2].map(|k| random(60 + 3 * lane + k, i).into());
            block.set(lane as usize, corners);
        }
        let mut origin = (4.0 * random(52, i) - 1.0).to_array();
        let mut direction = (random(51, i) + 0.5 - Vec3::from(origin)).to_array();
        let odd = [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY][i as usize / 3 % 4];
        let of = if i % 2 == 0 { &mut origin } else { &mut direction };
        of[i as usize % 3] = odd;
        let ray = setup(origin.into(), direction.into());
        let expected = boxes_portable(&node, &ray, f32::INFINITY);
        met += expected.mask.count_ones();
        for kernel in kernels() {
            let hits = boxes(kernel, &node, &ray, f32::INFINITY);
            assert_eq!((hits.mask, hits.t), (expected.mask, expected.t), "{kernel:?} {i} {ray:?}");
            assert_eq!(triangles(kernel, &block, &ray, f32::INFINITY).mask, 0);
        }
    }
    assert!(met > 1000, "{met}");
}
