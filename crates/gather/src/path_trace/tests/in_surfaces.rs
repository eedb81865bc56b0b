//! Lamps that lie exactly in the plane of a ceiling or a wall must not be hidden by it.

use std::f32::consts::PI;

use glam::{Affine3A, Quat, Vec3};
use lumencast_scene::{LightKind, Material, PunctualLight};
use lumencast_testkit::scenes::{Stage, lambert};

use super::{BLACK, check, down, look};
use crate::accel::Kernel;
use crate::path_trace::integrator::Integrator;
use crate::path_trace::paths::{Look, Paths};
use crate::sampling::{Sampler, sphere};
use crate::surface::MaterialModel;
use crate::world::{World, WorldCache};

const INTENSITY: f32 = 20.0;
/// Number of rays in a scene.
const RAYS: u32 = 400;

/// A white floor at y = 0 and a black sheet through `at` with this unit normal.
fn floor_and_sheet(at: Vec3, normal: Vec3) -> Stage {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::ONE, BLACK));
    let black = stage.material(Material { double_sided: true, ..lambert(BLACK, BLACK) });
    let (u, v) = normal.any_orthonormal_pair();
    stage.quad(Vec3::new(-30.0, 0.0, 30.0), Vec3::X * 60.0, Vec3::NEG_Z * 60.0, white);
    stage.quad(at - 13.0 * u - 11.0 * v, 31.0 * u, 29.0 * v, black);
    stage
}

/// Points of the floor that rays from a little above them meet, and their radiance.
fn floor_seen(stage: &Stage, place: impl Fn(&mut Sampler) -> Vec3) -> Vec<(Vec3, f32)> {
    let (kernel, mut cache) = (Kernel::detect(), WorldCache::default());
    let world = World::new(stage.snapshot(), MaterialModel::Full, kernel, &mut cache);
    let points: Vec<Vec3> = (0..RAYS).map(|n| place(&mut Sampler::new(2, 1, n))).collect();
    let looks = points.iter().zip(0..).map(|(point, n)| Look {
        origin: point - 0.01 * down(),
        direction: down(),
        pdf: f32::INFINITY,
        sampler: Sampler::new(2, 2, n),
    });
    let mut integrator = Integrator::new(&world, Paths::new(1));
    let seen = integrator.radiance(looks).map(|seen| seen.radiance().x);
    points.iter().copied().zip(seen).collect()
}

/// Radiance of a white floor under a point light.
fn white_under(lamp: Vec3, point: Vec3) -> f32 {
    let to = lamp - point;
    INTENSITY / PI * to.normalize().y / to.length_squared()
}

fn lamp(kind: LightKind) -> PunctualLight {
    PunctualLight { kind, color: Vec3::ONE, intensity: INTENSITY, range: None }
}

/// Random points of the floor within 3 m of the point below `at`, along each axis.
fn below(at: Vec3) -> impl Fn(&mut Sampler) -> Vec3 {
    move |sampler| {
        let place = 6.0 * (sampler.square() - 0.5);
        Vec3::new(at.x + place.x, 0.0, at.z + place.y)
    }
}

/// Checks that the sheet does not darken points of the floor that see its plane at an angle.
#[track_caller]
fn lights_the_floor(stage: &mut Stage, kind: LightKind, at: Vec3, normal: Vec3) {
    stage.light(lamp(kind), at, Vec3::NEG_Y);
    let seen = floor_seen(stage, below(at));
    let at_an_angle = |point: Vec3| (at - point).normalize().dot(normal).abs() > 0.02;
    let seen: Vec<_> = seen.into_iter().filter(|(point, _)| at_an_angle(*point)).collect();
    assert!(seen.len() > RAYS as usize / 2);
    for (point, seen) in seen {
        let expected = white_under(at, point);
        let off = (seen - expected).abs();
        assert!(off <= 1e-3 * expected, "{kind:?} at {at}: {seen}, not {expected}, at {point}");
    }
}

/// Places that floating-point numbers hold exactly, and places that they do not.
fn places() -> impl Iterator<Item = Vec3> {
    let at = |n| {
        let mut sampler = Sampler::new(5, 0, n);
        let [x, z] = (8.0 * (sampler.square() - 0.5)).to_array();
        Vec3::new(x, 2.0 + 3.0 * sampler.number(), z)
    };
    [Vec3::new(0.0, 2.5, 0.0), Vec3::new(0.3, 2.7, -1.1)].into_iter().chain((0..20).map(at))
}

const POINT: LightKind = LightKind::Point { radius: 0.0 };

#[test]
fn a_lamp_in_the_plane_of_a_ceiling_lights_the_floor() {
    for at in places() {
        let spot = LightKind::Spot { inner: 1.55, outer: 1.56, radius: 0.0 };
        for kind in [POINT, spot] {
            lights_the_floor(&mut floor_and_sheet(at, Vec3::Y), kind, at, Vec3::Y);
        }
    }
}

#[test]
fn a_lamp_in_the_plane_of_a_wall_lights_the_floor() {
    for (at, n) in places().zip(0..) {
        let slanted = sphere(Sampler::new(7, 0, n).square());
        for normal in [Vec3::X, slanted] {
            lights_the_floor(&mut floor_and_sheet(at, normal), POINT, at, normal);
        }
    }
}

/// The plane of a sheet that is rotated and scaled into place is known only up to some roundings.
#[test]
fn a_lamp_in_a_ceiling_that_is_moved_into_its_place_lights_the_floor() {
    for (at, n) in places().zip(0..) {
        let snapshot = floor_and_sheet(Vec3::ZERO, Vec3::Y).snapshot();
        let [floor, sheet] = [0, 1].map(|n: usize| &snapshot.instances[n]);
        let turn = Quat::from_rotation_y(Sampler::new(8, 0, n).number());
        let place = Affine3A::from_scale_rotation_translation(Vec3::splat(1.7), turn, at);
        let mut moved = Stage::default();
        for material in snapshot.materials.iter() {
            moved.material(material.clone());
        }
        moved.instance(floor.mesh_id, floor.mesh.clone(), Affine3A::IDENTITY);
        moved.instance(sheet.mesh_id, sheet.mesh.clone(), place);
        lights_the_floor(&mut moved, POINT, at, Vec3::Y);
    }
}

/// A lamp a millimetre behind a sheet is hidden.
#[test]
fn a_lamp_behind_a_sheet_is_hidden() {
    let at = Vec3::new(0.3, 2.7, -1.1);
    let mut stage = floor_and_sheet(at, Vec3::Y);
    stage.light(lamp(POINT), at + 1e-3 * Vec3::Y, Vec3::NEG_Y);
    assert!(floor_seen(&stage, below(at)).iter().all(|(_, seen)| *seen == 0.0));
}

/// A sphere half sunk into a ceiling: the expected light is the sum over its visible points.
#[test]
fn a_sphere_half_sunk_into_a_ceiling() {
    let (at, radius) = (Vec3::new(0.3, 2.7, -1.1), 0.4f32);
    for point in [Vec3::new(0.3, 0.0, -1.1), Vec3::new(2.0, 0.0, 0.0), Vec3::new(-6.0, 0.0, 1.0)] {
        let mut stage = floor_and_sheet(at, Vec3::NEG_Y);
        stage.light(lamp(LightKind::Point { radius }), at, Vec3::NEG_Y);
        let radiance = INTENSITY / (PI * radius * radius);
        let n = 1 << 16;
        let area = 4.0 * PI * radius * radius / n as f32;
        let sent = |half: bool| {
            let of_point = |n| {
                let normal = sphere(Sampler::new(3, 0, n).square());
                let to = at + radius * normal - point;
                let d = to.normalize();
                let is_hidden = half && normal.y > 0.0;
                let facing = if is_hidden { 0.0 } else { normal.dot(-d).max(0.0) };
                f64::from(radiance * area * facing * d.y / to.length_squared() / PI)
            };
            (0..n).map(of_point).sum::<f64>() as f32
        };
        let (half, whole) = (Vec3::splat(sent(true)), Vec3::splat(sent(false)));
        let mean = look(&stage.snapshot(), point - 0.01 * down(), down(), Paths::new(1));
        if point.x == at.x {
            // From directly below nothing of it is hidden.
            check(mean, whole, 0.9 * whole);
        } else {
            check(mean, half, whole);
        }
    }
}
