//! Slopes as light: what codes irradiance codes them too.
//!
//! A component from −3 to 3 becomes ½ to 1, between 0 and 1, as if it were lux: `v = (1 + s / 3) / 2`.

use std::borrow::Cow;
use std::ops::Range;

use glam::Vec3;
use lumencast_light::{Lightmap, STEEPEST, Told};

use super::mapping::Mapping;

/// How they become codes of 8 bits: 0 to 1 spans all of them.
pub(crate) const MAPPING: Mapping = Mapping { scale_log2: 0, toe: 0, range: 8 };

/// What a lightmap tells of these of its lumels, as light; slopes that it lacks are 0.
pub(crate) fn as_light(lightmap: &Lightmap, told: Told, lumels: Range<usize>) -> Cow<'_, [Vec3]> {
    match (told, &lightmap.slopes) {
        (Told::Irradiance, _) => Cow::Borrowed(&lightmap.irradiance[lumels]),
        (Told::Slopes, Some(slopes)) => slopes[lumels].iter().map(|slope| coded(*slope)).collect(),
        (Told::Slopes, None) => vec![coded(Vec3::ZERO); lumels.len()].into(),
    }
}

fn coded(slope: Vec3) -> Vec3 {
    let slope = if slope.is_nan() { Vec3::ZERO } else { slope };
    0.5 * (Vec3::ONE + (slope / STEEPEST).clamp(Vec3::NEG_ONE, Vec3::ONE))
}

/// The slope that such light stands for.
pub(crate) fn slope(light: Vec3) -> Vec3 {
    STEEPEST * (2.0 * light.min(Vec3::ONE) - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_survive() {
        for k in -30..=30 {
            let told = Vec3::new(0.1 * k as f32, 0.0, -0.05 * k as f32);
            assert!(slope(coded(told)).abs_diff_eq(told, 1e-5), "{told}");
        }
        assert_eq!(slope(coded(Vec3::new(9.0, -9.0, f32::NAN))), Vec3::ZERO);
        assert_eq!(slope(coded(Vec3::new(9.0, -9.0, 0.0))), Vec3::new(3.0, -3.0, 0.0));
        assert_eq!(slope(Vec3::splat(7.0)), Vec3::splat(3.0), "whatever a frame holds");
    }
}
