use std::f32::consts::PI;
use std::sync::Arc;

use glam::Vec3;
use lumencast_scene::{Environment, HdrImage, LightKind, NodeId, PlacedLight, PunctualLight};

use super::environment::{Sky, SkyCache};
use super::punctual::{Incident, Punctual, Source};
use crate::bsdf::{Bsdf, Scatter, Substance};
use crate::sampling::{Sampler, sphere};

fn placed(light: PunctualLight, position: Vec3, direction: Vec3) -> PlacedLight {
    PlacedLight { node: NodeId(0), light, position, direction: direction.normalize() }
}

/// The light that a point receives.
fn incident(placed: &PlacedLight, at: Vec3) -> Option<Incident> {
    Source::new(placed).incident(at)
}

fn point(intensity: f32, range: Option<f32>) -> PunctualLight {
    PunctualLight { kind: LightKind::Point { radius: 0.0 }, color: Vec3::ONE, intensity, range }
}

#[test]
fn inverse_square_and_range_window() {
    let at = |range, d: f32| {
        incident(&placed(point(100.0, range), Vec3::ZERO, Vec3::X), Vec3::X * d)
            .map_or(0.0, |i| i.irradiance.x)
    };
    assert_eq!(at(None, 5.0), 4.0);
    // KHR_lights_punctual: max(min(1 − (d/range)⁴, 1), 0)/d².
    assert!((at(Some(10.0), 5.0) - 4.0 * (1.0 - 0.0625)).abs() < 1e-6);
    assert_eq!(at(Some(10.0), 10.0), 0.0);
    assert_eq!(at(None, 0.0), 0.0);
}

#[test]
fn spot_falls_off_as_khr_lights_punctual_says() {
    let (inner, outer) = (0.2f32, 0.5f32);
    let spot =
        PunctualLight { kind: LightKind::Spot { inner, outer, radius: 0.0 }, ..point(1.0, None) };
    let spot = placed(spot, Vec3::ZERO, Vec3::NEG_Z);
    let at = |angle: f32| {
        incident(&spot, Vec3::new(angle.sin(), 0.0, -angle.cos())).map_or(0.0, |i| i.irradiance.x)
    };
    assert!((at(0.0) - 1.0).abs() < 1e-6 && (at(0.19) - 1.0).abs() < 1e-5);
    assert_eq!((at(0.51), at(PI)), (0.0, 0.0));
    let scale = 1.0 / (inner.cos() - outer.cos());
    let expected = (0.35f32.cos() * scale - outer.cos() * scale).powi(2);
    assert!((at(0.35) - expected).abs() < 1e-5, "{} {expected}", at(0.35));
}

/// The mean over choices is the sum over lights, whatever their number.
#[test]
fn choosing_among_lights_is_unbiased() {
    for count in [1, 3, 16, 40] {
        let lights: Vec<_> = (0..count)
            .map(|i| {
                let mut s = Sampler::new(3, 0, i);
                let position = 2.0 * sphere(s.square()) + Vec3::Y;
                let kind = match i % 3 {
                    0 => LightKind::Point { radius: 0.0 },
                    1 => LightKind::Spot { inner: 0.0, outer: 1.5, radius: 0.0 },
                    _ => LightKind::Directional { angle: 0.0 },
                };
                let color = Vec3::new(1.0, s.number(), s.number());
                let light =
                    PunctualLight { kind, color, intensity: 1.0 + 5.0 * s.number(), range: None };
                placed(light, position, -position)
            })
            .collect();
        let at = Vec3::new(0.1, -0.2, 0.3);
        let reflected = |l: Vec3| Vec3::splat(l.y.max(0.0));
        let scatter = |l: Vec3| Scatter { value: reflected(l), pdf: 0.0 };
        let expected: Vec3 = lights
            .iter()
            .filter_map(|l| incident(l, at))
            .map(|i| reflected(i.direction) * i.irradiance)
            .sum();
        let punctual = Punctual::new(&lights, 3.0);
        let n = 1 << 14;
        let (mut mean, mut squares) = (Vec3::ZERO, Vec3::ZERO);
        for i in 0..n {
            let mut s = Sampler::new(9, 1, i);
            let choice = s.number();
            let light = punctual
                .choose(at, choice, s.square(), scatter)
                .map_or(Vec3::ZERO, |chosen| chosen.light);
            mean += light / n as f32;
            squares += light * light / n as f32;
        }
        let error = ((squares - mean * mean).max(Vec3::ZERO) / n as f32).map(f32::sqrt);
        let tolerance = 5.0 * error + 1e-3 * expected;
        assert!(
            (mean - expected).abs().cmple(tolerance).all(),
            "{count}: {mean} {expected} ± {error}"
        );
    }
}

/// A dim environment picture with a small bright patch.
fn picture() -> Arc<HdrImage> {
    let (width, height) = (32, 16);
    let mut texels = vec![Vec3::splat(0.2); width * height];
    texels[3 * width + 20] = Vec3::splat(500.0);
    texels[10 * width + 5] = Vec3::new(0.0, 30.0, 0.0);
    Arc::new(HdrImage { width: width as u32, height: height as u32, texels })
}

fn sky(rotation: f32) -> Sky {
    let image = Some(picture());
    let environment = Environment::Image { uri: String::new(), intensity: 2.0, rotation, image };
    Sky::new(&environment, &mut SkyCache::default())
}

#[test]
fn picture_lies_as_documented() {
    // Texel (20, 3): u = 20.5/32, v = 3.5/16; atan2(x, −z) = 2π(u − ½), acos y = πv.
    let (azimuth, polar) = ((20.5 / 32.0 - 0.5) * 2.0 * PI, 3.5 / 16.0 * PI);
    let d = Vec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos());
    assert_eq!(sky(0.0).radiance(d), Vec3::splat(1000.0));
    let turned = glam::Quat::from_rotation_y(1.1) * d;
    assert_eq!(sky(1.1).radiance(turned), Vec3::splat(1000.0));
    assert_ne!(sky(-1.1).radiance(turned), Vec3::splat(1000.0));
    assert_eq!(sky(0.0).radiance(Vec3::NEG_Z), sky(0.0).radiance(Vec3::X));
}

#[test]
fn picture_samples_estimate_its_integral() {
    let sky = sky(0.4);
    let n = 1 << 16;
    let mut uniform = [0.0f64; 3];
    let mut chosen = [0.0f64; 2];
    for i in 0..n {
        let mut s = Sampler::new(2, 0, i);
        let d = sphere(s.square());
        let l = f64::from(sky.radiance(d).y);
        uniform[0] += 4.0 * std::f64::consts::PI * l / f64::from(n);
        uniform[1] += 4.0 * std::f64::consts::PI * f64::from(sky.pdf(d)) / f64::from(n);
        let (d, radiance, pdf) = sky.sample(s.square()).unwrap();
        assert!((sky.pdf(d) - pdf).abs() < 1e-3 * pdf, "{pdf} {}", sky.pdf(d));
        assert_eq!(radiance, sky.radiance(d));
        let ratio = f64::from(radiance.y / pdf);
        chosen[0] += ratio / f64::from(n);
        chosen[1] += ratio * ratio / f64::from(n);
    }
    assert!((uniform[1] - 1.0).abs() < 0.02, "density integrates to {}", uniform[1]);
    assert!((uniform[0] / chosen[0] - 1.0).abs() < 0.02, "{} {}", uniform[0], chosen[0]);
    // The table follows the light so well that the ratio's standard deviation is below its mean.
    // With uniform directions it would be about twenty times the mean.
    let spread = (chosen[1] / chosen[0].powi(2) - 1.0).sqrt();
    assert!(spread < 1.0, "{spread}");
}

/// Discs from a tenth of a second of arc to the whole half space.
#[test]
fn discs_keep_their_digits() {
    for half in [5e-7f32, 1e-4, 4.64e-3, 0.1, 1.0, PI / 2.0] {
        let kind = LightKind::Directional { angle: 2.0 * half };
        let sun = placed(
            PunctualLight { kind, ..point(1.0, None) },
            Vec3::ZERO,
            Vec3::new(-3.0, -2.0, 1.0),
        );
        let disc = incident(&sun, Vec3::ZERO).unwrap();
        let (mut inner, mut met, mut mean) = (0, 0, Vec3::ZERO);
        let n = 4096;
        for i in 0..n {
            let toward = disc.toward(Sampler::new(1, 0, i).square());
            // The cone of half the disc's height holds half of its solid angle.
            let off = disc.direction.cross(toward.direction).length();
            let height = disc.height();
            inner += u32::from(off * off < 0.5 * height * (2.0 - 0.5 * height));
            met += u32::from(disc.met(toward.direction) == Some(f32::INFINITY));
            mean += toward.irradiance * toward.direction.dot(disc.direction) / n as f32;
        }
        // One rounding of an f32 is a tenth of the smallest disc.
        let slack = if half < 1e-6 { n / 4 } else { n / 1000 };
        assert!(inner.abs_diff(n / 2) <= slack, "{half}: {inner}");
        assert!(met >= n - slack, "{half}: {met}");
        assert!((mean - Vec3::ONE).abs().max_element() < 1e-3, "{half}: {mean}");
        let radiance = 1.0 / (f64::from(half).sin().powi(2) * std::f64::consts::PI);
        assert!((f64::from(disc.radiance().x) / radiance - 1.0).abs() < 1e-5, "{half}");
    }
}

#[test]
fn a_ray_meets_a_sphere_where_it_is() {
    let kind = LightKind::Point { radius: 0.5 };
    let light =
        placed(PunctualLight { kind, ..point(1.0, None) }, Vec3::new(0.0, 3.0, 0.0), Vec3::X);
    let met = |at: Vec3, to: Vec3| incident(&light, at).unwrap().met((to - at).normalize());
    assert!((met(Vec3::ZERO, Vec3::Y).unwrap() - 2.5).abs() < 1e-6);
    let side = Vec3::new(0.3, 2.6, 0.0);
    assert!((met(Vec3::ZERO, side).unwrap() - side.length()).abs() < 1e-5);
    assert_eq!(met(Vec3::ZERO, Vec3::NEG_Y), None);
    assert_eq!(met(Vec3::ZERO, Vec3::new(0.6, 3.0, 0.0)), None);
    assert_eq!(met(Vec3::new(0.0, 2.9, 0.0), 4.0 * Vec3::Y), Some(0.0));
}

/// Three estimates of a disc's reflection off a glossy surface agree: next-event estimation, BSDF
/// sampling, and both together.
#[test]
fn both_ways_of_finding_a_disc_count_once() {
    let lights = [
        placed(
            PunctualLight { kind: LightKind::Point { radius: 0.5 }, ..point(3.0, None) },
            Vec3::new(-1.2, 0.3, 1.5),
            Vec3::X,
        ),
        placed(
            PunctualLight { kind: LightKind::Directional { angle: 0.5 }, ..point(1.0, None) },
            Vec3::ZERO,
            Vec3::new(0.8, 0.1, -1.0),
        ),
    ];
    let punctual = Punctual::new(&lights, 3.0);
    for (metallic, roughness) in [(1.0, 0.1), (1.0, 0.5), (0.0, 0.3)] {
        let bsdf = Bsdf::new(&Substance {
            base_color: Vec3::splat(0.8),
            metallic,
            roughness,
            transmission: 0.0,
            ior: 1.5,
            specular: 1.0,
            specular_color: Vec3::ONE,
        });
        let view = Vec3::new(0.8, 0.0, 1.0).normalize();
        let eval = |direction: Vec3| bsdf.eval(view, direction);
        let (n, end, mut sums) = (1 << 16, f32::INFINITY, [[0.0f64; 2]; 4]);
        for i in 0..n {
            let mut s = Sampler::new(5, 0, i);
            let (choice, on_disc) = (s.number(), s.square());
            let searched: f32 = lights
                .iter()
                .map(|l| incident(l, Vec3::ZERO).unwrap().toward(on_disc))
                .map(|point| eval(point.direction).value.x * point.irradiance.x)
                .sum();
            let mixed = punctual.choose(Vec3::ZERO, choice, on_disc, eval);
            let mixed = mixed.map_or(0.0, |chosen| chosen.light.x);
            let (mut weighed, mut unweighed) = (0.0, 0.0);
            if let Some(chosen) = bsdf.sample(view, s.number(), s.square()) {
                let met = |pdf| punctual.met(Vec3::ZERO, chosen.direction, end, pdf, |_| 1.0).x;
                weighed = chosen.weight.x * met(chosen.pdf);
                unweighed = chosen.weight.x * met(f32::INFINITY);
            }
            let values = [searched, unweighed, mixed + weighed, mixed + unweighed];
            for (sum, value) in sums.iter_mut().zip(values.map(f64::from)) {
                sum[0] += value / f64::from(n);
                sum[1] += value * value / f64::from(n);
            }
        }
        let [searched, chance, both, twice] =
            sums.map(|[mean, square]| (mean, ((square - mean * mean) / f64::from(n)).sqrt()));
        let agree = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() < 5.0 * a.1.hypot(b.1);
        let all = format!("{metallic} {roughness}: {searched:?} {chance:?} {both:?} {twice:?}");
        assert!(agree(both, searched) && agree(both, chance), "{all}");
        assert!(!agree(twice, both), "too coarse a check: {all}");
        assert!(both.1 < 4.0 * searched.1.min(chance.1), "far from the better of the two: {all}");
    }
}
