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
fn densities_integrate_to_at_most_one() {
    for (name, s) in substances() {
        let bsdf = Bsdf::new(&s);
        for v in views() {
            let (integral, error) = over_sphere(|l| bsdf.eval(v, l).pdf);
            // Directions that a rough lobe sends into the surface are missing; of those `sample`
            // itself says how many there are.
            let (kept, kept_error) = estimate(1 << 14, |r| {
                let choice = r.number();
                f64::from(u8::from(bsdf.sample(v, choice, r.square()).is_some()))
            });
            let tolerance = 5.0 * error.hypot(kept_error) + 1e-4;
            assert!(
                (integral - kept).abs() < tolerance,
                "{name} at {v}: {integral} ± {error}, kept {kept}"
            );
        }
    }
}

#[test]
fn lambert_density_integrates_to_one() {
    let (integral, error) = over_sphere(|l| Bsdf::lambert(Vec3::ONE).eval(Vec3::Z, l).pdf);
    assert!((integral - 1.0).abs() < 5.0 * error, "{integral} ± {error}");
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

#[test]
fn reciprocal() {
    for (name, s) in substances() {
        let bsdf = Bsdf::new(&s);
        for i in 0..512 {
            let mut r = Sampler::new(5, 0, i);
            let (a, b) = (sphere(r.square()), sphere(r.square()));
            let v = Vec3::new(a.x, a.y, a.z.abs().max(0.02)).normalize();
            // Transmission: seen from the other side, the frame is mirrored.
            let l = b;
            let (w, k) = if l.z > 0.0 { (l, v) } else { (through(l), through(v)) };
            let forth = bsdf.eval(v, l).value / l.z.abs();
            let back = bsdf.eval(w, k).value / v.z;
            let scale = forth.abs().max_element().max(1e-3);
            assert!((forth - back).abs().max_element() < 1e-3 * scale, "{name}: {forth} {back}");
        }
    }
}

/// White furnace: no surface reflects more than arrives.
#[test]
fn conserves_energy() {
    for (name, s) in substances() {
        for roughness in [0.05, 0.2, 0.5, 1.0] {
            let bsdf = Bsdf::new(&Substance { roughness, ..s });
            for v in views() {
                let (albedo, error) = estimate(1 << 13, |r| {
                    let choice = r.number();
                    bsdf.sample(v, choice, r.square())
                        .map_or(0.0, |c| f64::from(c.weight.max_element()))
                });
                assert!(
                    albedo < 1.02 + 5.0 * error,
                    "{name}, roughness {roughness}, at {v}: {albedo}"
                );
            }
        }
    }
}

/// A smooth white dielectric keeps all light but what the microfacets lose; with glTF's own mix
/// (1 − F(v·h)) the same test reflects far more than arrives, which shows that it can fail.
#[test]
fn smooth_white_dielectric_keeps_all_light_and_the_naive_mix_does_not() {
    let s = Substance { roughness: 0.05, ..substances()[0].1 };
    let bsdf = Bsdf::new(&s);
    for v in views() {
        let albedo = |naive: bool| {
            estimate(1 << 14, |r| {
                let choice = r.number();
                let Some(c) = bsdf.sample(v, choice, r.square()) else { return 0.0 };
                let l = c.direction;
                let change = if naive {
                    let h = (v + l).normalize();
                    1.0 - bsdf.reflectance(v.dot(h)) - bsdf.coupling(v, l)
                } else {
                    0.0
                };
                f64::from(c.weight.y + change * FRAC_1_PI * l.z / c.pdf)
            })
        };
        let (mean, error) = albedo(false);
        assert!((mean - 1.0).abs() < 0.01 + 5.0 * error, "{v}: {mean} ± {error}");
        if v.z < 0.1 {
            assert!(albedo(true).0 > 1.2);
        }
    }
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
