//! How densely lumels lie on a scene's surfaces.

use serde::{Deserialize, Serialize};

use crate::limits;

/// How densely lumels lie, as a scene asks for it: `{ "size": 512 }` or `{ "texel": 0.1 }`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightmapSpec {
    /// As many as fit on one square page of so many lumels a side.
    Size(u32),
    /// One every so many metres, on as many pages as that takes.
    Texel(f32),
}

impl Default for LightmapSpec {
    /// A lumel every [`LightmapSpec::TEXEL`].
    fn default() -> Self {
        Self::Texel(Self::TEXEL)
    }
}

impl LightmapSpec {
    /// Side of a lumel where nothing else is asked for, metres.
    pub const TEXEL: f32 = 0.1;

    /// Whether it makes sense; the reason when it does not.
    pub fn check(&self) -> Result<(), String> {
        match *self {
            Self::Size(size) if !limits::PAGE_SIZES.contains(&size) || size % 16 != 0 => {
                let (least, most) = (limits::PAGE_SIZES.start(), limits::PAGE_SIZES.end());
                Err(format!(
                    "its size is {size}; a page has {least} to {most} lumels a side, a multiple of 16"
                ))
            }
            Self::Texel(texel) if !(texel > 0.0 && texel.is_finite()) => {
                Err(format!("its texel is {texel} metres; it has to be more than 0"))
            }
            Self::Size(_) | Self::Texel(_) => Ok(()),
        }
    }
}
