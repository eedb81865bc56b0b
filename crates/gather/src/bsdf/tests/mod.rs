mod chi_square;
mod furnace;

use glam::{Vec2, Vec3};

use super::*;
use crate::sampling::{Sampler, sphere};

fn views() -> [Vec3; 4] {
    [0.0f32, 0.6, 1.2, 1.5].map(|a| Vec3::new(a.sin() * 0.6, a.sin() * 0.8, a.cos()))
}

fn substances() -> Vec<(&'static str, Substance)> {
    let plain = Substance {
        base_color: Vec3::ONE,
        metallic: 0.0,
        roughness: 0.5,
        transmission: 0.0,
        ior: 1.5,
        specular: 1.0,
        specular_color: Vec3::ONE,
    };
    vec![
        ("dielectric", plain),
        ("rough dielectric", Substance { roughness: 1.0, ..plain }),
        ("glossy dielectric", Substance { roughness: 0.3, ior: 1.8, ..plain }),
        ("metal", Substance { metallic: 1.0, base_color: Vec3::new(1.0, 0.8, 0.3), ..plain }),
        ("half metal", Substance { metallic: 0.5, ..plain }),
        ("thin sheet", Substance { transmission: 1.0, ..plain }),
        ("half-thin sheet", Substance { transmission: 0.5, roughness: 0.8, ..plain }),
        (
            "tinted specular",
            Substance { specular: 0.7, specular_color: Vec3::new(3.0, 0.5, 1.0), ..plain },
        ),
        ("infinite index", Substance { ior: 0.0, ..plain }),
    ]
}

/// Mean and standard error of `f` over `n` samples.
fn estimate(n: u32, mut f: impl FnMut(&mut Sampler) -> f64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..n {
        let x = f(&mut Sampler::new(11, 0, i));
        sum += x;
        squares += x * x;
    }
    let mean = sum / f64::from(n);
    (mean, ((squares / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt())
}

fn over_sphere(f: impl Fn(Vec3) -> f32) -> (f64, f64) {
    estimate(1 << 16, |s| f64::from(f(sphere(s.square()))) * 4.0 * std::f64::consts::PI)
}

#[test]
fn weights_are_value_over_density_and_estimate_the_same_albedo() {
    for (name, s) in substances() {
        let bsdf = Bsdf::new(&s);
        for v in views() {
            let (by_sampling, e1) = estimate(1 << 14, |r| {
                let choice = r.number();
                bsdf.sample(v, choice, r.square()).map_or(0.0, |c| f64::from(c.weight.y))
            });
            let (by_uniform, e2) = over_sphere(|l| bsdf.eval(v, l).value.y);
            let difference = (by_sampling - by_uniform).abs();
            assert!(
                difference < 5.0 * e1.hypot(e2) + 1e-4,
                "{name} at {v}: {by_sampling} {by_uniform}"
            );
        }
    }
}

/// Largest difference between f(v, l) and f(l, v), relative to the larger; `eval` gives f·|cos θ|.
fn asymmetry(eval: impl Fn(Vec3, Vec3) -> Vec3) -> f32 {
    let mut worst = 0.0f32;
    for i in 0..512 {
        let mut r = Sampler::new(5, 0, i);
        let (a, l) = (sphere(r.square()), sphere(r.square()));
        let v = Vec3::new(a.x, a.y, a.z.abs().max(0.02)).normalize();
        // For transmission the path is reversed and seen from the other side, so the frame is
        // mirrored.
        let (w, k) = if l.z > 0.0 { (l, v) } else { (through(l), through(v)) };
        let forth = eval(v, l) / l.z.abs();
        let back = eval(w, k) / v.z;
        let scale = forth.abs().max(back.abs()).max_element().max(1e-3);
        worst = worst.max((forth - back).abs().max_element() / scale);
    }
    worst
}

#[test]
fn reciprocal() {
    for (name, s) in substances() {
        let bsdf = Bsdf::new(&s);
        let worst = asymmetry(|v, l| bsdf.eval(v, l).value);
        assert!(worst < 1e-3, "{name}: {worst}");
    }
    // This faulty diffuse lobe loses only what the surface reflects towards the viewer.
    let bsdf = Bsdf::new(&substances()[0].1);
    let one_way = |v: Vec3, l: Vec3| {
        let lost = bsdf.coupling(v, l) - (1.0 - bsdf.reflectance(v.z));
        bsdf.eval(v, l).value - bsdf.diffuse * (lost * FRAC_1_PI * l.z.max(0.0))
    };
    assert!(asymmetry(one_way) > 0.1, "{}", asymmetry(one_way));
}

/// Normal incidence on smooth dielectrics: F0 = ((n − 1)/(n + 1))².
#[test]
fn reflects_f0_at_normal_incidence() {
    for (ior, f0) in [(1.5f32, 0.04f64), (1.33, 0.02006), (2.4, 0.169_55)] {
        let black = Substance { base_color: Vec3::ZERO, ior, roughness: 0.05, ..substances()[0].1 };
        let bsdf = Bsdf::new(&black);
        let (mean, _) = estimate(4096, |r| {
            bsdf.sample(Vec3::Z, 0.5, r.square()).map_or(0.0, |c| f64::from(c.weight.y))
        });
        assert!((mean - f0).abs() < 2e-4, "{ior}: {mean}");
    }
}

#[test]
fn frames_are_orthonormal() {
    for i in 0..256 {
        let n = sphere(Vec2::new((i as f32 + 0.5) / 256.0, (i * 37 % 256) as f32 / 256.0));
        let f = frame(n);
        assert!((f.transpose() * f - glam::Mat3::IDENTITY).abs_diff_eq(glam::Mat3::ZERO, 1e-5));
        assert!((f.determinant() - 1.0).abs() < 1e-5 && f.z_axis == n);
    }
    assert!(frame(Vec3::NEG_Z).is_finite());
}
