use std::f32::consts::PI;
use std::sync::Arc;

use glam::Vec3;
use lumencast_scene::{Environment, HdrImage, Light, LightKind, NodeId, PlacedLight};

use super::environment::{Sky, SkyCache};
use super::punctual::{Punctual, incident};
use crate::sampling::{Sampler, sphere};

fn placed(light: Light, position: Vec3, direction: Vec3) -> PlacedLight {
    PlacedLight { node: NodeId(0), light, position, direction: direction.normalize() }
}

fn point(intensity: f32, range: Option<f32>) -> Light {
    Light { kind: LightKind::Point, color: Vec3::ONE, intensity, range }
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
    let spot = Light { kind: LightKind::Spot { inner, outer }, ..point(1.0, None) };
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

/// Whatever the number of lights, the mean over choices is the sum over lights.
#[test]
fn choosing_among_lights_is_unbiased() {
    for count in [1, 3, 16, 40] {
        let lights: Vec<_> = (0..count)
            .map(|i| {
                let mut s = Sampler::new(3, 0, i);
                let position = 2.0 * sphere(s.square()) + Vec3::Y;
                let kind = match i % 3 {
                    0 => LightKind::Point,
                    1 => LightKind::Spot { inner: 0.0, outer: 1.5 },
                    _ => LightKind::Directional,
                };
                let color = Vec3::new(1.0, s.number(), s.number());
                let light = Light { kind, color, intensity: 1.0 + 5.0 * s.number(), range: None };
                placed(light, position, -position)
            })
            .collect();
        let at = Vec3::new(0.1, -0.2, 0.3);
        let reflected = |l: Vec3| Vec3::splat(l.y.max(0.0));
        let expected: Vec3 = lights
            .iter()
            .filter_map(|l| incident(l, at))
            .map(|i| reflected(i.direction) * i.irradiance)
            .sum();
        let punctual = Punctual::new(&lights, 3.0);
        let n = 1 << 14;
        let (mut mean, mut squares) = (Vec3::ZERO, Vec3::ZERO);
        for i in 0..n {
            let u = Sampler::new(9, 1, i).number();
            let light = punctual.choose(at, u, reflected).map_or(Vec3::ZERO, |(_, light)| light);
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

/// A dim picture with a small bright patch.
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
    // Important directions are chosen so well that the ratio varies by less than its own size,
    // where uniform directions vary by about twenty times.
    let spread = (chosen[1] / chosen[0].powi(2) - 1.0).sqrt();
    assert!(spread < 1.0, "{spread}");
}
