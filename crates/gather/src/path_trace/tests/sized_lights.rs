//! Spherical lights and suns over a floor.

use std::f32::consts::PI;

use glam::Vec3;
use lumencast_scene::{LightKind, Material, PunctualLight};
use lumencast_testkit::scenes::{Stage, lambert};

use super::{BLACK, check, down, floor, look, look_down};
use crate::bsdf::{Bsdf, Substance, frame};
use crate::sampling::{Sampler, disc};

const WHITE: Vec3 = Vec3::ONE;

fn bulb(intensity: f32, radius: f32) -> PunctualLight {
    PunctualLight { kind: LightKind::Point { radius }, color: WHITE, intensity, range: None }
}

fn sun(illuminance: f32, angle: f32) -> PunctualLight {
    PunctualLight {
        kind: LightKind::Directional { angle },
        color: WHITE,
        intensity: illuminance,
        range: None,
    }
}

/// A white floor, and the point where the ray of [`look_down`] meets it.
fn white_floor() -> (Stage, Vec3) {
    let mut stage = Stage::default();
    let at = floor(&mut stage, lambert(WHITE, BLACK));
    (stage, at)
}

/// Radiance of a white floor under an illuminance.
fn white(illuminance: f32) -> Vec3 {
    Vec3::splat(illuminance / PI)
}

/// A black half plane over the receiver, whose edge is seen at this tangent of the angle from the
/// zenith.
fn half_plane(stage: &mut Stage, at: Vec3, tangent: f32) {
    let height = 1.5;
    let black = stage.material(Material { double_sided: true, ..lambert(BLACK, BLACK) });
    let corner = at + Vec3::new(height * tangent, height, 40.0);
    stage.quad(corner, Vec3::X * 40.0, Vec3::NEG_Z * 80.0, black);
}

/// A sphere wholly above the horizon gives I cos θ/d², whatever its radius.
#[test]
fn a_sphere_in_full_view_lights_as_its_centre_would() {
    let place = Vec3::new(1.0, 1.2, -0.6);
    for radius in [0.01, 0.5, 1.0] {
        let (mut stage, at) = white_floor();
        stage.light(bulb(20.0, radius), place, Vec3::X);
        let d = place - at;
        let expected = white(20.0 * d.normalize().y / d.length_squared());
        let from_its_surface = expected * (d.length() / (d.length() - radius)).powi(2);
        check(look_down(&stage, 1), expected, from_its_surface);
    }
}

/// A sphere with its centre on the horizon gives L (a − sin a cos a), by integration over rings
/// about the centre.
#[test]
fn a_sphere_half_below_the_horizon() {
    let (radius, distance, intensity) = (0.8f32, 1.2f32, 10.0);
    let (mut stage, at) = white_floor();
    stage.light(bulb(intensity, radius), at + distance * Vec3::X, Vec3::X);
    let sine = radius / distance;
    let a = sine.asin();
    let radiance = intensity / (PI * radius * radius);
    let expected = white(radiance * (a - sine * a.cos()));
    check(look_down(&stage, 1), expected, white(radiance * 2.0 / 3.0 * sine.powi(3)));
}

#[test]
fn a_sphere_half_hidden() {
    let (mut stage, at) = white_floor();
    stage.light(bulb(20.0, 0.4), at + 3.0 * Vec3::Y, Vec3::X);
    half_plane(&mut stage, at, 0.0);
    let whole = white(20.0 / 9.0);
    check(look_down(&stage, 1), 0.5 * whole, whole);
}

/// The penumbra of an edge: the visible part of the sun is a circle cut by a chord.
#[test]
fn the_penumbra_of_the_sun() {
    let angle = 0.04f32;
    for (chord, linear) in [(-1.2, 0.0), (-0.5, 0.25), (0.0, 0.6), (0.5, 0.75), (1.2, 0.9)] {
        let (mut stage, at) = white_floor();
        stage.light(sun(1000.0, angle), BLACK, Vec3::NEG_Y);
        half_plane(&mut stage, at, chord * (0.5 * angle).tan());
        let c = f32::clamp(-chord, -1.0, 1.0);
        let share = (c.acos() - c * (1.0 - c * c).sqrt()) / PI;
        let mean = look_down(&stage, 1);
        if share == 0.0 {
            assert_eq!(mean.0, BLACK);
        } else {
            check(mean, white(1000.0 * share), white(1000.0 * linear));
        }
    }
}

/// A receiver within the sphere receives as much as one on its surface.
#[test]
fn within_the_sphere() {
    let (mut stage, at) = white_floor();
    let (radius, height) = (1.5, 0.6);
    stage.light(bulb(9.0, radius), at + height * Vec3::Y, Vec3::X);
    check(look_down(&stage, 1), white(9.0 / radius.powi(2)), white(9.0 / height.powi(2)));
    let (mut centred, at) = white_floor();
    centred.light(bulb(9.0, radius), at, Vec3::X);
    assert!(look_down(&centred, 1).0.is_finite());
}

#[test]
fn a_small_sphere_is_a_point() {
    let place = Vec3::new(1.5, 2.0, -0.5);
    let glossy = Material { metallic: 1.0, roughness: 0.3, ..Material::default() };
    for material in [lambert(WHITE, BLACK), glossy] {
        let lit_by = |light: PunctualLight| {
            let mut stage = Stage::default();
            floor(&mut stage, material.clone());
            stage.light(light, place, -place);
            look_down(&stage, 1).0
        };
        let close = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 1e-3 * b.max_element();
        for (small, large) in [(1e-3, 1.9), (1e-9, 1.9), (1e-30, 1.9)] {
            let point = lit_by(bulb(20.0, 0.0));
            assert!(close(lit_by(bulb(20.0, small)), point), "{small}");
            let parallel = lit_by(sun(20.0, 0.0));
            assert!(close(lit_by(sun(20.0, small)), parallel), "{small}");
            if material.metallic > 0.0 {
                assert!(!close(lit_by(bulb(20.0, large)), point), "too coarse a check");
            }
        }
    }
}

/// A mirror shows an even disc. A camera that looks at the light itself sees nothing.
#[test]
fn a_mirror_shows_the_disc() {
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
    let mirrored = down() * Vec3::new(1.0, -1.0, 1.0);
    // They are so large that all but 10⁻⁵ of the lobe lies within the disc.
    let (radius, angle) = (1.2f32, 1.0f32);
    let of_sphere = 20.0 / (PI * radius.powi(2));
    let of_sun = 50.0 / (PI * (0.5 * angle).sin().powi(2));
    for (light, radiance) in [(bulb(20.0, radius), of_sphere), (sun(50.0, angle), of_sun)] {
        let mut stage = Stage::default();
        let at = floor(&mut stage, mirror.clone());
        stage.light(light, at + 2.5 * mirrored, -mirrored);
        check(look_down(&stage, 1), Vec3::splat(radiance), Vec3::splat(0.98 * radiance));
        let (mean, error) = look_down(&stage, 1);
        assert!(error.max_element() < 1e-3 * mean.max_element(), "{mean} ± {error}");
        let (away, _) = look(&stage.snapshot(), at + 0.1 * Vec3::Y, mirrored, super::Paths::new(1));
        assert_eq!(away, BLACK);
    }
}

/// Highlights of a glossy floor agree with quadrature over the disc.
#[test]
fn highlights_of_a_glossy_floor() {
    let (intensity, radius, distance) = (20.0f32, 0.4f32, 2.0f32);
    let mirrored = down() * Vec3::new(1.0, -1.0, 1.0);
    for (roughness, off) in [(0.1, 0.0), (0.1, 0.35), (0.3, 0.2), (0.6, 0.0)] {
        let mut stage = Stage::default();
        let glossy = Material { metallic: 1.0, roughness, ..Material::default() };
        let at = floor(&mut stage, glossy);
        let to = (mirrored + off * Vec3::X).normalize();
        stage.light(bulb(intensity, radius), at + distance * to, Vec3::X);
        let bsdf = Bsdf::new(&Substance {
            base_color: WHITE,
            metallic: 1.0,
            roughness,
            transmission: 0.0,
            ior: 1.5,
            specular: 1.0,
            specular_color: WHITE,
        });
        let up = frame(Vec3::Y).transpose();
        let sine = radius / distance;
        let n = 1 << 16;
        // Points are uniform on the disc as it appears: dω = sin² a dA/(π cos).
        let share = |i: u32| {
            let p = sine * disc(Sampler::new(8, 0, i).square());
            let cos = (1.0 - p.length_squared()).sqrt();
            bsdf.eval(up * -down(), up * (frame(to) * p.extend(cos))).value / cos
        };
        let mean = (0..n).map(share).sum::<Vec3>() / n as f32;
        let expected = mean * intensity / (distance * distance);
        check(look_down(&stage, 1), expected, 1.1 * expected);
    }
}

/// With more lights than candidates, points among them, the result is the sum over the lights.
#[test]
fn many_lights() {
    let (mut stage, at) = white_floor();
    let mut expected = BLACK;
    for i in 0..40 {
        let mut s = Sampler::new(6, 0, i);
        let place =
            at + Vec3::new(4.0 * s.number() - 2.0, 1.0 + s.number(), 4.0 * s.number() - 2.0);
        let radius = if i % 4 == 0 { 0.0 } else { s.number() };
        stage.light(bulb(5.0, radius), place, Vec3::X);
        let d = place - at;
        expected += white(5.0 * d.normalize().y / d.length_squared());
    }
    check(look_down(&stage, 1), expected, 1.03 * expected);
}

/// Light of a lamp scattered once is direct light, whichever strategy found it.
#[test]
fn found_either_way_it_is_direct_light() {
    use super::{Integrator, Kernel, Look, MaterialModel, Paths, World, WorldCache};
    let mut stage = Stage::default();
    let at = floor(&mut stage, Material { metallic: 1.0, roughness: 0.2, ..Material::default() });
    let mirrored = down() * Vec3::new(1.0, -1.0, 1.0);
    stage.light(bulb(20.0, 0.5), at + 2.0 * mirrored, Vec3::X);
    let model = MaterialModel::Full;
    let world = World::new(stage.snapshot(), model, Kernel::detect(), &mut WorldCache::default());
    let paths = Paths::new(3);
    let mut integrator = Integrator::new(&world, paths);
    let look = |i| Look {
        origin: Vec3::Y,
        direction: down(),
        pdf: f32::INFINITY,
        sampler: Sampler::new(4, 0, i),
    };
    for seen in integrator.radiance((0..256).map(look)) {
        assert!(seen.direct.x > 0.0 && seen.indirect == BLACK, "{seen:?}");
    }
}
