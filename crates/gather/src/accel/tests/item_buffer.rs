//! An item buffer answers as the hierarchy does.

use super::crowd::{THIN, crowd, lets_pass, sheet, snapshot, turned};
use super::*;
use crate::accel::{ItemBuffer, Pyramid};

/// A pyramid of rays from a point towards another, with this extent to either side.
fn pyramid(eye: Vec3, target: Vec3, half: [f32; 2]) -> Pyramid {
    let ahead = (target - eye).normalize();
    let right = ahead.cross(Vec3::new(0.1, 1.0, 0.05)).normalize();
    Pyramid { eye, axes: [right, right.cross(ahead), ahead], half, pixel: half[1] / 100.0 }
}

/// Numbers of rays by outcome.
#[derive(Clone, Copy, Debug, Default)]
struct Outcome {
    hit: usize,
    missed: usize,
    /// Left to the hierarchy.
    left: usize,
}

/// Compares what rays through a pyramid meet, to its edges and a little beyond. Many go through
/// corners and edges of triangles.
fn compare(placed: Vec<(Affine3A, Arc<Mesh>)>, pyramid: &Pyramid, kernel: Kernel) -> Outcome {
    let snapshot = snapshot(placed);
    let accel = AccelCache::new(Levels::One).update(&snapshot, kernel);
    let (_, bvh) = accel.whole().expect("one hierarchy");
    let items = ItemBuffer::new(&accel, pyramid, |instance, _| instance != THIN);
    let items = items.expect("something to see");

    let mut directions = Vec::new();
    for block in bvh.blocks.iter() {
        for lane in (0..4).filter(|&lane| block.is_used()[lane]) {
            let corner = |v: usize| Vec3::from([0, 1, 2].map(|axis| block.corners[v][axis][lane]));
            let [a, b, c] = [0, 1, 2].map(corner);
            let through = [a, b, c, 0.5 * (a + b), 0.3 * b + 0.7 * c, (a + b + c) / 3.0];
            directions.extend(through.map(|point| point - pyramid.eye));
        }
    }
    let [right, up, ahead] = pyramid.axes;
    directions.extend((0..20_000).map(|i| {
        let at = 1.02 * (2.0 * random(9, i) - 1.0);
        ahead + at.x * pyramid.half[0] * right + at.y * pyramid.half[1] * up
    }));
    let rays: Vec<_> = directions
        .into_iter()
        .filter_map(|direction| Some(ray(pyramid.eye, direction.try_normalize()?)))
        .collect();

    let count = rays.len() as u32;
    let all = (0..count).map(|n| (rays[n as usize], n));
    let accept = |&n: &u32, hit: &Hit| !lets_pass(hit, n);
    let [mut by_tree, mut by_items] = [0, 1].map(|_| vec![None; rays.len()]);
    let stacks = &mut Stacks::default();
    accel.closest(all.clone(), stacks, accept, |n, hit| by_tree[n as usize] = Some(hit));
    let (mut left, mut found) = (0, Outcome::default());
    let tell = |n: u32, hit: Option<Hit>| {
        match hit {
            Some(_) => found.hit += 1,
            None => found.missed += 1,
        }
        by_items[n as usize] = Some(hit);
    };
    items.closest(all, accept, tell, |_, _| left += 1);
    let mut ties = 0;
    for (n, (tree, items)) in by_tree.iter().zip(&by_items).enumerate() {
        let (Some(tree), Some(items)) = (tree, items) else { continue };
        if tree == items {
            continue;
        }
        let [t, other] = [tree, items].map(|hit| hit.map_or(f32::INFINITY, |hit| hit.t));
        let is_tie = (t - other).abs() <= 1e-5 * t;
        assert!(is_tie, "{pyramid:?} {kernel:?}: {:?}: {tree:?}, {items:?}", rays[n]);
        ties += 1;
    }
    // At a shared edge either triangle may be found.
    assert!(ties * 50 < rays.len(), "{ties} ties of {}", rays.len());
    Outcome { left, ..found }
}

#[test]
fn says_what_the_hierarchy_says() {
    let around = Vec3::new(0.4, 0.3, 0.2);
    for kernel in kernels() {
        for (scale, to) in [(1.0, Vec3::ZERO), (1e-3, Vec3::splat(0.2)), (50.0, Vec3::X * 1e4)] {
            let at = |x: f32, y: f32, z: f32| to + scale * Vec3::new(x, y, z);
            for eye in
                [at(3.0, 2.5, 4.0), at(-3.0, 0.3, 0.1), at(0.1, -1.0, 0.2), at(0.0, 9.0, 0.1)]
            {
                for half in [[0.9, 0.5], [0.05, 0.05], [8.0, 5.0]] {
                    let pyramid = pyramid(eye, to + scale * around, half);
                    let found = compare(crowd(scale, to), &pyramid, kernel);
                    assert!(found.hit > 1000, "{pyramid:?} {found:?}");
                }
            }
        }
    }
}

/// Where a crowd of triangles is seen through one cell, rays are left to the hierarchy.
#[test]
fn crowded_cells_are_left_to_the_hierarchy() {
    let heap = vec![(turned(0.5, 0.2, Vec3::Y), soup(5000, 0.02))];
    for kernel in kernels() {
        let far = pyramid(Vec3::Z * 200.0, Vec3::Y, [0.5, 0.5]);
        let found = compare(heap.clone(), &far, kernel);
        assert!(found.left > 20_000, "{found:?}");
    }
}

/// Eyes that lie in a surface, or very near to one.
#[test]
fn eyes_in_walls() {
    let on_sheet = Vec3::new(0.3, 0.0, 0.2);
    for kernel in kernels() {
        for off in [0.0, 1e-6, -1e-4, 1e-3] {
            for target in [Vec3::X * 4.0, Vec3::new(1.0, -2.0, 0.4), Vec3::Y * 3.0] {
                let pyramid = pyramid(on_sheet + off * Vec3::Y, target, [0.9, 0.5]);
                let placed = vec![
                    (Affine3A::IDENTITY, sheet(4.0)),
                    (turned(1.0, 0.3, 0.5 * Vec3::Y), sheet(1.0)),
                    (turned(1.0, 0.3, Vec3::NEG_Y), ball(12, 0.2)),
                ];
                compare(placed, &pyramid, kernel);
            }
        }
    }
}

/// Rays that start elsewhere, go backwards or end are not answered.
#[test]
fn answers_only_its_own_rays() {
    let accel =
        AccelCache::new(Levels::One).update(&snapshot(crowd(1.0, Vec3::ZERO)), Kernel::Portable);
    let pyramid = pyramid(Vec3::Z * 5.0, Vec3::ZERO, [0.9, 0.5]);
    let items = ItemBuffer::new(&accel, &pyramid, |_, _| true).expect("something to see");
    let is_left = |ray: Ray| {
        let mut is_left = false;
        items.closest(once((ray, ())), |(), _| true, |(), _| {}, |_, ()| is_left = true);
        is_left
    };
    assert!(!is_left(ray(pyramid.eye, Vec3::NEG_Z)));
    assert!(is_left(ray(pyramid.eye, Vec3::Z)));
    assert!(is_left(ray(pyramid.eye, Vec3::X)));
    assert!(is_left(ray(pyramid.eye + Vec3::X * 1e-3, Vec3::NEG_Z)));
    assert!(is_left(Ray { t_max: 1.0, ..ray(pyramid.eye, Vec3::NEG_Z) }));
    assert!(is_left(ray(pyramid.eye, Vec3::NAN)));
}

/// Moving instances, empty scenes, and geometry out of view.
#[test]
fn flat_and_empty_scenes() {
    let ahead = pyramid(Vec3::Z, Vec3::ZERO, [0.9, 0.5]);
    for kernel in kernels() {
        // The sheet is seen edge-on.
        compare(vec![(Affine3A::IDENTITY, sheet(1.0))], &ahead, kernel);
        let back = pyramid(Vec3::Z * 5.0, Vec3::Z * 9.0, [0.9, 0.5]);
        let found = compare(crowd(1.0, Vec3::ZERO), &back, kernel);
        assert!(found.hit == 0 && found.missed > 10_000, "{found:?}");
    }
    let empty = AccelCache::new(Levels::One).update(&snapshot(vec![]), Kernel::Portable);
    assert!(ItemBuffer::new(&empty, &ahead, |_, _| true).is_none());
    let two =
        AccelCache::new(Levels::Two).update(&snapshot(crowd(1.0, Vec3::ZERO)), Kernel::Portable);
    assert!(ItemBuffer::new(&two, &ahead, |_, _| true).is_none());
}

/// Thousands of sheets behind one another, with holes, so that none hides the next. Blocks hold two
/// of them and fill the picture, so there must be thirty times fewer cells.
#[test]
fn deep_scenes_do_not_take_for_ever() {
    let through = |n: u32| (turned(1.0, 0.0, -0.001 * n as f32 * Vec3::Y), sheet(8.0));
    let placed = snapshot((0..4000).map(through).collect());
    let accel = AccelCache::new(Levels::One).update(&placed, Kernel::detect());
    let above = Pyramid { pixel: 0.001, ..pyramid(Vec3::Y, Vec3::ZERO, [0.9, 0.9]) };
    let cells = |accel| {
        let items = ItemBuffer::new(accel, &above, |_, _| false).expect("something to see");
        (items.cell_count(), items)
    };
    let few = AccelCache::new(Levels::One).update(&snapshot(vec![through(0)]), Kernel::detect());
    let (many, _) = cells(&few);
    let (count, items) = cells(&accel);
    assert!(count > 10_000 && 20 * count < many, "{count} cells, {many} over one sheet");
    let mut left = 0;
    let rays = (0..100).map(|n| (ray(above.eye, above.axes[2]), n));
    items.closest(rays, |_, _| true, |_, _| {}, |_, _| left += 1);
    assert_eq!(left, 100);
}
