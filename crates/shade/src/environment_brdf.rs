//! What the specular lobe does with light from all around: the second factor of the split sum (Karis
//! 2013, "Real Shading in Unreal Engine 4"), and the shape of the lobe, for the first one.
//!
//! For single-scatter GGX with height-correlated Smith shadowing and Schlick's Fresnel term the
//! answer to uniform light is F0·a + F90·b, a and b functions of n·v and of roughness: mean over
//! visible normals (Heitz 2018) of G₂/G₁ (1 − (1 − v·h)⁵) and of G₂/G₁ (1 − v·h)⁵.
//!
//! A rough surface reflects light of directions that lie nearer to its normal than the mirrored one,
//! the more so the lower it is seen. So the lobe is taken to be round about its own mean direction,
//! with the true mean of every zonal harmonic about it: exact for L1 light under a constant F. The
//! fitted lobe of the second paper's appendix A is round about the mirrored direction, and as wide as
//! it is seen from straight above.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Below it the lobe is narrower than f32 can hold; as the shaders have it.
const MIN_ALPHA: f32 = 1e-3;
/// Samples, at the points of a Fibonacci lattice: they are within 2·10⁻³ of the integral.
const SAMPLES: u32 = 1597;
/// The Fibonacci number before that.
const STEP: u32 = 987;

/// What the specular lobe makes of light, at a cosine n·v and a roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflected {
    /// a and b: what F0 and F90 are multiplied by to get the share of uniform light.
    pub albedo: Vec2,
    /// Mean of the unit vectors that light comes from: its part along the mirrored direction, and the
    /// one across it, towards the normal. Its length is the lobe's multiplier of band 1.
    pub mean: Vec2,
    /// Multipliers of bands 2 to 4 about that mean.
    pub bands: Vec3,
}

/// `size` by `size` entries, row by row: cosines from 0 to 1 along a row, perceptual roughness from 0
/// to 1 along a column; the outermost entries stand for 0 and 1 themselves.
pub fn environment_brdf(size: usize) -> Vec<Reflected> {
    let share = |i: usize| i as f32 / (size - 1) as f32;
    (0..size * size).into_par_iter().map(|i| reflected(share(i % size), share(i / size))).collect()
}

/// At a cosine n·v and a perceptual roughness, both 0 to 1.
pub fn reflected(cosine: f32, roughness: f32) -> Reflected {
    let alpha = (roughness * roughness).max(MIN_ALPHA);
    let cosine = cosine.max(1e-3);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let v = Vec3::new(sine, 0.0, cosine);
    let mut albedo = Vec2::ZERO;
    let mut light = Vec::with_capacity(SAMPLES as usize);
    for i in 0..SAMPLES {
        let u = Vec2::new((i * STEP % SAMPLES) as f32, i as f32 + 0.5) / SAMPLES as f32;
        let h = visible_normal(v, alpha, u);
        let l = 2.0 * v.dot(h) * h - v;
        if l.z > 0.0 {
            let (lambda_v, lambda_l) = (lambda(v.z, alpha), lambda(l.z, alpha));
            let weight = (1.0 + lambda_v) / (1.0 + lambda_v + lambda_l);
            let grazing = (1.0 - v.dot(h)).clamp(0.0, 1.0).powi(5);
            albedo += weight * Vec2::new(1.0 - grazing, grazing);
            light.push(l.extend(weight));
        }
    }
    let all: f32 = light.iter().map(|l| l.w).sum();
    let mean = light.iter().map(|l| l.w * l.truncate()).sum::<Vec3>() / all;
    let axis = mean.normalize_or(Vec3::Z);
    let band = |p: fn(f32) -> f32| {
        light.iter().map(|l| l.w * p(l.truncate().dot(axis))).sum::<f32>() / all
    };
    let mirrored = Vec3::new(-sine, 0.0, cosine);
    let across = Vec3::new(cosine, 0.0, sine);
    Reflected {
        albedo: albedo / SAMPLES as f32,
        mean: Vec2::new(mean.dot(mirrored), mean.dot(across)),
        bands: Vec3::new(
            band(|x| 1.5 * x * x - 0.5),
            band(|x| (2.5 * x * x - 1.5) * x),
            band(|x| (4.375 * x * x - 3.75) * x * x + 0.375),
        ),
    }
}

/// Smith's Λ at a direction whose cosine with the normal is given.
fn lambda(cosine: f32, alpha: f32) -> f32 {
    let tan2 = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// A microfacet's normal as seen from `v` (Dupuy and Benyoub 2023, "Sampling visible GGX normals
/// with spherical caps").
fn visible_normal(v: Vec3, alpha: f32, u: Vec2) -> Vec3 {
    let stretched = Vec3::new(alpha * v.x, alpha * v.y, v.z).normalize();
    let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    let r = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
    let cap = (r * Vec2::from_angle(TAU * u.x)).extend(z);
    let h = cap + stretched;
    Vec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `vectors/ggx_albedo.json` is an independent quadrature in f64.
    #[test]
    fn agrees_with_independent_quadrature() {
        let text = include_str!("../../../vectors/ggx_albedo.json");
        let table: serde_json::Value = serde_json::from_str(text).unwrap();
        let list =
            |name: &str| -> Vec<f32> { serde_json::from_value(table[name].clone()).unwrap() };
        let grid =
            |name: &str| -> Vec<Vec<f32>> { serde_json::from_value(table[name].clone()).unwrap() };
        let (by_f0, by_f90) = (grid("by_f0"), grid("by_f90"));
        for (r, roughness) in list("roughness").into_iter().enumerate() {
            for (c, cosine) in list("cos").into_iter().enumerate() {
                let found = reflected(cosine, roughness).albedo;
                let expected = Vec2::new(by_f0[r][c], by_f90[r][c]);
                let error = (found - expected).abs().max_element();
                assert!(error < 2e-3, "{roughness} {cosine}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_mirror_reflects_all() {
        for cosine in [1.0, 0.6, 0.1] {
            let Reflected { albedo, mean, bands } = reflected(cosine, 0.0);
            assert!((albedo.element_sum() - 1.0).abs() < 1e-3, "{albedo}");
            assert!((mean - Vec2::X).abs().max_element() < 1e-3, "{mean}");
            assert!((bands - 1.0).abs().max_element() < 1e-2, "{bands}");
        }
    }

    /// Seen from straight above it is nearly the second paper's lobe, which leaves shadowing out.
    #[test]
    fn from_above_it_is_the_fitted_lobe() {
        for (roughness, tolerance) in [(0.1, 1e-3), (0.3, 0.04), (0.5, 0.1)] {
            let Reflected { mean, bands, .. } = reflected(1.0, roughness);
            let [_, first, rest @ ..] = lumencast_light::zh::ggx(roughness);
            assert!((mean - Vec2::new(first, 0.0)).abs().max_element() < tolerance, "{mean}");
            let apart = (bands - Vec3::from(rest)).abs().max_element();
            assert!(apart < tolerance, "{roughness}: {bands}, {rest:?}");
        }
    }

    /// Low and rough, light comes from nearer to the normal.
    #[test]
    fn lobes_lean_towards_the_normal() {
        let lean = |cosine, roughness| {
            let Reflected { mean, .. } = reflected(cosine, roughness);
            mean.to_angle()
        };
        assert!(lean(0.2, 0.5) > 0.2 && lean(0.2, 0.9) > 2.0 * lean(0.2, 0.5));
        assert!(lean(1.0, 0.9).abs() < 1e-2 && lean(0.2, 0.05).abs() < 1e-2);
    }

    #[test]
    fn the_table_is_the_function() {
        let table = environment_brdf(8);
        assert_eq!(table.len(), 64);
        assert_eq!(table[7 + 8 * 2], reflected(1.0, 2.0 / 7.0));
        assert!(
            table
                .iter()
                .all(|e| e.albedo.cmpge(Vec2::ZERO).all() && e.albedo.element_sum() <= 1.001)
        );
    }
}
