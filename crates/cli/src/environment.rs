//! An environment as given on the command line.

use std::str::FromStr;

use anyhow::{Context, Result, bail, ensure};
use glam::Vec3;
use lumencast_scene::Environment;

use crate::arguments::parse_point;

/// `sky:LUX`, `R,G,B` or the name of a picture.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EnvironmentArgument(pub(crate) Environment);

impl FromStr for EnvironmentArgument {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let environment = if let Some(lux) = text.strip_prefix("sky:") {
            sky(lux.parse().with_context(|| format!("{lux:?}: a sky's light is given in lux"))?)
        } else if [".hdr", ".exr"].iter().any(|end| text.to_ascii_lowercase().ends_with(end)) {
            Environment::Image { uri: text.into(), intensity: 1.0, rotation: 0.0, image: None }
        } else if text.contains(',') {
            Environment::Constant { radiance: parse_point(text)? }
        } else {
            bail!("{text:?}: sky:LUX, a colour R,G,B in cd/m², or an .hdr or .exr file is needed");
        };
        ensure!(environment.check().is_ok(), "{text:?}: light is 0 or more, and finite");
        Ok(Self(environment))
    }
}

/// A clear sky that gives level ground so many lux.
fn sky(lux: f32) -> Environment {
    const ZENITH: Vec3 = Vec3::new(0.45, 0.65, 1.0);
    const HORIZON: Vec3 = Vec3::new(0.85, 0.93, 1.0);
    const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);
    /// Of what the horizon gives, what the ground below it sends back up.
    const GROUND: f32 = 0.3;
    // ∫ L cos over the upper half, for L linear in the sine of the elevation.
    let unit = std::f32::consts::PI * (HORIZON / 3.0 + 2.0 * ZENITH / 3.0).dot(LUMINANCE);
    let scale = lux / unit;
    let (zenith, horizon) = (scale * ZENITH, scale * HORIZON);
    Environment::Sky { zenith, horizon, ground: GROUND * horizon }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms() {
        let parse = |text: &str| text.parse::<EnvironmentArgument>().map(|e| e.0);
        let constant = Environment::Constant { radiance: Vec3::new(1.0, 0.5, 0.0) };
        assert_eq!(parse("1,0.5,0").expect("a colour"), constant);
        assert!(matches!(parse("a/b.HDR").expect("a picture"), Environment::Image { .. }));
        for wrong in ["", "sky", "sky:", "sky:-1", "sky:NaN", "1,2", "1,-2,3", "sky.png", "blue"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_sky_gives_its_lux() {
        let Environment::Sky { zenith, horizon, .. } = sky(1000.0) else { panic!("no sky") };
        // Midpoint rule over rings of equal sin² of the elevation, each of cosine weight π/n.
        let n = 1000;
        let irradiance: Vec3 = (0..n)
            .map(|i| ((i as f32 + 0.5) / n as f32).sqrt())
            .map(|up| horizon.lerp(zenith, up) * std::f32::consts::PI / n as f32)
            .sum();
        let lux = irradiance.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        assert!((lux / 1000.0 - 1.0).abs() < 1e-3, "{lux}");
    }
}
