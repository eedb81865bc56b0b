//! Light that is known in closed form. Every check is also given a wrong answer, such as a physicist
//! might write who forgot a cosine, and has to refuse it.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{UVec2, Vec3};
use lumencast_gather::reference::{
    Film, PictureSettings, ProbeEstimate, ProbeSettings, Renderer, probe_sh,
};
use lumencast_light::{Order, sh};
use lumencast_scene::{
    AlphaMode, Environment, LightKind, Material, Projection, PunctualLight, Snapshot, View,
};
use lumencast_testkit::scenes::{Stage, lambert};
use lumencast_testkit::vectors::GgxAlbedo;

const BLACK: Vec3 = Vec3::ZERO;
/// ∫ Y₀₀ dω = 2√π.
const C0: f32 = 3.544_907_7;
const Y0: f32 = 0.282_094_8;
const Y1: f32 = 0.488_602_5;

fn probe(scene: &Arc<Snapshot>, at: Vec3, bounces: u32) -> ProbeEstimate {
    let settings = ProbeSettings { bounces, samples: 1024, lattices: 32, ..Default::default() };
    probe_sh(scene, &[at], &settings).unwrap().remove(0)
}

/// Whether all coefficients lie within five standard errors of what is expected; `slack` is allowed
/// beside, relative to the largest, for rounding and for spheres that are polyhedra.
fn agrees(estimate: &ProbeEstimate, expected: &[Vec3], slack: f32) -> bool {
    let scale = expected.iter().fold(0.0, |m: f32, e| m.max(e.abs().max_element()));
    estimate.sh.iter().zip(&estimate.standard_error).zip(expected).all(
        |((value, error), expected)| {
            (value - expected).abs().cmple(5.0 * *error + slack * scale).all()
        },
    )
}

#[track_caller]
fn check(estimate: &ProbeEstimate, expected: &[Vec3], wrong: &[Vec3], slack: f32) {
    assert!(agrees(estimate, expected, slack), "{:#?}\nexpected {expected:#?}", estimate);
    assert!(!agrees(estimate, wrong, slack), "this check cannot fail: it takes {wrong:?} too");
}

/// Coefficients of the same radiance from everywhere.
fn uniform(radiance: Vec3) -> Vec<Vec3> {
    let mut c = vec![BLACK; 9];
    c[0] = C0 * radiance;
    c
}

/// Coefficients of light that is symmetric about `axis`: `moments[l]` is ∫ L Y_l0 dω with the axis
/// as pole.
fn zonal(axis: Vec3, moments: [Vec3; 3]) -> Vec<Vec3> {
    let y = sh::basis(Order::L2, axis);
    let pole = sh::basis(Order::L2, Vec3::Z);
    let at_pole = [pole[0], pole[2], pole[6]];
    (0..9)
        .map(|k| {
            let l = [0, 1, 1, 1, 2, 2, 2, 2, 2][k];
            moments[l] * y[k] / at_pole[l]
        })
        .collect()
}

fn point_light(intensity: f32) -> PunctualLight {
    PunctualLight {
        kind: LightKind::Point { radius: 0.0 },
        color: Vec3::ONE,
        intensity,
        range: None,
    }
}

#[test]
fn constant_environment() {
    let radiance = Vec3::new(1.0, 2.0, 0.5);
    let mut stage = Stage::default();
    stage.environment(Environment::Constant { radiance });
    let e = probe(&stage.snapshot(), Vec3::ZERO, 3);
    check(&e, &uniform(radiance), &uniform(1.01 * radiance), 1e-5);
}

/// A gradient linear in sin(elevation) is bands 0 and 1 where horizon is the mean of the ends.
#[test]
fn gradient_sky() {
    let (zenith, ground) = (Vec3::new(3.0, 2.0, 1.0), Vec3::new(1.0, 0.0, 1.0));
    let (mean, half) = (0.5 * (zenith + ground), 0.5 * (zenith - ground));
    let mut stage = Stage::default();
    stage.environment(Environment::Sky { zenith, horizon: mean, ground });
    let mut expected = uniform(mean);
    expected[1] = half * Y1 * 4.0 * PI / 3.0;
    let mut upside_down = expected.clone();
    upside_down[1] *= -1.0;
    check(&probe(&stage.snapshot(), Vec3::ZERO, 0), &expected, &upside_down, 1e-4);
}

/// Closed room that emits L and reflects ρ: L·(1 + ρ + … + ρᴮ).
#[test]
fn furnace() {
    let (albedo, emission) = (Vec3::new(0.5, 0.8, 0.2), Vec3::new(1.0, 2.0, 3.0));
    let mut stage = Stage::default();
    let wall = stage.material(lambert(albedo, emission));
    stage.room(Vec3::ZERO, Vec3::new(2.0, 3.0, 4.0), wall);
    let scene = stage.snapshot();
    for bounces in [0, 1, 2, 5] {
        let sum = |n: u32| (0..=n).map(|k| albedo.powf(k as f32)).sum::<Vec3>() * emission;
        let e = probe(&scene, Vec3::new(0.3, -0.4, 0.5), bounces);
        check(&e, &uniform(sum(bounces)), &uniform(sum(bounces + 1)), 1e-4);
    }
}

/// The same room after very many bounces: L/(1 − ρ).
#[test]
fn closed_room_after_many_bounces() {
    let (albedo, emission) = (Vec3::new(0.5, 0.8, 0.2), Vec3::new(1.0, 2.0, 3.0));
    let mut stage = Stage::default();
    let wall = stage.material(lambert(albedo, emission));
    stage.room(Vec3::ZERO, Vec3::new(2.0, 3.0, 4.0), wall);
    let settings =
        ProbeSettings { bounces: 64, samples: 256, lattices: 16, ..ProbeSettings::default() };
    let at = Vec3::new(0.3, -0.4, 0.5);
    let e = probe_sh(&stage.snapshot(), &[at], &settings).unwrap().remove(0);
    let all = emission / (1.0 - albedo);
    check(&e, &uniform(all), &uniform(1.005 * all), 1e-4);
}

/// Integrating sphere with a lamp in its centre: every wall has ρI/πR², then ρ times that, …
#[test]
fn white_sphere_with_a_lamp() {
    let (albedo, radius, intensity) = (0.7, 2.0, 100.0);
    let mut stage = Stage::default();
    let wall = stage.material(lambert(Vec3::splat(albedo), BLACK));
    stage.sphere(Vec3::ZERO, -radius, 64, wall);
    stage.light(point_light(intensity), Vec3::ZERO, Vec3::X);
    let scene = stage.snapshot();
    let first = albedo * intensity / (PI * radius * radius);
    for bounces in [1, 3] {
        let series = |b: i32| (0..b).map(|k| albedo.powi(k)).sum::<f32>();
        let e = probe(&scene, Vec3::new(0.5, 0.2, 0.0), bounces);
        let expected = uniform(Vec3::splat(first * series(bounces as i32)));
        let wrong = uniform(Vec3::splat(first * series(bounces as i32) / albedo));
        check(&e, &expected, &wrong, 4e-3);
    }
    let none = probe(&scene, Vec3::new(0.5, 0.2, 0.0), 0);
    assert_eq!(none.sh[0], BLACK, "a punctual light is not seen itself");
}

/// A lamp over a plane, seen from the lamp's place: L(θ) = ρI cos³θ/πh². A sphere that is wholly
/// above the plane lights it as its centre would.
#[test]
fn point_light_over_a_plane() {
    for radius in [0.0, 0.6] {
        lamp_over_a_plane(
            PunctualLight { kind: LightKind::Point { radius }, ..point_light(50.0) },
            false,
        );
    }
}

/// A black ceiling in whose very plane the lamp lies does not hide it from the floor.
#[test]
fn lamp_in_the_plane_of_a_ceiling() {
    lamp_over_a_plane(point_light(50.0), true);
    let spot = LightKind::Spot { inner: 1.570, outer: 1.5705, radius: 0.0 };
    lamp_over_a_plane(PunctualLight { kind: spot, ..point_light(50.0) }, true);
}

fn lamp_over_a_plane(lamp: PunctualLight, ceiling: bool) {
    let (albedo, height) = (0.6, 0.7);
    let mut stage = Stage::default();
    let floor = stage.material(lambert(Vec3::splat(albedo), BLACK));
    let side = 4000.0;
    stage.quad(Vec3::new(-side, 0.0, side) * 0.5, Vec3::X * side, Vec3::NEG_Z * side, floor);
    let at = Vec3::new(3.0, height, -2.0);
    if ceiling {
        let black = stage.material(lambert(BLACK, BLACK));
        let corner = at - Vec3::new(30.0, 0.0, 20.0);
        stage.quad(corner, Vec3::X * 60.0, Vec3::Z * 40.0, black);
    }
    stage.light(lamp, at, Vec3::NEG_Y);
    let peak = albedo * lamp.intensity / (PI * height * height);
    // ∫ cosᵏθ cosⁿθ dω = 2π/(n + k + 1) over the hemisphere.
    let moments = |n: f32| {
        let m = |k: f32| 2.0 * PI / (n + k + 1.0);
        [Y0 * m(0.0), Y1 * m(1.0), 0.315_391_57 * (3.0 * m(2.0) - m(0.0))]
            .map(|x| Vec3::splat(x * peak))
    };
    // A probe in the ceiling's plane would see the ceiling.
    let below = if ceiling { 1e-4 * Vec3::Y } else { BLACK };
    let e = probe(&stage.snapshot(), at - below, 1);
    check(&e, &zonal(Vec3::NEG_Y, moments(3.0)), &zonal(Vec3::NEG_Y, moments(2.0)), 1e-3);
}

/// A wide floor under a slanting sun, and the cosine at which it is lit.
fn sunlit_floor(albedo: Vec3, illuminance: f32) -> (Stage, f32) {
    let mut stage = Stage::default();
    let floor = stage.material(lambert(albedo, BLACK));
    stage.quad(Vec3::new(-1e4, 0.0, 1e4), Vec3::X * 2e4, Vec3::NEG_Z * 2e4, floor);
    let sun = PunctualLight {
        kind: LightKind::Directional { angle: 0.0 },
        color: Vec3::ONE,
        intensity: illuminance,
        range: None,
    };
    stage.light(sun, Vec3::ZERO, Vec3::new(1.0, -1.0, 0.5));
    (stage, 1.0 / (1.0f32 + 1.0 + 0.25).sqrt())
}

/// The sun on a plane: ρE cos θ/π from the whole lower half. From starlight to full sun.
#[test]
fn sun_on_a_plane() {
    for illuminance in [1e-3, 1.0, 1e5] {
        let albedo = Vec3::new(0.9, 0.5, 0.1);
        let (stage, cos) = sunlit_floor(albedo, illuminance);
        let moments = |cos: f32| {
            let radiance = albedo * illuminance * cos / PI;
            [2.0 * PI * Y0 * radiance, PI * Y1 * radiance, BLACK]
        };
        let e = probe(&stage.snapshot(), Vec3::new(0.0, 1.0, 0.0), 1);
        check(&e, &zonal(Vec3::NEG_Y, moments(cos)), &zonal(Vec3::NEG_Y, moments(1.0)), 2e-3);
    }
}

/// Sun and sky: the upper half shows the sky, the lower a plane that both light.
#[test]
fn sun_and_sky_on_a_plane() {
    let (albedo, sky, illuminance) = (Vec3::new(0.9, 0.5, 0.1), Vec3::new(1.0, 2.0, 4.0), 30.0);
    let (mut stage, cos) = sunlit_floor(albedo, illuminance);
    stage.environment(Environment::Constant { radiance: sky });
    let of = |from_sky: f32| {
        let floor = albedo * (illuminance * cos / PI + from_sky * sky);
        zonal(Vec3::Y, [2.0 * PI * Y0 * (sky + floor), PI * Y1 * (sky - floor), BLACK])
    };
    let e = probe(&stage.snapshot(), Vec3::new(0.0, 1.0, 0.0), 1);
    // A hemisphere of radiance L gives πL, not 2πL.
    check(&e, &of(1.0), &of(2.0), 2e-3);
}

/// A rectangle of light: c₀ = Y₀₀ L Ω; from behind it is dark unless both sides shine.
#[test]
fn quad_light_seen_directly() {
    let emission = Vec3::new(10.0, 5.0, 1.0);
    let (a, b, d) = (0.8f32, 0.5f32, 1.3f32);
    for double_sided in [false, true] {
        let mut stage = Stage::default();
        let lamp = stage.material(Material { double_sided, ..lambert(BLACK, emission) });
        stage.quad(Vec3::new(-a, 0.0, -b), Vec3::X * 2.0 * a, Vec3::Z * 2.0 * b, lamp);
        let scene = stage.snapshot();
        let omega = 4.0 * (a * b / (d * (a * a + b * b + d * d).sqrt())).atan();
        let cos_free = 4.0 * a * b / (d * d);
        let below = probe(&scene, Vec3::new(0.0, -d, 0.0), 0);
        let only_c0 = |e: &ProbeEstimate| ProbeEstimate {
            sh: vec![e.sh[0]],
            standard_error: vec![e.standard_error[0]],
            ..e.clone()
        };
        check(&only_c0(&below), &[Y0 * omega * emission], &[Y0 * cos_free * emission], 1e-4);
        let above = probe(&scene, Vec3::new(0.0, d, 0.0), 0);
        if double_sided {
            check(&only_c0(&above), &[Y0 * omega * emission], &[BLACK], 1e-4);
        } else {
            assert_eq!(above.sh, vec![BLACK; 9]);
            assert!(above.dark_back_fraction > 0.0);
        }
    }
}

/// A ball of light: a cap of half-angle σ, whose moments are 2π ∫ P_l over its cosines.
#[test]
fn sphere_light() {
    let (radius, distance, emission) = (1.0f32, 2.5f32, Vec3::splat(4.0));
    let axis = Vec3::new(2.0, -1.0, 0.5).normalize();
    let mut stage = Stage::default();
    let lamp = stage.material(lambert(BLACK, emission));
    stage.sphere(distance * axis, radius, 96, lamp);
    let e = probe(&stage.snapshot(), Vec3::ZERO, 0);
    let moments = |distance: f32| {
        let c = (1.0 - (radius / distance).powi(2)).sqrt();
        let tau = 2.0 * PI;
        [Y0 * (1.0 - c), Y1 * (1.0 - c * c) / 2.0, 0.315_391_57 * (c - c * c * c)]
            .map(|x| tau * x * emission)
    };
    check(&e, &zonal(axis, moments(distance)), &zonal(axis, moments(1.02 * distance)), 2e-3);
}

/// Backs of single-sided surfaces block light and send none.
#[test]
fn backs_are_black() {
    let mut stage = Stage::default();
    let shell = stage.material(lambert(Vec3::ONE, Vec3::ONE));
    stage.sphere(Vec3::ZERO, 1.0, 16, shell);
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    let inside = probe(&stage.snapshot(), Vec3::ZERO, 3);
    assert_eq!(inside.sh, vec![BLACK; 9]);
    assert_eq!(inside.dark_back_fraction, 1.0);
    let outside = probe(&stage.snapshot(), Vec3::new(0.0, 3.0, 0.0), 0);
    assert!(outside.sh[0].min_element() > 0.0 && outside.dark_back_fraction == 0.0);
}

/// Covered with probability alpha: black walls of alpha ¼ let ¾ of the light in.
#[test]
fn alpha_lets_light_through() {
    let environment = Environment::Constant { radiance: Vec3::ONE };
    for (alpha_mode, alpha, passes) in [
        (AlphaMode::Blend, 0.25, 0.75),
        (AlphaMode::Mask(0.5), 0.4, 1.0),
        (AlphaMode::Mask(0.5), 0.6, 0.0),
        (AlphaMode::Opaque, 0.25, 0.0),
    ] {
        let mut stage = Stage::default();
        let black =
            Material { base_color: BLACK.extend(alpha), alpha_mode, ..lambert(BLACK, BLACK) };
        let black = stage.material(black);
        stage.room(Vec3::ZERO, Vec3::ONE, black).environment(environment.clone());
        let e = probe(&stage.snapshot(), Vec3::ZERO, 2);
        let wrong = if passes == 0.75 { 0.77 } else { 1.0 - passes };
        check(&e, &uniform(Vec3::splat(passes)), &uniform(Vec3::splat(wrong)), 1e-5);
    }
}

/// A white ball in a white sky cannot be seen: every bounce adds what the sky lacks.
#[test]
fn white_ball_in_a_white_sky() {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::ONE, BLACK));
    stage.sphere(Vec3::new(0.0, 1.5, 0.0), 1.0, 64, white);
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    let e = probe(&stage.snapshot(), Vec3::ZERO, 1);
    check(&e, &uniform(Vec3::ONE), &probe(&stage.snapshot(), Vec3::ZERO, 0).sh, 1e-3);
}

#[test]
fn nothing_gives_nothing() {
    let scene = Stage::default().snapshot();
    assert_eq!(probe(&scene, Vec3::ZERO, 3).sh, vec![BLACK; 9]);
}

/// A floor in a sky of radiance 1 shows its directional albedo: 1 for Lambert and for smooth
/// surfaces, and for rough metal that of single-scatter GGX (`vectors/ggx_albedo.json`).
#[test]
fn floors_in_a_furnace() {
    let table = GgxAlbedo::load();
    let gltf = |metallic, roughness| Material { metallic, roughness, ..Material::default() };
    let mut floors = vec![
        (lambert(Vec3::ONE, BLACK), 0.6, 1.0),
        (gltf(1.0, 0.0), 0.6, 1.0),
        (gltf(0.0, 0.0), 0.3, 1.0),
        (Material { transmission: 1.0, ..gltf(0.0, 0.0) }, 0.3, 1.0),
    ];
    for (i, &roughness) in table.roughness.iter().enumerate() {
        for (j, &cos) in table.cos.iter().enumerate().filter(|(_, cos)| **cos < 1.0) {
            let albedo = table.by_f0[i][j] + table.by_f90[i][j];
            floors.push((gltf(1.0, roughness), cos, albedo as f32));
        }
    }
    let settings = PictureSettings { size: UVec2::splat(16), bounces: 1, ..Default::default() };
    for (material, cos, expected) in floors {
        let name = format!("metallic {}, roughness {}", material.metallic, material.roughness);
        let mut stage = Stage::default();
        let floor = stage.material(material);
        stage.quad(Vec3::new(-1e3, 0.0, 1e3), Vec3::X * 2e3, Vec3::NEG_Z * 2e3, floor);
        stage.environment(Environment::Constant { radiance: Vec3::ONE });
        let away = Vec3::new((1.0 - cos * cos).sqrt(), cos, 0.0);
        let mut view = View::look_at(10.0 * away, Vec3::ZERO, 1.0).unwrap();
        view.projection =
            Projection::Orthographic { half_width: 0.1, half_height: 0.1, near: 0.0, far: 20.0 };
        let renderer = Renderer::new(&stage.snapshot(), view, settings).unwrap();
        let mut film = Film::new(settings.size, 64);
        while film.samples() < 64 {
            renderer.pass(&mut film, 64, &|_| true).unwrap();
        }
        let pixels = film.picture();
        let n = pixels.len() as f32;
        let mean = pixels.iter().map(|v| v.x).sum::<f32>() / n;
        let variance = pixels.iter().map(|v| (v.x - mean).powi(2)).sum::<f32>() / (n - 1.0);
        let tolerance = 5.0 * (variance / n).sqrt() + 1e-3 * expected;
        assert!((mean - expected).abs() < tolerance, "{name}, {cos}: {mean}, {expected}");
        assert!(tolerance < 0.03 * expected, "{name}, {cos}: too coarse a check: ± {tolerance}");
    }
}
