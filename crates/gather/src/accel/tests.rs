mod agree;
mod crowd;
mod item_buffer;
mod lanes;
mod light_buffer;
mod refit;

use std::iter::once;
use std::sync::Arc;

use glam::{Affine3A, DVec3, Quat, Vec3};
use lumencast_scene::{Deformation, Instance, Mesh, MeshId, NodeId, Primitive, Snapshot, Vertices};

use super::*;
use crate::sampling::{Sampler, sphere};
use crate::world::{World, WorldCache};

fn kernels() -> Vec<Kernel> {
    let mut kernels = vec![Kernel::Portable, Kernel::detect()];
    kernels.dedup();
    kernels
}

pub(super) fn random(seed: u64, i: u32) -> Vec3 {
    let mut s = Sampler::new(seed, 0, i);
    s.square().extend(s.number())
}

fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Arc<Mesh> {
    let vertices =
        Vertices { normals: vec![Vec3::Y; positions.len()], positions, tangents: vec![] };
    let primitive = Primitive { triangles, vertices, ..Primitive::default() };
    Arc::new(Mesh { primitives: vec![primitive], ..Mesh::default() })
}

fn closest(accel: &Accel, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
    let mut hit = None;
    let accept = |(): &(), hit: &Hit| accept(hit);
    accel.closest(once((*ray, ())), &mut Stacks::default(), accept, |(), found| hit = found);
    hit
}

fn occluded(accel: &Accel, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> bool {
    let mut occluded = false;
    let accept = |(): &(), hit: &Hit| accept(hit);
    accel.occluded(once((*ray, ())), &mut Stacks::default(), accept, |(), found| occluded = found);
    occluded
}

/// Small triangles scattered through the unit cube.
fn soup(count: u32, size: f32) -> Arc<Mesh> {
    let mut positions = Vec::new();
    for i in 0..count {
        let at = random(1, i);
        positions.extend((2..5).map(|k| at + size * (random(k, i) - 0.5)));
    }
    let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    mesh(positions, triangles)
}

/// A closed ball of radius 1 with bumps of this relative height. Vertices are shared, so edges are
/// bit-equal.
fn ball(rings: u32, bumps: f32) -> Arc<Mesh> {
    let around = 2 * rings;
    let mut positions = vec![Vec3::Y, Vec3::NEG_Y];
    for ring in 1..rings {
        for k in 0..around {
            let (p, a) = (
                std::f32::consts::PI * ring as f32 / rings as f32,
                std::f32::consts::TAU * k as f32 / around as f32,
            );
            let bump = 1.0 + bumps * (7.0 * p).sin() * (5.0 * a).cos();
            positions.push(bump * Vec3::new(p.sin() * a.cos(), p.cos(), p.sin() * a.sin()));
        }
    }
    let at = |ring: u32, k: u32| 2 + (ring - 1) * around + k % around;
    let mut triangles = Vec::new();
    for k in 0..around {
        triangles.push([0, at(1, k + 1), at(1, k)]);
        triangles.push([1, at(rings - 1, k), at(rings - 1, k + 1)]);
        for ring in 1..rings - 1 {
            let (a, b, c, d) = (at(ring, k), at(ring, k + 1), at(ring + 1, k), at(ring + 1, k + 1));
            triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    mesh(positions, triangles)
}

fn accel(meshes: &[(Affine3A, Arc<Mesh>)], kernel: Kernel) -> Accel {
    let built = (0..)
        .zip(meshes)
        .map(|(i, (m, mesh))| (i, *m, Arc::new(TriangleBvh::build(mesh, None, Trees::Improved))));
    Accel::new(built, kernel)
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_max: f32::INFINITY }
}

/// Distance along a ray by Möller–Trumbore in f64, over every triangle.
fn by_brute_force(meshes: &[(Affine3A, Arc<Mesh>)], ray: &Ray) -> Option<f64> {
    let mut best: Option<f64> = None;
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    for (to_world, mesh) in meshes {
        let p = &mesh.primitives[0];
        for t in &p.triangles {
            let corner = |k: usize| -> DVec3 {
                to_world.transform_point3(p.vertices.positions[t[k] as usize]).as_dvec3()
            };
            let (a, e1, e2) = (corner(0), corner(1) - corner(0), corner(2) - corner(0));
            let h = d.cross(e2);
            let det = e1.dot(h);
            let s = (o - a) / det;
            let (u, q) = (s.dot(h), s.cross(e1));
            let (v, t) = (d.dot(q), e2.dot(q));
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && best.is_none_or(|b| t < b) {
                best = Some(t);
            }
        }
    }
    best
}

fn placed_soups() -> Vec<(Affine3A, Arc<Mesh>)> {
    let soup = soup(300, 0.15);
    let turned = Affine3A::from_scale_rotation_translation(
        Vec3::new(1.0, -2.0, 0.5),
        Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.0, -0.7),
        Vec3::new(1.5, 0.2, -0.4),
    );
    vec![
        (Affine3A::IDENTITY, soup.clone()),
        (turned, soup),
        (Affine3A::IDENTITY, mesh(vec![], vec![])),
    ]
}

#[test]
fn finds_what_brute_force_finds() {
    let meshes = placed_soups();
    for kernel in kernels() {
        let accel = accel(&meshes, kernel);
        let (mut hits, mut differ) = (0, 0);
        for i in 0..4000 {
            let origin = 3.0 * random(7, i) - 1.0;
            let ray = ray(origin, (0.1 + random(9, i).x) * (random(8, i) - origin));
            let found = closest(&accel, &ray, |_| true);
            let expected = by_brute_force(&meshes, &ray);
            hits += u32::from(found.is_some());
            // At an edge the two may rarely decide differently.
            let same = match (found, expected) {
                (Some(hit), Some(t)) => (f64::from(hit.t) - t).abs() < 1e-4 * t.max(0.1),
                (found, expected) => found.is_none() && expected.is_none(),
            };
            differ += u32::from(!same);
            assert_eq!(occluded(&accel, &ray, |_| true), found.is_some());
            if let Some(hit) = found {
                let before = Ray { t_max: hit.t * 0.9999, ..ray };
                assert_eq!(
                    closest(&accel, &before, |_| true),
                    None,
                    "nothing lies before the nearest"
                );
            }
        }
        assert!(hits > 1000 && differ <= 2, "{kernel:?}: {hits} hits, {differ} differ");
    }
}

/// Rays of very different lengths, some of which meet nothing, traced in batches and one by one.
#[test]
fn rays_in_flight_do_not_disturb_each_other() {
    for kernel in kernels() {
        let soup = soup(1000, 0.3);
        let turned = |k: u16| (Affine3A::from_rotation_y(f32::from(k)), soup.clone());
        let accel = accel(&[0, 1, 2, 3, 4].map(turned), kernel);
        let mut stacks = Stacks::default();
        // Later rounds reuse the stacks of earlier ones. Counts are below and above the number in
        // flight.
        for count in [1000, 0, 1, 2, 3, 4, 7] {
            let rays: Vec<_> = (0..count)
                .map(|i| {
                    let origin = 3.0 * random(7, i) - 1.0;
                    let t_max = [0.1, 1.0, 9.0][i as usize % 3];
                    Ray { t_max, ..ray(origin, random(8, i) - origin) }
                })
                .collect();
            // Every fifth ray ignores the triangles of even number.
            let accept = |n: u32, hit: &Hit| !n.is_multiple_of(5) || hit.triangle % 2 == 1;
            let numbered = || rays.iter().copied().zip(0..);
            let (mut hits, mut occlusions) = (vec![None; rays.len()], vec![None; rays.len()]);
            accel.closest(
                numbered(),
                &mut stacks,
                |&n, hit| accept(n, hit),
                |n, hit| {
                    assert_eq!(hits[n as usize].replace(hit), None, "told once");
                },
            );
            accel.occluded(
                numbered(),
                &mut stacks,
                |&n, hit| accept(n, hit),
                |n, found| {
                    assert_eq!(occlusions[n as usize].replace(found), None, "told once");
                },
            );
            for (ray, n) in numbered() {
                let alone = closest(&accel, &ray, |hit| accept(n, hit));
                assert_eq!(hits[n as usize], Some(alone), "{kernel:?}: {n} of {count}");
                assert_eq!(occlusions[n as usize], Some(alone.is_some()), "{kernel:?}: {n}");
            }
            let met = hits.iter().flatten().flatten().count();
            assert!(count < 1000 || (200..800).contains(&met), "{met} of {count}");
        }
    }
}

/// The walk visits near children first. Otherwise results would be the same but later.
#[test]
fn near_surfaces_are_met_first() {
    let mut tried = Vec::new();
    for kernel in kernels() {
        let accel = accel(&[(Affine3A::IDENTITY, soup(3000, 0.2))], kernel);
        let (count, hits) = (std::cell::Cell::new(0), std::cell::Cell::new(0));
        for i in 0..4000 {
            let ray = ray(3.0 * random(7, i) - 1.0, 0.5 - (3.0 * random(7, i) - 1.0));
            let found = closest(&accel, &ray, |_| {
                count.set(count.get() + 1);
                true
            });
            hits.set(hits.get() + u32::from(found.is_some()));
        }
        assert!(hits.get() > 3900, "{kernel:?}: {}", hits.get());
        tried.push(f64::from(count.get()) / f64::from(hits.get()));
    }
    let most = tried.iter().copied().fold(0.0, f64::max);
    let least = tried.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(most < 1.6 && most / least < 1.01, "surfaces tried for each one found: {tried:?}");
}

#[test]
fn refused_hits_let_the_next_one_through() {
    let at = |y: f32| [Vec3::new(-1.0, y, -1.0), Vec3::new(3.0, y, -1.0), Vec3::new(-1.0, y, 3.0)];
    let positions = (0..20).flat_map(|k| at(k as f32)).collect();
    let layers = mesh(positions, (0..20).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect());
    for kernel in kernels() {
        let accel = accel(&[(Affine3A::IDENTITY, layers.clone())], kernel);
        for passed in 0..20 {
            let down = ray(Vec3::new(0.0, 20.0, 0.0), Vec3::NEG_Y);
            let hit = closest(&accel, &down, |h| h.triangle < 20 - passed);
            assert_eq!(hit.map(|h| h.triangle), Some(19 - passed));
        }
    }
}

/// No ray leaves a closed mesh from inside. Most are aimed at edges and vertices; some are
/// axis-parallel, with zeros in their directions.
#[test]
fn closed_meshes_leak_nowhere() {
    let ball = ball(24, 0.1);
    let far = Affine3A::from_scale_rotation_translation(
        Vec3::splat(3.0),
        Quat::from_rotation_y(0.4),
        Vec3::new(500.0, -200.0, 900.0),
    );
    for (to_world, kernel) in
        kernels().into_iter().flat_map(|k| [(Affine3A::IDENTITY, k), (far, k)])
    {
        let accel = accel(&[(to_world, ball.clone())], kernel);
        let p = &ball.primitives[0];
        for (i, t) in (0..).zip(&p.triangles) {
            let [a, b, c] = t.map(|k| to_world.transform_point3(p.vertices.positions[k as usize]));
            for origin in [Vec3::ZERO, 0.2 * random(3, i)].map(|o| to_world.transform_point3(o)) {
                for w in [0.0, 0.5, random(4, i).x, 1.0] {
                    for target in [a.lerp(b, w), b.lerp(c, w), c.lerp(a, w)] {
                        let ray = ray(origin, target - origin);
                        assert!(
                            closest(&accel, &ray, |_| true).is_some(),
                            "{kernel:?} {i} {ray:?}"
                        );
                    }
                }
            }
        }
        let center = to_world.transform_point3(Vec3::ZERO);
        for axis in Vec3::AXES {
            for direction in [axis, -axis] {
                assert!(occluded(&accel, &ray(center, direction), |_| true));
            }
        }
    }
}

/// A mesh whose triangles do not share bit-equal edges leaks, so the test above can fail.
#[test]
fn a_gap_of_a_millionth_is_found() {
    let mut ball = (*ball(24, 0.1)).clone();
    let p = &mut ball.primitives[0];
    let corners: Vec<Vec3> =
        p.triangles.iter().flatten().map(|&i| p.vertices.positions[i as usize]).collect();
    p.vertices.positions = corners
        .chunks(3)
        .flat_map(|t| {
            let m = (t[0] + t[1] + t[2]) / 3.0;
            [0, 1, 2].map(|k| t[k].lerp(m, 1e-5))
        })
        .collect();
    p.triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let accel = accel(&[(Affine3A::IDENTITY, Arc::new(ball))], Kernel::detect());
    let leaks = corners
        .chunks(3)
        .filter(|t| !occluded(&accel, &ray(Vec3::ZERO, 0.5 * (t[0] + t[1])), |_| true))
        .count();
    assert!(leaks > 0);
}

#[test]
fn degenerate_input_is_harmless() {
    let same = mesh(vec![Vec3::ONE; 3], vec![[0, 1, 2]; 100]);
    let mut positions: Vec<_> =
        (0..300).map(|i| Vec3::splat(2.0f32.powi(i / 3 - 50)) * random(1, i as u32)).collect();
    positions[5] = Vec3::new(f32::NAN, 0.0, 0.0);
    positions[9] = Vec3::new(f32::INFINITY, 0.0, 0.0);
    let wild = mesh(positions, (0..100).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect());
    for kernel in kernels() {
        let accel = accel(
            &[(Affine3A::IDENTITY, same.clone()), (Affine3A::IDENTITY, wild.clone())],
            kernel,
        );
        for i in 0..500 {
            for direction in
                [sphere(random(2, i).truncate()), Vec3::X, Vec3::ZERO, Vec3::splat(f32::NAN)]
            {
                let hit = closest(&accel, &ray(random(3, i), direction), |_| true);
                assert!(hit.is_none_or(|h| h.instance == 1 && h.t > 0.0));
            }
        }
    }
    let nothing = accel(&[], Kernel::detect());
    assert!(nothing.bounds().is_empty());
    assert!(!occluded(&nothing, &ray(Vec3::ZERO, Vec3::X), |_| true));
}

fn snapshot(instances: Vec<Instance>) -> Arc<Snapshot> {
    Arc::new(Snapshot {
        version: 0,
        time: 0.0,
        origin: Vec3::ZERO,
        instances,
        materials: Arc::new([]),
        lights: vec![],
        environment: Default::default(),
    })
}

#[test]
fn cache_keeps_what_has_not_changed() {
    let mesh = soup(50, 0.2);
    let deformation = || Some(Arc::new(Deformation::new(mesh.clone(), vec![], None)));
    let instance = |node, deformation| Instance {
        node: NodeId(node),
        copy: 0,
        still: true,
        mesh_id: MeshId(0),
        mesh: mesh.clone(),
        deformation,
        world_from_object: Affine3A::IDENTITY,
    };
    let mut cache = AccelCache::default();
    let mut update = |s: &Arc<Snapshot>| {
        let accel = cache.update(s, Kernel::detect());
        accel.placed.iter().map(|p| Arc::as_ptr(&p.bvh)).collect::<Vec<_>>()
    };
    let both = snapshot(vec![instance(0, None), instance(1, None), instance(2, deformation())]);
    let first = update(&both);
    assert_eq!(first[0], first[1], "two instances of a mesh share its hierarchy");
    assert_ne!(first[0], first[2]);
    assert_eq!(update(&both), first);
    let moved = snapshot(vec![instance(0, None), instance(2, deformation())]);
    assert_eq!(update(&moved)[0], first[0]);
    let shared = deformation();
    let [a, b] = update(&snapshot(vec![instance(2, shared.clone()), instance(2, shared)]))[..]
    else {
        panic!("two instances")
    };
    assert_eq!(a, b, "instances of a node share its hierarchy");
    update(&snapshot(vec![]));
    let added_again = update(&snapshot(vec![instance(0, None)]));
    assert_eq!(added_again[0], first[0], "somebody has the mesh still");
    drop((both, moved));
    drop(mesh);
    update(&snapshot(vec![]));
    assert!(cache.rigid.is_empty() && cache.deforming.is_empty());
}

/// One hierarchy over all triangles finds what two levels find, under the same names. It is kept
/// while the snapshot is the same. Meshes with very many instances are not copied.
#[test]
fn one_level_finds_what_two_levels_find() {
    let (soup, ball) = (soup(300, 0.15), ball(12, 0.2));
    let instance = |node, mesh: &Arc<Mesh>, deformation, world_from_object| Instance {
        node: NodeId(node),
        copy: 0,
        still: true,
        mesh_id: MeshId(node),
        mesh: mesh.clone(),
        deformation,
        world_from_object,
    };
    let deformation = Some(Arc::new(Deformation::new(ball.clone(), vec![], None)));
    let both = snapshot(vec![
        instance(0, &soup, None, Affine3A::IDENTITY),
        instance(1, &soup, None, placed_soups()[1].0),
        instance(2, &ball, deformation, Affine3A::from_scale(Vec3::new(0.5, -0.25, 0.5))),
    ]);
    let mut cache = AccelCache::new(Levels::One);
    let whole = cache.update(&both, Kernel::detect());
    let two = AccelCache::new(Levels::Two).update(&both, Kernel::detect());
    assert_eq!((whole.placed.len(), two.placed.len()), (1, 3));
    let mut met = [0; 3];
    for i in 0..4000 {
        let origin = 3.0 * random(17, i) - 1.0;
        let ray = ray(origin, random(18, i) - origin);
        let found = [&whole, &two].map(|accel| closest(accel, &ray, |_| true));
        let [Some(a), Some(b)] = found else {
            assert_eq!(found, [None, None], "{ray:?}");
            continue;
        };
        met[a.instance as usize] += 1;
        let names = [a, b].map(|hit| (hit.instance, hit.primitive, hit.triangle));
        assert_eq!(names[0], names[1]);
        assert!((a.t - b.t).abs() < 1e-4 * b.t.max(0.1), "{} {}", a.t, b.t);
        assert!((a.weights() - b.weights()).abs().max_element() < 1e-2);
    }
    assert!(met.iter().all(|&n| n > 20), "{met:?}");

    let again = cache.update(&both, Kernel::detect());
    assert!(Arc::ptr_eq(&again.placed[0].bvh, &whole.placed[0].bvh));
    let other = cache.update(&snapshot(both.instances.clone()), Kernel::detect());
    assert!(!Arc::ptr_eq(&other.placed[0].bvh, &whole.placed[0].bvh));

    let place = |n| Affine3A::from_translation(Vec3::X * n as f32);
    let many = (0..3000).map(|n| instance(n, &soup, None, place(n))).collect();
    assert_eq!(cache.update(&snapshot(many), Kernel::detect()).placed.len(), 3000);
}

/// Rays that leave a surface do not meet it again, at any scale and position.
#[test]
fn surfaces_do_not_shade_themselves() {
    let ball = ball(16, 0.0);
    for (scale, place) in
        [(1.0, 0.0), (1e-3, 0.0), (1e3, 0.0), (1.0, 1e3), (0.01, 10.0), (100.0, 1e4)]
    {
        let world_from_object = Affine3A::from_scale_rotation_translation(
            Vec3::new(1.0, 0.7, -1.3) * scale,
            Quat::from_rotation_z(0.7),
            Vec3::new(place, -0.3 * place, 0.7 * place),
        );
        let instance = Instance {
            node: NodeId(0),
            copy: 0,
            still: true,
            mesh_id: MeshId(0),
            mesh: ball.clone(),
            deformation: None,
            world_from_object,
        };
        let snapshot = Arc::new(Snapshot {
            version: 0,
            time: 0.0,
            origin: Vec3::ZERO,
            instances: vec![instance],
            materials: Arc::new([]),
            lights: vec![],
            environment: Default::default(),
        });
        let world =
            World::new(snapshot, Default::default(), Kernel::detect(), &mut WorldCache::default());
        let center = world_from_object.transform_point3(Vec3::ZERO);
        for i in 0..3000 {
            let direction = sphere(random(8, i).truncate());
            // From outside, where the ball is convex, nothing lies ahead of a leaving ray.
            let from_outside = ray(center + direction * 4.0 * scale, -direction);
            let Some(hit) = closest(world.accel(), &from_outside, |_| true) else { continue };
            let Some(point) = world.point(&hit, from_outside.direction) else { continue };
            let point = point.place;
            let away = (point.normal + 0.99 * sphere(random(9, i).truncate())).normalize();
            // The ray does not ignore its own triangle, so only the offset protects.
            let leaving = ray(point.leave(away), away);
            assert!(!occluded(world.accel(), &leaving, |_| true), "{scale} {place} {i}");
            let moved = (point.leave(away) - point.position).length();
            assert!(
                moved < 3e-5 * (scale + place),
                "offset {moved} at scale {scale}, place {place}"
            );
        }
    }
}
