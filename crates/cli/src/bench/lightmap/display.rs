//! Light as a display shows it: gamma 2.2, clamped.

use crate::bench::quantile;

/// The quantile that stands for the most of many values.
const MOST: f64 = 0.99;

/// The code of 0 to 255 of a channel or of luminance, not rounded.
pub(super) fn code(light: f32, white: f32) -> f32 {
    255.0 * (light / white).clamp(0.0, 1.0).powf(1.0 / 2.2)
}

/// The 99th percentile of values; nothing where there are none.
pub(super) fn most(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    (!values.is_empty()).then(|| quantile(&values, MOST))
}
