//! A light buffer answers as the hierarchy does.

use super::crowd::{THIN, crowd, lets_pass, sheet, snapshot, turned};
use super::*;
use crate::accel::LightBuffer;
use crate::surface::Frames;

/// Traces rays along a direction that leave surfaces or start anywhere, and compares. Returns how
/// many are occluded and how many were left to the hierarchy.
fn compare(placed: Vec<(Affine3A, Arc<Mesh>)>, direction: Vec3, kernel: Kernel) -> (usize, usize) {
    let snapshot = snapshot(placed);
    let accel = AccelCache::new(Levels::One).update(&snapshot, kernel);
    let (_, bvh) = accel.whole().expect("one hierarchy");
    let frames: Vec<_> =
        snapshot.instances.iter().map(|i| Frames::new(i.world_from_object)).collect();
    let bounds = accel.bounds();
    let extent = bounds.min.abs().max(bounds.max.abs()).max_element();
    let slack = frames.iter().map(|f| f.error_within(extent)).fold(0.0, f32::max);
    let buffer = LightBuffer::new(&accel, direction, slack, |instance, _| instance != THIN);
    let buffer = buffer.expect("something to light");

    let mut rays = Vec::new();
    for (n, block) in (0..).zip(bvh.blocks.iter()) {
        for lane in (0..4).filter(|&lane| block.is_used()[lane]) {
            let corner = |v: usize| Vec3::from([0, 1, 2].map(|axis| block.corners[v][axis][lane]));
            let [a, b, c] = [0, 1, 2].map(corner);
            let own = (block.instance[lane], block.triangle[lane]);
            let mut s = Sampler::new(4, n, lane as u32);
            // The sheets cover cells, so most rays start on them.
            for _ in 0..if block.instance[lane] < 2 { 500 } else { 4 } {
                let u = s.square();
                let (u, v) = if u.x + u.y > 1.0 { (1.0 - u.x, 1.0 - u.y) } else { (u.x, u.y) };
                let on_it = a + u * (b - a) + v * (c - a);
                rays.push((on_it - 0.9 * slack * direction, Some(own)));
            }
            // At edges and corners rounding decides. Along an axis, the hierarchy's boxes may just
            // miss what the triangle just meets.
            if direction.abs().max_element() < 1.0 {
                rays.extend([(a, Some(own)), (0.5 * (a + b), Some(own)), (b, None)]);
            }
        }
    }
    let [low, size] = [bounds.min, bounds.max - bounds.min].map(Vec3::from);
    rays.extend((0..4000).map(|i| (low + size * random(6, i), None)));

    let of = |n: u32| (ray(rays[n as usize].0, direction), n);
    let accept = |&n: &u32, hit: &Hit| {
        rays[n as usize].1 != Some((hit.instance, hit.triangle)) && !lets_pass(hit, n)
    };
    let count = rays.len() as u32;
    let [mut by_tree, mut by_buffer] = [0, 1].map(|_| vec![None; rays.len()]);
    let (all, stacks) = ((0..count).map(of), &mut Stacks::default());
    accel.occluded(all.clone(), stacks, accept, |n, hit| by_tree[n as usize] = Some(hit));
    assert!(all.clone().all(|(ray, _)| buffer.answers(&ray)));
    let mut left = Vec::new();
    let mut tell = |n, hit| by_buffer[n as usize] = Some(hit);
    buffer.occluded(all, accept, &mut tell, |ray, n| left.push((ray, n)));
    let left_count = left.len();
    accel.occluded(left.into_iter(), stacks, accept, tell);
    for (n, (tree, buffer)) in by_tree.iter().zip(&by_buffer).enumerate() {
        assert_eq!(tree, buffer, "{direction} {kernel:?}: ray {n}, {:?}", rays[n]);
    }
    let occluded = by_tree.iter().filter(|hit| **hit == Some(true)).count();
    (occluded, left_count)
}

#[test]
fn says_what_the_hierarchy_says() {
    let skew = Vec3::new(0.3, 0.8, -0.5).normalize();
    let low = Vec3::new(1.0, 0.01, 0.02).normalize();
    for kernel in kernels() {
        for direction in [skew, -skew, low, Vec3::Y, Vec3::X, Vec3::NEG_Z] {
            for (scale, to) in [(1.0, Vec3::ZERO), (1e-3, Vec3::splat(0.2)), (50.0, Vec3::X * 1e4)]
            {
                let (occluded, left) = compare(crowd(scale, to), direction, kernel);
                assert!(occluded > 1000, "{direction} {scale} {occluded}");
                assert_eq!(left, 0, "{direction} {scale}");
            }
        }
    }
}

/// Where a crowd of triangles lies over one cell, rays are left to the hierarchy.
#[test]
fn crowded_cells_are_left_to_the_hierarchy() {
    let desert = (Affine3A::IDENTITY, sheet(1000.0));
    let heap = (turned(0.5, 0.2, Vec3::Y), soup(2000, 0.1));
    let direction = Vec3::new(0.3, 0.8, -0.5).normalize();
    for kernel in kernels() {
        let (occluded, left) = compare(vec![desert.clone(), heap.clone()], direction, kernel);
        assert!(occluded > 1000 && left > 10_000, "{occluded} {left}");
    }
}

/// Rays in other directions are not answered.
#[test]
fn answers_only_its_own_rays() {
    let accel =
        AccelCache::new(Levels::One).update(&snapshot(crowd(1.0, Vec3::ZERO)), Kernel::Portable);
    let buffer = LightBuffer::new(&accel, Vec3::Y, 0.0, |_, _| true).expect("something to light");
    assert!(buffer.answers(&ray(Vec3::ZERO, Vec3::Y)));
    assert!(!buffer.answers(&ray(Vec3::ZERO, Vec3::NEG_Y)));
    assert!(!buffer.answers(&Ray { t_max: 1.0, ..ray(Vec3::ZERO, Vec3::Y) }));
}

/// Geometry without area across the light, empty scenes and moving instances are left to the
/// hierarchy or answered correctly.
#[test]
fn flat_and_empty_scenes() {
    for kernel in kernels() {
        // The sheet is seen edge-on.
        compare(vec![(Affine3A::IDENTITY, sheet(1.0))], Vec3::X, kernel);
        let point = mesh(vec![Vec3::ONE; 3], vec![[0, 1, 2]]);
        compare(vec![(Affine3A::IDENTITY, point)], Vec3::Y, kernel);
    }
    let empty = AccelCache::new(Levels::One).update(&snapshot(vec![]), Kernel::Portable);
    assert!(LightBuffer::new(&empty, Vec3::Y, 0.0, |_, _| true).is_none());
    let two =
        AccelCache::new(Levels::Two).update(&snapshot(crowd(1.0, Vec3::ZERO)), Kernel::Portable);
    assert!(LightBuffer::new(&two, Vec3::Y, 0.0, |_, _| true).is_none());
}
