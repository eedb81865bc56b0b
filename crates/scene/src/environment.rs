//! Light from infinitely far, from everywhere.

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
        /// Multiplies the picture.
        #[serde(default = "one")]
        intensity: f32,
        /// Turns the picture about +Y, radians.
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

    /// Whether it makes sense; the reason when it does not.
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
    /// Linear Rec. 709, finite, ≥ 0; `width * height` texels.
    pub texels: Vec<Vec3>,
}
