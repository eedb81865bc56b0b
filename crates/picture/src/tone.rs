//! From linear light to the codes that a display is sent, and back.

use std::fmt;
use std::str::FromStr;

use glam::Vec3;

use crate::luminance;

/// How linear colour becomes display codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToneMap {
    /// Clamped, then v^(1/2.2): what errors are measured on (`docs/drawing.md`).
    Gamma,
    /// Clamped, then the curve of sRGB (IEC 61966-2-1).
    #[default]
    Srgb,
    /// L / (1 + L) of luminance (Reinhard et al. 2002, equation 3), then sRGB. Colours keep their
    /// chromaticity unless that lies outside the display's range.
    Reinhard,
    /// Narkowicz's fit of the ACES reference rendering transform (*ACES Filmic Tone Mapping Curve*,
    /// 2016), per channel, with the exposure of 0.6 at which it matches it; then sRGB.
    Filmic,
    /// Khronos PBR Neutral: colours below 0.8 are shown as they are, above they are compressed and
    /// fade to white; then sRGB.
    Neutral,
}

impl ToneMap {
    /// All there are.
    pub const ALL: [Self; 5] =
        [Self::Gamma, Self::Srgb, Self::Reinhard, Self::Filmic, Self::Neutral];

    /// As it is called on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gamma => "gamma",
            Self::Srgb => "srgb",
            Self::Reinhard => "reinhard",
            Self::Filmic => "filmic",
            Self::Neutral => "neutral",
        }
    }

    /// Display codes, 0 to 1, of linear colour of which 1 is white. Negative light is black.
    pub fn encode(self, linear: Vec3) -> Vec3 {
        let linear = linear.max(Vec3::ZERO);
        match self {
            Self::Gamma => gamma_code(linear.min(Vec3::ONE)),
            Self::Srgb => srgb_from_linear(linear.min(Vec3::ONE)),
            Self::Reinhard => srgb_from_linear((linear / (1.0 + luminance(linear))).min(Vec3::ONE)),
            Self::Filmic => srgb_from_linear(filmic(linear)),
            Self::Neutral => srgb_from_linear(neutral(linear).min(Vec3::ONE)),
        }
    }
}

impl fmt::Display for ToneMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for ToneMap {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|t| t.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            format!("there is no tone map {name:?}; there are {known}")
        })
    }
}

/// v^(1/2.2) of each channel, neither clamped nor broken off at 0: negative light has the negative
/// of its magnitude's code.
pub fn gamma_code(linear: Vec3) -> Vec3 {
    Vec3::from(linear.to_array().map(|v| v.abs().powf(1.0 / 2.2).copysign(v)))
}

/// Codes of sRGB (IEC 61966-2-1) of linear colour; beyond 1 the curve goes on, below 0 the line.
pub fn srgb_from_linear(linear: Vec3) -> Vec3 {
    Vec3::from(
        linear
            .to_array()
            .map(|v| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }),
    )
}

/// Linear colour of codes of sRGB.
pub fn linear_from_srgb(code: Vec3) -> Vec3 {
    Vec3::from(
        code.to_array()
            .map(|v| if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }),
    )
}

/// Narkowicz's curve at exposure 0.6, 0 to 1. Beyond 1e4 it is 1.
pub(crate) fn filmic(linear: Vec3) -> Vec3 {
    let x = 0.6 * linear.min(Vec3::splat(1e4));
    let mapped = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
    mapped.clamp(Vec3::ZERO, Vec3::ONE)
}

/// Khronos PBR Neutral (KhronosGroup/ToneMapping, `PBR_Neutral/README.md`).
fn neutral(linear: Vec3) -> Vec3 {
    /// Reflectance of dielectrics at normal incidence, which the map takes away.
    const F90: f32 = 0.04;
    /// Where compression begins.
    const START: f32 = 0.8 - F90;
    /// How fast bright colours fade to white.
    const DESATURATION: f32 = 0.15;

    let linear = linear.min(Vec3::splat(1e9));
    let least = linear.min_element();
    let offset = if least < 2.0 * F90 { least - least * least / (4.0 * F90) } else { F90 };
    let colour = linear - offset;
    let peak = colour.max_element();
    if peak < START {
        return colour;
    }
    let room = 1.0 - START;
    let compressed = 1.0 - room * room / (peak + room - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    (colour * (compressed / peak)).lerp(Vec3::splat(compressed), white)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_codes_and_grow_with_light() {
        for map in ToneMap::ALL {
            assert_eq!(map.name().parse(), Ok(map));
            let mut last = -1.0;
            for step in 0..2000 {
                let code = map.encode(Vec3::splat(1.02_f32.powi(step - 1000)));
                assert!(code.cmpge(Vec3::ZERO).all() && code.cmple(Vec3::ONE).all(), "{map}");
                // An ulp of the codes of a tone map that has come to its end.
                assert!(code.x >= last - 2e-7, "{map} at step {step}: {} after {last}", code.x);
                last = code.x;
            }
            assert_eq!(map.encode(Vec3::splat(-1.0)), map.encode(Vec3::ZERO));
            assert!(map.encode(Vec3::ZERO).max_element() < 1e-6);
            assert!(last > 0.99, "{map}: {last}");
        }
        assert!("bloom".parse::<ToneMap>().expect_err("unknown").contains("neutral"));
    }

    #[test]
    fn published_values() {
        let close = |a: Vec3, b: [f32; 3]| {
            assert!((a - Vec3::from(b)).abs().max_element() < 2e-4, "{a} {b:?}");
        };
        close(ToneMap::Gamma.encode(Vec3::new(0.5, 1.0, 2.0)), [0.729_74, 1.0, 1.0]);
        // Half of sRGB's codes is 21.4 % of the light.
        close(linear_from_srgb(Vec3::splat(0.5)), [0.214_04; 3]);
        close(srgb_from_linear(Vec3::new(0.001, 0.214_04, 1.0)), [0.012_92, 0.5, 1.0]);
        // A grey of luminance 1 becomes one of ½.
        close(ToneMap::Reinhard.encode(Vec3::ONE), [0.735_36; 3]);
        // x = 0.6: 0.9216 / 1.3688 = 0.67329.
        close(filmic(Vec3::ONE), [0.673_29; 3]);
        // A base colour below 0.8, seen with its 4 % of reflection, comes out as itself.
        close(neutral(Vec3::new(0.5, 0.3, 0.2) + 0.04), [0.5, 0.3, 0.2]);
        assert!(neutral(Vec3::new(100.0, 10.0, 1.0)).min_element() > 0.8, "fades to white");
    }

    #[test]
    fn srgb_goes_and_comes_back() {
        for i in -20..=300 {
            let v = Vec3::splat(i as f32 / 100.0);
            assert!((linear_from_srgb(srgb_from_linear(v)) - v).abs().max_element() < 1e-5, "{v}");
        }
    }
}
