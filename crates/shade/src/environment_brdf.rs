//! The environment BRDF: the second factor of the split sum (Karis 2013, "Real Shading in Unreal
//! Engine 4"), which says how much of uniform light the specular lobe reflects.
//!
//! For single-scatter GGX with height-correlated Smith shadowing and Schlick's Fresnel term the
//! answer is F0·a + F90·b, a and b functions of n·v and of roughness: mean over visible normals
//! (Heitz 2018) of G₂/G₁ (1 − (1 − v·h)⁵) and of G₂/G₁ (1 − v·h)⁵.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Below it the lobe is narrower than f32 can hold; as the shaders have it.
const MIN_ALPHA: f32 = 1e-3;
/// Samples, at the points of a Fibonacci lattice: they are within 2·10⁻³ of the integral.
const SAMPLES: u32 = 1597;
/// The Fibonacci number before that.
const STEP: u32 = 987;

/// `size` by `size` pairs (a, b), row by row: cosines from 0 to 1 along a row, perceptual roughness
/// from 0 to 1 along a column; the outermost entries stand for 0 and 1 themselves.
pub fn environment_brdf(size: usize) -> Vec<Vec2> {
    let share = |i: usize| i as f32 / (size - 1) as f32;
    (0..size * size).into_par_iter().map(|i| reflected(share(i % size), share(i / size))).collect()
}

/// What F0 and F90 are multiplied by at a cosine n·v and a perceptual roughness, both 0 to 1.
pub fn reflected(cosine: f32, roughness: f32) -> Vec2 {
    let alpha = (roughness * roughness).max(MIN_ALPHA);
    let cosine = cosine.max(1e-3);
    let v = Vec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let mut sum = Vec2::ZERO;
    for i in 0..SAMPLES {
        let u = Vec2::new((i * STEP % SAMPLES) as f32, i as f32 + 0.5) / SAMPLES as f32;
        let h = visible_normal(v, alpha, u);
        let l = 2.0 * v.dot(h) * h - v;
        if l.z > 0.0 {
            let (lambda_v, lambda_l) = (lambda(v.z, alpha), lambda(l.z, alpha));
            let weight = (1.0 + lambda_v) / (1.0 + lambda_v + lambda_l);
            let grazing = (1.0 - v.dot(h)).clamp(0.0, 1.0).powi(5);
            sum += weight * Vec2::new(1.0 - grazing, grazing);
        }
    }
    sum / SAMPLES as f32
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
                let found = reflected(cosine, roughness);
                let expected = Vec2::new(by_f0[r][c], by_f90[r][c]);
                let error = (found - expected).abs().max_element();
                assert!(error < 2e-3, "{roughness} {cosine}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_mirror_reflects_all() {
        let found = reflected(1.0, 0.0);
        assert!((found - Vec2::X).abs().max_element() < 1e-3, "{found}");
    }

    #[test]
    fn the_table_is_the_function() {
        let table = environment_brdf(8);
        assert_eq!(table.len(), 64);
        assert_eq!(table[7 + 8 * 2], reflected(1.0, 2.0 / 7.0));
        assert!(table.iter().all(|p| p.cmpge(Vec2::ZERO).all() && p.x + p.y <= 1.001));
    }
}
