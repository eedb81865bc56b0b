//! The environment: light from infinitely far, by direction.

use std::sync::Arc;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::limits;

/// The environment: radiance (cd/m²) as a function of direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Environment {
    /// The same radiance from every direction.
    Constant {
        /// cd/m², each channel ≥ 0.
        radiance: Vec3,
    },
    /// A gradient by elevation: linear in sin(elevation) from horizon to zenith above, and from
    /// horizon to ground below.
    Sky {
        /// Straight up, cd/m².
        zenith: Vec3,
        /// At the horizon, cd/m².
        horizon: Vec3,
        /// Straight down, cd/m².
        ground: Vec3,
    },
    /// An equirectangular HDR picture. u = 0.5 + atan2(x, −z)/2π, v = acos(y)/π.
    Image {
        /// File name relative to the scene's folder (.hdr or .exr).
        uri: String,
        /// Factor of the picture's texels.
        #[serde(default = "one")]
        intensity: f32,
        /// Rotation of the picture about +Y, radians.
        #[serde(default)]
        rotation: f32,
        /// The picture itself, filled in by the scene when it is read.
        #[serde(skip)]
        image: Option<Arc<HdrImage>>,
    },
}

fn one() -> f32 {
    1.0
}

impl Environment {
    /// No light.
    pub const BLACK: Self = Self::Constant { radiance: Vec3::ZERO };

    /// A clear sky that illuminates level ground with this illuminance.
    pub fn clear_sky(lux: f32) -> Self {
        const ZENITH: Vec3 = Vec3::new(0.45, 0.65, 1.0);
        const HORIZON: Vec3 = Vec3::new(0.85, 0.93, 1.0);
        const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);
        /// Radiance that the ground sends up, as a share of the horizon's.
        const GROUND: f32 = 0.3;
        // This is ∫ L cos over the upper half, for L linear in the sine of the elevation.
        let unit = std::f32::consts::PI * (HORIZON / 3.0 + 2.0 * ZENITH / 3.0).dot(LUMINANCE);
        let scale = lux / unit;
        let (zenith, horizon) = (scale * ZENITH, scale * HORIZON);
        Self::Sky { zenith, horizon, ground: GROUND * horizon }
    }

    /// Whether the environment gives light. A picture's texels are not examined.
    pub(crate) fn shines(&self) -> bool {
        match self {
            Self::Constant { radiance } => *radiance != Vec3::ZERO,
            Self::Sky { zenith, horizon, ground } => {
                [zenith, horizon, ground].into_iter().any(|radiance| *radiance != Vec3::ZERO)
            }
            Self::Image { intensity, .. } => *intensity != 0.0,
        }
    }

    /// Checks values against their ranges.
    ///
    /// # Errors
    /// The reason why the environment makes no sense.
    pub fn check(&self) -> Result<(), String> {
        let is_light = |v: Vec3| v.cmpge(Vec3::ZERO).all() && v.max_element() <= limits::LIGHT;
        let sound = match self {
            Self::Constant { radiance } => is_light(*radiance),
            Self::Sky { zenith, horizon, ground } => {
                [*zenith, *horizon, *ground].into_iter().all(is_light)
            }
            Self::Image { intensity, rotation, .. } => {
                is_light(Vec3::splat(*intensity)) && rotation.is_finite()
            }
        };
        match sound {
            true => Ok(()),
            false => Err(format!("its light has to be within 0 and {:e} cd/m²", limits::LIGHT)),
        }
    }
}

impl Default for Environment {
    fn default() -> Self {
        Self::BLACK
    }
}

/// A floating-point picture, first row at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct HdrImage {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Linear Rec. 709, finite and ≥ 0; `width * height` texels.
    pub texels: Vec<Vec3>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sky_gives_its_lux() {
        let Environment::Sky { zenith, horizon, .. } = Environment::clear_sky(1000.0) else {
            panic!("no sky")
        };
        // The midpoint rule over rings of equal sin² of the elevation, each with cosine weight π/n.
        let n = 1000;
        let irradiance: Vec3 = (0..n)
            .map(|i| ((i as f32 + 0.5) / n as f32).sqrt())
            .map(|up| horizon.lerp(zenith, up) * std::f32::consts::PI / n as f32)
            .sum();
        let lux = irradiance.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        assert!((lux / 1000.0 - 1.0).abs() < 1e-3, "{lux}");
    }

    /// The web page offers the same sky.
    #[test]
    fn the_recorded_sky() {
        let recorded: serde_json::Value =
            serde_json::from_str(include_str!("../../../vectors/sky.json")).expect("JSON");
        let recorded: Environment =
            serde_json::from_value(recorded["environment"].clone()).expect("an environment");
        let (
            Environment::Sky { zenith, horizon, ground },
            Environment::Sky { zenith: z, horizon: h, ground: g },
        ) = (recorded, Environment::clear_sky(1000.0))
        else {
            panic!("no skies")
        };
        for (recorded, found) in [(zenith, z), (horizon, h), (ground, g)] {
            assert!(recorded.abs_diff_eq(found, 1e-3), "{recorded} {found}");
        }
    }
}
