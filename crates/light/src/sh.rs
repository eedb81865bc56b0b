//! Real spherical harmonics, orthonormal, positive constants, index l(l+1)+m, world axes: the order
//! and signs of Ramamoorthi and Hanrahan (2001).

mod quadrature;
mod rotation;

pub use quadrature::{project, quadrature};
pub use rotation::Rotation;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::zh::{Bands, COSINE};

/// Highest band of a spherical-harmonic expansion.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize,
)]
#[serde(try_from = "u8", into = "u8")]
pub enum Order {
    /// 4 coefficients.
    L1,
    /// 9 coefficients, the default.
    #[default]
    L2,
    /// 16 coefficients.
    L3,
    /// 25 coefficients.
    L4,
}

impl Order {
    /// Highest band l, 1 to 4.
    pub const fn band(self) -> usize {
        self as usize + 1
    }

    /// Number of coefficients, (l+1)².
    pub const fn coefficients(self) -> usize {
        (self.band() + 1) * (self.band() + 1)
    }
}

impl TryFrom<u8> for Order {
    type Error = String;

    fn try_from(band: u8) -> Result<Self, String> {
        Ok(match band {
            1 => Self::L1,
            2 => Self::L2,
            3 => Self::L3,
            4 => Self::L4,
            _ => return Err(format!("order {band}: 1 to 4 are known")),
        })
    }
}

impl From<Order> for u8 {
    fn from(order: Order) -> u8 {
        order.band() as u8
    }
}

/// The most coefficients of any [`Order`].
pub const MAX_COEFFICIENTS: usize = 25;

/// The basis functions Y_lm at the unit vector `d`; the first `order.coefficients()` are set.
pub fn basis(order: Order, d: Vec3) -> [f32; MAX_COEFFICIENTS] {
    let Vec3 { x, y, z } = d;
    let mut b = [0.0; MAX_COEFFICIENTS];
    b[0] = 0.282_094_8;
    b[1] = 0.488_602_52 * y;
    b[2] = 0.488_602_52 * z;
    b[3] = 0.488_602_52 * x;
    if order >= Order::L2 {
        b[4] = 1.092_548_4 * x * y;
        b[5] = 1.092_548_4 * y * z;
        b[6] = 0.315_391_57 * (3.0 * z * z - 1.0);
        b[7] = 1.092_548_4 * x * z;
        b[8] = 0.546_274_2 * (x * x - y * y);
    }
    if order >= Order::L3 {
        b[9] = 0.590_043_6 * y * (3.0 * x * x - y * y);
        b[10] = 2.890_611_4 * x * y * z;
        b[11] = 0.457_045_8 * y * (5.0 * z * z - 1.0);
        b[12] = 0.373_176_33 * z * (5.0 * z * z - 3.0);
        b[13] = 0.457_045_8 * x * (5.0 * z * z - 1.0);
        b[14] = 1.445_305_7 * z * (x * x - y * y);
        b[15] = 0.590_043_6 * x * (x * x - 3.0 * y * y);
    }
    if order >= Order::L4 {
        let (x2, y2, z2) = (x * x, y * y, z * z);
        b[16] = 2.503_343 * x * y * (x2 - y2);
        b[17] = 1.770_130_8 * y * z * (3.0 * x2 - y2);
        b[18] = 0.946_174_7 * x * y * (7.0 * z2 - 1.0);
        b[19] = 0.669_046_5 * y * z * (7.0 * z2 - 3.0);
        b[20] = 0.105_785_55 * (35.0 * z2 * z2 - 30.0 * z2 + 3.0);
        b[21] = 0.669_046_5 * x * z * (7.0 * z2 - 3.0);
        b[22] = 0.473_087_35 * (x2 - y2) * (7.0 * z2 - 1.0);
        b[23] = 1.770_130_8 * x * z * (x2 - 3.0 * y2);
        b[24] = 0.625_835_7 * (x2 * (x2 - 3.0 * y2) - y2 * (3.0 * x2 - y2));
    }
    b
}

/// What irradiance on a surface with the unit vector `normal` takes of each coefficient.
pub fn cosine_basis(order: Order, normal: Vec3) -> [f32; MAX_COEFFICIENTS] {
    let mut basis = basis(order, normal);
    basis.iter_mut().zip(BAND).for_each(|(b, l)| *b *= COSINE[l]);
    basis
}

/// The band l of each coefficient.
pub const BAND: [usize; MAX_COEFFICIENTS] = {
    let mut band = [0; MAX_COEFFICIENTS];
    let mut i = 1;
    while i < MAX_COEFFICIENTS {
        band[i] = band[i - 1] + (i == (band[i - 1] + 1) * (band[i - 1] + 1)) as usize;
        i += 1;
    }
    band
};

/// Coloured light from all directions: coefficients (r, g, b) of radiance, cd/m².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sh {
    /// Order of the expansion.
    pub order: Order,
    /// The first `order.coefficients()` count; the others are 0.
    pub coefficients: [Vec3; MAX_COEFFICIENTS],
}

impl Sh {
    /// No light.
    pub const fn dark(order: Order) -> Self {
        Self { order, coefficients: [Vec3::ZERO; MAX_COEFFICIENTS] }
    }

    /// Of a probe's coefficients; missing ones are 0, those beyond `order` are left out.
    pub fn new(order: Order, coefficients: &[Vec3]) -> Self {
        let mut sh = Self::dark(order);
        for (own, given) in sh.values_mut().iter_mut().zip(coefficients) {
            *own = *given;
        }
        sh
    }

    /// The coefficients that count.
    pub fn values(&self) -> &[Vec3] {
        &self.coefficients[..self.order.coefficients()]
    }

    /// The coefficients that count, to be set.
    pub fn values_mut(&mut self) -> &mut [Vec3] {
        &mut self.coefficients[..self.order.coefficients()]
    }

    /// Radiance from the unit vector `direction`, cd/m². Truncated expansions ring: it can be
    /// negative.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let basis = basis(self.order, direction);
        self.values().iter().zip(basis).map(|(c, b)| *c * b).sum()
    }

    /// Light convolved by a lobe (see [`crate::zh`]).
    pub fn convolved(&self, bands: &Bands) -> Self {
        let mut result = *self;
        convolve(&mut result.coefficients, bands);
        result
    }

    /// Irradiance on a surface with the unit vector `normal`, lux. Reflected by a Lambert surface
    /// of albedo ρ it is the radiance ρ/π times this.
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        self.values().iter().zip(cosine_basis(self.order, normal)).map(|(c, b)| *c * b).sum()
    }

    /// Adds `weight` times `other`, whose order may be another; the higher one holds.
    pub fn add_scaled(&mut self, other: &Self, weight: f32) {
        self.order = self.order.max(other.order);
        for (own, c) in self.coefficients.iter_mut().zip(other.values()) {
            *own += *c * weight;
        }
    }
}

/// Convolves the coefficients of an expansion by a lobe.
pub(crate) fn convolve(coefficients: &mut [Vec3], bands: &Bands) {
    coefficients.iter_mut().zip(BAND).for_each(|(c, l)| *c *= bands[l]);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions that are not special in any way.
    pub(super) const DIRECTIONS: [Vec3; 4] = [
        Vec3::new(0.267_261_24, 0.534_522_5, 0.801_783_7),
        Vec3::new(-0.870_388_3, 0.348_155_3, 0.348_155_3),
        Vec3::new(0.0, -1.0, 0.0),
        Vec3::new(0.577_350_3, -0.577_350_3, -0.577_350_3),
    ];

    #[test]
    fn the_basis_is_orthonormal() {
        let mut products = [[0.0_f64; MAX_COEFFICIENTS]; MAX_COEFFICIENTS];
        for (direction, weight) in quadrature() {
            let basis = basis(Order::L4, direction);
            for (row, a) in products.iter_mut().zip(basis) {
                for (product, b) in row.iter_mut().zip(basis) {
                    *product += f64::from(weight) * f64::from(a) * f64::from(b);
                }
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                assert!((product - f64::from(i == j)).abs() < 2e-6, "{i} {j}: {product}");
            }
        }
    }

    #[test]
    fn constant_light_is_its_own_expansion() {
        let light = project(Order::L4, |_| Vec3::new(3.0, 1.0, 0.5));
        let c0 = 2.0 * std::f32::consts::PI.sqrt();
        assert!((light.coefficients[0] - c0 * Vec3::new(3.0, 1.0, 0.5)).length() < 1e-5);
        assert!(light.coefficients[1..].iter().all(|c| c.length() < 1e-5));
        for direction in DIRECTIONS {
            assert!((light.radiance(direction).x - 3.0).abs() < 1e-5);
            assert!((light.irradiance(direction).y - std::f32::consts::PI).abs() < 1e-5);
        }
    }

    #[test]
    fn light_from_one_side_gives_the_irradiance_of_its_integral() {
        // Radiance 1 + z: irradiance on a normal n is π + 2π/3 · n.z.
        let light = project(Order::L1, |d| Vec3::splat(1.0 + d.z));
        for normal in DIRECTIONS {
            let exact = std::f32::consts::PI * (1.0 + normal.z * 2.0 / 3.0);
            assert!((light.irradiance(normal).x - exact).abs() < 1e-5);
        }
    }

    /// three.js's shGetIrradianceAt (src/renderers/shaders/ShaderChunk/lights_pars_begin.glsl.js).
    fn three_irradiance(c: &[Vec3], n: Vec3) -> Vec3 {
        let Vec3 { x, y, z } = n;
        c[0] * 0.886_227
            + c[1] * 2.0 * 0.511_664 * y
            + c[2] * 2.0 * 0.511_664 * z
            + c[3] * 2.0 * 0.511_664 * x
            + c[4] * 2.0 * 0.429_043 * x * y
            + c[5] * 2.0 * 0.429_043 * y * z
            + c[6] * (0.743_125 * z * z - 0.247_708)
            + c[7] * 2.0 * 0.429_043 * x * z
            + c[8] * 0.429_043 * (x * x - y * y)
    }

    #[test]
    fn three_js_computes_the_same_irradiance() {
        for i in 0..9 {
            let mut light = Sh::dark(Order::L2);
            light.coefficients[i] = Vec3::new(1.0, 2.0, -3.0);
            for normal in DIRECTIONS {
                let difference =
                    light.irradiance(normal) - three_irradiance(&light.coefficients, normal);
                assert!(difference.length() < 1e-5, "{i} {normal}: {difference}");
            }
        }
    }

    #[test]
    fn a_mirror_s_lobe_leaves_light_nearly_as_it_is() {
        let light = project(Order::L4, |d| Vec3::splat(1.0 + d.x * d.y + d.z.powi(3)));
        let mirrored = light.convolved(&crate::zh::ggx(0.0));
        let rough = light.convolved(&crate::zh::ggx(1.0));
        for direction in DIRECTIONS {
            assert!((mirrored.radiance(direction) - light.radiance(direction)).length() < 2e-3);
            let lambert = light.irradiance(direction) / std::f32::consts::PI;
            assert!((rough.radiance(direction) - lambert).length() < 2e-3);
        }
    }
}
