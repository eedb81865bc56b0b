//! An environment as given on the command line.

use std::str::FromStr;

use anyhow::{Context, Result, bail, ensure};
use lumencast_scene::Environment;

use crate::values::parse_point;

/// `sky:LUX`, `R,G,B` or the name of a picture.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EnvironmentArgument(pub(crate) Environment);

impl FromStr for EnvironmentArgument {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let environment = if let Some(lux) = text.strip_prefix("sky:") {
            Environment::clear_sky(
                lux.parse().with_context(|| format!("{lux:?}: a sky's light is given in lux"))?,
            )
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

#[cfg(test)]
mod tests {
    use glam::Vec3;

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
}
