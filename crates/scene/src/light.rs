//! Punctual lights.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::{NodeId, limits};

/// A punctual light as in KHR_lights_punctual. It shines along its node's −Z.
///
/// It may have a size, which glTF does not define; the loader reads it from the light's
/// `extras.lumencast`. Intensity means the same for any size: it gives the illuminance of a surface
/// that faces the light's centre and sees all of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PunctualLight {
    /// Point, spot or directional.
    #[serde(flatten)]
    pub kind: LightKind,
    /// Linear colour, each channel ≥ 0.
    #[serde(default = "white")]
    pub color: Vec3,
    /// Candela (point, spot) or lux on a surface that faces it (directional); ≥ 0.
    #[serde(default = "one")]
    pub intensity: f32,
    /// Distance in metres at which the light has faded to zero, as KHR_lights_punctual recommends;
    /// infinite when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<f32>,
}

impl PunctualLight {
    /// Whether the light gives any light.
    pub(crate) fn shines(&self) -> bool {
        self.intensity > 0.0 && self.color != Vec3::ZERO
    }

    /// Checks values against their ranges.
    ///
    /// # Errors
    /// The reason why the light makes no sense.
    pub fn check(&self) -> Result<(), String> {
        let Self { kind, color, intensity, range } = *self;
        if !(0.0..=limits::LIGHT).contains(&intensity) {
            return Err(format!(
                "its intensity is {intensity}; 0 to {:e} is possible",
                limits::LIGHT
            ));
        }
        let brightest = color.max_element();
        if !(color.cmpge(Vec3::ZERO).all() && brightest.max(brightest * intensity) <= limits::LIGHT)
        {
            return Err(format!(
                "its colour is {color}; channels are 0 to {:e}, also times its intensity",
                limits::LIGHT
            ));
        }
        if range.is_some_and(|range| !(range > 0.0 && range.is_finite())) {
            return Err("its range has to be finite and more than 0".into());
        }
        if let LightKind::Spot { inner, outer, .. } = kind
            && !(inner >= 0.0 && inner < outer && outer <= FRAC_PI_2 + 1e-6)
        {
            return Err(format!(
                "its cones are {inner} and {outer}; 0 ≤ inner < outer ≤ π/2 is needed"
            ));
        }
        match kind {
            LightKind::Point { radius } | LightKind::Spot { radius, .. }
                if !(0.0..=limits::EXTENT).contains(&radius) =>
            {
                Err(format!("its radius is {radius}; 0 to {:e} m is possible", limits::EXTENT))
            }
            LightKind::Directional { angle } if !(0.0..=PI).contains(&angle) => {
                Err(format!("its angle is {angle}; 0 to π is possible"))
            }
            _ => Ok(()),
        }
    }
}

fn white() -> Vec3 {
    Vec3::ONE
}

fn one() -> f32 {
    1.0
}

/// Takes a reference, as serde requires.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_zero(size: &f32) -> bool {
    *size == 0.0
}

/// The kind of a punctual light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum LightKind {
    /// Shines equally in all directions.
    Point {
        /// Radius of the luminous sphere, metres; 0 for a point.
        #[serde(default, skip_serializing_if = "is_zero")]
        radius: f32,
    },
    /// Shines in a cone; falloff between the half-angles (radians) as in KHR_lights_punctual.
    Spot {
        /// Half-angle where falloff begins, 0 ≤ inner < outer.
        inner: f32,
        /// Half-angle where the light ends, at most π/2.
        outer: f32,
        /// Radius of the luminous sphere, metres; 0 for a point. The falloff depends on the
        /// direction from the sphere's centre.
        #[serde(default, skip_serializing_if = "is_zero")]
        radius: f32,
    },
    /// Light from infinitely far.
    Directional {
        /// Angular diameter of the luminous disc, radians: 0.0093 for the sun, at most π; 0 for
        /// parallel light.
        #[serde(default, skip_serializing_if = "is_zero")]
        angle: f32,
    },
}

impl LightKind {
    /// Sets the sizes that are given. The error says that the kind of light has no such size.
    pub(crate) fn resize(
        &mut self,
        new_radius: Option<f32>,
        new_angle: Option<f32>,
    ) -> Result<(), &'static str> {
        match self {
            Self::Point { radius } | Self::Spot { radius, .. } => {
                if new_angle.is_some() {
                    return Err("only directional lights have an angle");
                }
                *radius = new_radius.unwrap_or(*radius);
            }
            Self::Directional { angle } => {
                if new_radius.is_some() {
                    return Err("only point and spot lights have a radius");
                }
                *angle = new_angle.unwrap_or(*angle);
            }
        }
        Ok(())
    }
}

/// A light at its place in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedLight {
    /// The node that carries it.
    pub node: NodeId,
    /// Its properties.
    pub light: PunctualLight,
    /// World position, metres.
    pub position: Vec3,
    /// Unit vector along which the light shines.
    pub direction: Vec3,
}
