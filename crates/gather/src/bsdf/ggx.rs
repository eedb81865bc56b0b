//! The GGX microfacet distribution (Walter et al. 2007; Heitz 2014, 2018), isotropic.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::sampling::turned;

/// The smallest α (perceptual roughness 0.032). Below it the lobe is narrower than f32 can
/// integrate.
pub(crate) const MIN_ALPHA: f32 = 1e-3;

/// The specular lobe for a pair of directions, without Fresnel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lobe {
    /// D·G₂/(4 n·v n·l) · n·l.
    pub(crate) value: f32,
    /// Density per steradian of [`visible_normal`] followed by a reflection.
    pub(crate) pdf: f32,
    pub(crate) v_dot_h: f32,
}

impl Lobe {
    /// Evaluates the lobe; both directions must have z > 0.
    #[inline(always)]
    pub(crate) fn reflect(v: Vec3, l: Vec3, alpha: f32) -> Self {
        let h = (v + l).normalize_or(Vec3::Z);
        let d = distribution(h, alpha);
        let (lambda_v, lambda_l) = (lambda(v, alpha), lambda(l, alpha));
        Self {
            value: d / (4.0 * v.z * (1.0 + lambda_v + lambda_l)),
            pdf: d / (4.0 * v.z * (1.0 + lambda_v)),
            v_dot_h: v.dot(h),
        }
    }
}

/// Density of normals D(h), in a form that stays exact near the peak.
#[inline(always)]
fn distribution(h: Vec3, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let t = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
    1.0 / (PI * a2 * t * t)
}

/// Smith's Λ; G₁ = 1/(1 + Λ), G₂ = 1/(1 + Λ_v + Λ_l).
#[inline(always)]
fn lambda(v: Vec3, alpha: f32) -> f32 {
    let tan2 = (v.x * v.x + v.y * v.y) / (v.z * v.z);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// Samples a normal as seen from `v`, with density D·G₁·max(v·h, 0)/n·v (Dupuy and Benyoub 2023,
/// "Sampling visible GGX normals with spherical caps").
#[inline(always)]
pub(crate) fn visible_normal(v: Vec3, alpha: f32, u: Vec2) -> Vec3 {
    let stretched = Vec3::new(alpha * v.x, alpha * v.y, v.z).normalize();
    let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    let r = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
    let cap = (r * turned(u.x)).extend(z);
    let h = cap + stretched;
    Vec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
}
