//! How surfaces scatter light: glTF's metallic-roughness model with KHR_materials_{ior, specular,
//! transmission} (glTF 2.0, appendix B).
//!
//! A BSDF has three lobes, in a frame whose z is the shading normal on the viewer's side:
//! - *diffuse*: Lambert times (1 − F(n·v))(1 − F(n·l))/(1 − F̄). F̄ is the mean of F over the
//!   hemisphere (Ashikhmin and Shirley 2000, section 2.2).
//! - *specular*: GGX with height-correlated Smith shadowing; F is Schlick's.
//! - *transmission*: thin-walled, so light continues without bending. It is the specular lobe
//!   mirrored through the surface, times base colour and 1 − F; roughness blurs it.
//!
//! The sample code of glTF mixes diffuse and specular by 1 − F(v·h), which at grazing angles
//! reflects up to 1.6 times what arrives. With the factor above the model is reciprocal. A smooth
//! white surface then reflects exactly what arrives, a rough one at most 0.2 % more.
//!
//! Light that scatters more than once between microfacets is lost: rough metals are up to a third
//! too dark, as in glTF's reference code.

pub(crate) mod ggx;
#[cfg(test)]
mod tests;

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use crate::numbers::numbers;
use crate::sampling::{cosine_hemisphere, luminance};

/// The BSDF of a surface at one point. Directions point away from it; the viewer's has z > 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bsdf {
    diffuse: Vec3,
    transmission: Vec3,
    /// Reflectance of the specular lobe at normal incidence, dielectric and metal mixed.
    f0: Vec3,
    f90: f32,
    /// Reflectance of the dielectric alone at normal incidence, largest channel: the lobes
    /// underneath lose this share.
    dielectric_f0: f32,
    dielectric_f90: f32,
    alpha: f32,
}

/// Material values at a point, with textures applied.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Substance {
    /// Linear colour.
    pub(crate) base_color: Vec3,
    /// 0 to 1.
    pub(crate) metallic: f32,
    /// Perceptual, 0 to 1.
    pub(crate) roughness: f32,
    /// 0 to 1.
    pub(crate) transmission: f32,
    /// Index of refraction; 0 means infinite.
    pub(crate) ior: f32,
    /// 0 to 1.
    pub(crate) specular: f32,
    /// Linear colour.
    pub(crate) specular_color: Vec3,
}

/// The BSDF's value and sampling density for one pair of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Scatter {
    /// f(v, l)·|cos θ_l|.
    pub(crate) value: Vec3,
    /// Density, per steradian, with which [`Bsdf::sample`] would have chosen l.
    pub(crate) pdf: f32,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chosen {
    pub(crate) direction: Vec3,
    /// f·|cos θ|/pdf.
    pub(crate) weight: Vec3,
    pub(crate) pdf: f32,
}

impl Chosen {
    /// The value for a sample without a direction.
    pub(crate) const NONE: Self = Self { direction: Vec3::ZERO, weight: Vec3::ZERO, pdf: 0.0 };
}

numbers!(Bsdf of f32 { diffuse: Vec3, transmission: Vec3, f0: Vec3, f90: f32, dielectric_f0: f32, dielectric_f90: f32, alpha: f32 });

impl Bsdf {
    /// A Lambert surface.
    #[inline]
    pub(crate) fn lambert(albedo: Vec3) -> Self {
        Self {
            diffuse: albedo,
            transmission: Vec3::ZERO,
            f0: Vec3::ZERO,
            f90: 0.0,
            dielectric_f0: 0.0,
            dielectric_f90: 0.0,
            alpha: 1.0,
        }
    }

    /// A glTF surface.
    #[inline]
    pub(crate) fn new(s: &Substance) -> Self {
        let by_ior = if s.ior == 0.0 { 1.0 } else { ((s.ior - 1.0) / (s.ior + 1.0)).powi(2) };
        let f0 = (by_ior * s.specular_color).min(Vec3::ONE) * s.specular;
        let dielectric = s.base_color * (1.0 - s.metallic);
        Self {
            diffuse: dielectric * (1.0 - s.transmission),
            transmission: dielectric * s.transmission,
            f0: f0.lerp(s.base_color, s.metallic),
            f90: s.specular + (1.0 - s.specular) * s.metallic,
            dielectric_f0: f0.max_element(),
            dielectric_f90: s.specular,
            alpha: (s.roughness * s.roughness).max(ggx::MIN_ALPHA),
        }
    }

    /// The scattering from l to v. `l` may lie on either side.
    #[inline(always)]
    pub(crate) fn eval(&self, v: Vec3, l: Vec3) -> Scatter {
        let mut s = Scatter::default();
        if v.z <= 0.0 {
            return s;
        }
        if self.is_lambert() {
            let pdf = FRAC_1_PI * l.z.max(0.0);
            return Scatter { value: self.diffuse * pdf, pdf };
        }
        let [p_diffuse, p_specular, p_transmission] = self.chances(v);
        if l.z > 0.0 {
            s.value += self.diffuse * (self.coupling(v, l) * FRAC_1_PI * l.z);
            s.pdf += p_diffuse * FRAC_1_PI * l.z;
            if p_specular > 0.0 {
                let lobe = ggx::Lobe::reflect(v, l, self.alpha);
                s.value += self.fresnel(lobe.v_dot_h) * lobe.value;
                s.pdf += p_specular * lobe.pdf;
            }
        } else if l.z < 0.0 && p_transmission > 0.0 {
            let lobe = ggx::Lobe::reflect(v, through(l), self.alpha);
            s.value += self.transmission * ((1.0 - self.reflectance(lobe.v_dot_h)) * lobe.value);
            s.pdf += p_transmission * lobe.pdf;
        }
        s
    }

    /// Samples a direction; `choice` picks the lobe. `None` where the sampled direction carries no
    /// light.
    #[inline(always)]
    pub(crate) fn sample(&self, v: Vec3, choice: f32, u: Vec2) -> Option<Chosen> {
        if self.is_lambert() {
            let direction = cosine_hemisphere(u);
            let pdf = FRAC_1_PI * direction.z;
            let is_found = v.z > 0.0 && pdf > 0.0 && self.diffuse != Vec3::ZERO;
            return is_found.then_some(Chosen { direction, weight: self.diffuse, pdf });
        }
        let [p_diffuse, p_specular, p_transmission] = self.chances(v);
        if v.z <= 0.0 || p_diffuse + p_specular + p_transmission <= 0.0 {
            return None;
        }
        let direction = if choice < p_diffuse {
            cosine_hemisphere(u)
        } else {
            let h = ggx::visible_normal(v, self.alpha, u);
            let mirrored = 2.0 * v.dot(h) * h - v;
            if mirrored.z <= 0.0 {
                return None;
            }
            if choice < p_diffuse + p_specular || p_transmission == 0.0 {
                mirrored
            } else {
                through(mirrored)
            }
        };
        let Scatter { value, pdf } = self.eval(v, direction);
        (pdf > 0.0 && pdf.is_finite()).then(|| Chosen { direction, weight: value / pdf, pdf })
    }

    /// Whether the surface has only a diffuse lobe, without a reflecting layer above it.
    #[inline(always)]
    fn is_lambert(&self) -> bool {
        self.f90 == 0.0 && self.f0 == Vec3::ZERO && self.transmission == Vec3::ZERO
    }

    /// Probability of sampling each lobe, by an estimate of its contribution.
    #[inline(always)]
    fn chances(&self, v: Vec3) -> [f32; 3] {
        let f = self.reflectance(v.z);
        let diffuse = luminance(self.diffuse) * (1.0 - f);
        let specular = luminance(self.fresnel(v.z));
        let transmission = luminance(self.transmission) * (1.0 - f);
        let sum = diffuse + specular + transmission;
        if sum > 0.0 { [diffuse / sum, specular / sum, transmission / sum] } else { [0.0; 3] }
    }

    /// Schlick's Fresnel term.
    #[inline(always)]
    fn fresnel(&self, cos: f32) -> Vec3 {
        self.f0 + (Vec3::splat(self.f90) - self.f0) * schlick(cos)
    }

    /// The share of light that the dielectric's surface takes from the lobes underneath.
    #[inline(always)]
    fn reflectance(&self, cos: f32) -> f32 {
        self.dielectric_f0 + (self.dielectric_f90 - self.dielectric_f0) * schlick(cos)
    }

    /// The diffuse lobe's factor relative to Lambert.
    #[inline(always)]
    fn coupling(&self, v: Vec3, l: Vec3) -> f32 {
        // ∫ F cos dω/π for Schlick's F.
        let mean = self.dielectric_f0 + (self.dielectric_f90 - self.dielectric_f0) / 21.0;
        if mean >= 1.0 {
            return 0.0;
        }
        (1.0 - self.reflectance(v.z)) * (1.0 - self.reflectance(l.z)) / (1.0 - mean)
    }
}

#[inline(always)]
fn schlick(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    m * m * m * m * m
}

/// Mirrors a direction through the surface.
#[inline(always)]
fn through(d: Vec3) -> Vec3 {
    Vec3::new(d.x, d.y, -d.z)
}

/// A frame about a unit normal: columns x, y, z = n (Duff et al. 2017).
#[inline(always)]
pub(crate) fn frame(n: Vec3) -> glam::Mat3 {
    let sign = 1.0f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    glam::Mat3::from_cols(
        Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vec3::new(b, sign + n.y * n.y * a, -n.y),
        n,
    )
}
