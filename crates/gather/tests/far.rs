//! Rooms far from the world's origin, as in map coordinates, are as tight and as bright as near it.

use std::sync::Arc;

use glam::{DVec3, Quat, UVec2, UVec3, Vec3};
use lumencast_gather::path_trace::{CpuPathTracer, Levels, Options};
use lumencast_gather::reference::{
    Film, PictureSettings, ProbeEstimate, ProbeSettings, Renderer, probe_sh,
};
use lumencast_gather::{Gather, Job, Receiver, Shading, Sums};
use lumencast_light::{FieldId, Grid, Light, Order, ProbeVolume};
use lumencast_scene::View;
use lumencast_testkit::rooms::{Placed, Rooms};

/// Rooms at several distances, placed in every way that keeps their walls where they belong: vertices
/// of 32 bits do not, from where they are as far apart as walls are thick.
fn far() -> Vec<Rooms> {
    let mut rooms = Vec::new();
    for distance in [1e5, 1e6, 4e6] {
        for placed in [Placed::Flat, Placed::Nested, Placed::Baked] {
            if placed == Placed::Baked && distance > 3e5 {
                continue;
            }
            let at = DVec3::new(distance + 0.37, 0.013 * distance, 0.71 - 1.3 * distance);
            rooms.push(Rooms { at, placed, emission: 0.0 });
        }
    }
    rooms
}

const LIT: [Vec3; 3] =
    [Vec3::new(-2.0, 1.2, 0.0), Vec3::new(-0.7, 0.6, 1.2), Vec3::new(-3.3, 2.4, -1.3)];
const DARK: [Vec3; 3] =
    [Vec3::new(2.0, 1.2, 0.0), Vec3::new(0.7, 0.6, 1.2), Vec3::new(3.3, 2.4, -1.3)];

fn probes(rooms: &Rooms, points: &[Vec3]) -> Vec<ProbeEstimate> {
    let settings = ProbeSettings { bounces: 3, samples: 512, lattices: 16, ..Default::default() };
    probe_sh(&rooms.scene().snapshot(), points, &settings).expect("threads")
}

/// What is found at points of the world, and beside it of the same points of the rooms near the origin.
fn beside<T>(
    rooms: &Rooms,
    points: &[Vec3],
    find: impl Fn(&Rooms, &[Vec3]) -> Vec<T>,
) -> Vec<(T, T)> {
    let world: Vec<Vec3> = points.iter().map(|point| rooms.world(*point)).collect();
    let local: Vec<Vec3> = world.iter().map(|point| rooms.local(*point)).collect();
    find(rooms, &world).into_iter().zip(find(&rooms.near(), &local)).collect()
}

#[test]
fn probes_see_what_they_see_near_the_origin() {
    for rooms in far() {
        for (far, near) in beside(&rooms, &LIT, probes) {
            let errors = far.standard_error.iter().zip(&near.standard_error);
            for (k, ((a, b), (e, f))) in far.sh.iter().zip(&near.sh).zip(errors).enumerate() {
                // Baked walls are off by millimetres.
                let slack = if rooms.placed == Placed::Baked { 0.02 } else { 1e-3 };
                let tolerance = 5.0 * (*e + *f) + slack * near.sh[0];
                assert!((a - b).abs().cmple(tolerance).all(), "{rooms:?} {k}: {a} {b}");
            }
            assert!(near.sh[0].x > 1.0 && far.dark_back_fraction == 0.0);
        }
        for (far, _) in beside(&rooms, &DARK, probes) {
            assert!(far.sh.iter().all(|c| *c == Vec3::ZERO), "{rooms:?}: {:?}", far.sh);
            assert_eq!(far.dark_back_fraction, 0.0);
        }
    }
}

/// Closed rooms that shine: L (1 + ρ + ρ² + ρ³) from everywhere.
#[test]
fn white_furnaces() {
    for rooms in far() {
        let rooms = Rooms { emission: 200.0, ..rooms };
        let radiance = 200.0 * (0..=3).map(|k| Rooms::ALBEDO.powi(k)).sum::<f32>();
        for (far, _) in beside(&rooms, &DARK, probes) {
            let expected = 2.0 * std::f32::consts::PI.sqrt() * radiance;
            let (off, error) = ((far.sh[0] - expected).abs(), far.standard_error[0]);
            let is_near = off.cmple(5.0 * error + 1e-3 * expected).all();
            assert!(is_near, "{rooms:?}: {} ± {error}, not {expected}", far.sh[0]);
            assert!(error.max_element() < 2e-3 * expected, "too coarse a check: {error}");
        }
    }
}

fn picture(rooms: &Rooms, points: &[Vec3]) -> Vec<Vec<Vec3>> {
    let size = UVec2::new(48, 32);
    let settings = PictureSettings { size, bounces: 1, ..PictureSettings::default() };
    let snapshot = rooms.scene().snapshot();
    let of = |eyes: &[Vec3]| {
        let view = View::look_at(eyes[0], eyes[1], 1.2).expect("two points");
        let renderer = Renderer::new(&snapshot, view, settings).expect("threads");
        let mut film = Film::new(size, 16);
        while film.samples() < 16 {
            renderer.pass(&mut film, 16, &|_| true).expect("a pass");
        }
        film.picture()
    };
    points.chunks(2).map(of).collect()
}

#[test]
fn pictures_show_what_they_show_near_the_origin() {
    let towards = Vec3::new(0.4, -0.5, -1.0);
    for rooms in far() {
        // Far targets, so that rounding turns views as little as it moves them.
        let eyes = [LIT[0], LIT[0] + 1e4 * towards, DARK[0], DARK[0] + 1e4 * towards];
        let found = beside(&rooms, &eyes, picture);
        let mean = |p: &[Vec3]| p.iter().map(|v| v.x).sum::<f32>() / p.len() as f32;
        let (far, near) = &found[0];
        let off: f32 = far.iter().zip(near).map(|(a, b)| (a.x - b.x).abs()).sum();
        let off = off / far.len() as f32;
        assert!(off < 0.02 * mean(near), "{rooms:?}: {off} of {}", mean(near));
        assert!(found[1].0.iter().all(|v| *v == Vec3::ZERO), "{rooms:?}: light in the dark");
    }
}

fn gathered(
    rooms: &Rooms,
    receivers: Vec<Receiver>,
    samples: u32,
    job: impl FnOnce(Job) -> Job,
) -> Sums {
    let options = Options { levels: Levels::Two, ..Options::default() };
    let mut tracer = CpuPathTracer::new(options).expect("threads");
    let ticket = tracer.submit(job(Job::new(rooms.scene().snapshot(), receivers, samples)));
    tracer.wait(ticket).expect("a result").sums
}

/// Irradiance of the floor, to which points of the world belong to the last digit that they have.
fn floor(rooms: &Rooms, points: &[Vec3]) -> Vec<Vec3> {
    let footprint = [Vec3::X * 0.2, Vec3::Z * 0.2];
    let lumel = |point: &Vec3| {
        let position = Vec3 { y: rooms.at.y as f32, ..*point };
        Receiver::Lumel { position, normal: Vec3::Y, footprint, shading: Shading::Own }
    };
    let sums = gathered(rooms, points.iter().map(lumel).collect(), 2048, |job| job);
    sums.iter().map(|sums| sums.mean().next().expect("irradiance")).collect()
}

#[test]
fn lumels_receive_what_they_receive_near_the_origin() {
    let on_floor = |points: [Vec3; 3]| points.map(|p| Vec3::new(p.x, 0.0, p.z));
    for rooms in far() {
        for (far, near) in beside(&rooms, &on_floor(LIT), floor) {
            assert!((far - near).abs().max_element() < 0.1 * near.x, "{rooms:?}: {far} {near}");
        }
        for (far, _) in beside(&rooms, &on_floor(DARK), floor) {
            assert_eq!(far, Vec3::ZERO, "{rooms:?}");
        }
    }
}

/// Two volumes whose light differs, at places in the world of points of rooms.
fn light(world: impl Fn(Vec3) -> Vec3) -> Light {
    let volume = |id, x: f32, radiance: f32| {
        let grid = Grid {
            center: world(Vec3::new(x, 1.5, 0.0)),
            rotation: Quat::IDENTITY,
            size: Vec3::new(3.9, 3.1, 4.1),
            resolution: UVec3::splat(3),
        };
        let mut volume = ProbeVolume::dark(FieldId(id), grid, Order::L1);
        let c0 = 2.0 * std::f32::consts::PI.sqrt() * radiance;
        (0..grid.probe_count()).for_each(|probe| volume.probe_mut(probe)[0] = Vec3::splat(c0));
        volume
    };
    Light::new(vec![volume(0, -2.0, 40.0), volume(1, 2.0, 3.0)])
}

/// What probes look at is told, and light of before is read, where it is in the world.
#[test]
fn surfaces_and_fields_are_of_the_world() {
    for rooms in far() {
        let find = |these: &Rooms, points: &[Vec3]| {
            let receivers = points.iter().copied().map(Receiver::probe).collect();
            let is_far = these.at != DVec3::ZERO;
            let place = |p| if is_far { rooms.world(p) } else { rooms.local(rooms.world(p)) };
            let previous = Some(Arc::new(light(place)));
            let job = |job| Job { previous, bounces: 0, surfaces: true, ..job };
            let sums = gathered(these, receivers, 512, job);
            let found = sums.iter().map(|sums| {
                let c0 = sums.mean().next().expect("a coefficient").x;
                (c0, sums.surfaces.to_vec())
            });
            found.collect::<Vec<_>>()
        };
        let digits = f32::EPSILON * rooms.at.abs().as_vec3() + 0.01;
        // Fields are read at points of the world, to the last digit that those have.
        let slack = 0.02 + 0.1 * digits.max_element();
        for (far, near) in beside(&rooms, &[LIT[0], DARK[0]], find) {
            let ((a, surfaces), (b, _)) = (far, near);
            assert!((a - b).abs() < slack * b, "{rooms:?}: {a} {b}");
            for point in surfaces.iter().map(|point| point.expect("the room is closed")) {
                let local = rooms.local(point.position);
                let walls = [
                    (local.x.abs() - 0.05).abs() - digits.x,
                    (local.x.abs() - 4.0).abs() - digits.x,
                    local.y.abs() - digits.y,
                    (local.y - 3.0).abs() - digits.y,
                    (local.z.abs() - 2.0).abs() - digits.z,
                ];
                assert!(walls.into_iter().any(|off| off < 0.0), "{rooms:?}: {local}");
            }
        }
        let [lit, dark] = [LIT[0], DARK[0]].map(|at| rooms.world(at));
        let [lit, dark] = [lit, dark].map(|at| find(&rooms, &[at])[0].0);
        assert!(lit > 5.0 * dark, "the check has no teeth: {lit} {dark}");
    }
}
