//! What pictures are drawn with.

use std::str::FromStr;

#[cfg(feature = "gpu")]
use lumencast_shade::Occlusion;

/// A factor on radiance; none where a picture is to tell it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exposure(pub(crate) Option<f32>);

impl FromStr for Exposure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self(None));
        }
        match text.parse() {
            Ok(factor) if factor > 0.0 && f32::is_finite(factor) => Ok(Self(Some(factor))),
            _ => Err("give auto or a positive number".into()),
        }
    }
}

/// Ambient occlusion that reaches so far.
#[cfg(feature = "gpu")]
pub(crate) fn occlusion(radius: f32) -> Option<Occlusion> {
    (radius > 0.0).then(|| Occlusion { radius, ..Occlusion::default() })
}
