//! Colour space and quantisation steps (docs/wire.md, "What is coded"). Everything that a decoder
//! computes is exact arithmetic in f64 rounded once to f32, so that every implementation gets the
//! same bits.

use glam::Vec3;

/// Step indices are from −`MAX_STEP` to `MAX_STEP`.
pub(crate) const MAX_STEP: i32 = 400;

/// 1, 2^¼, 2^½, 2^¾, rounded to f32.
const MANTISSAS: [f32; 4] = [1.0, 1.189_207_1, std::f32::consts::SQRT_2, 1.681_792_9];

/// S(q): 2^(q/4) up to rounding, for |q| ≤ `MAX_STEP`.
pub(crate) fn step(q: i32) -> f64 {
    let power_of_two = f64::from_bits(((1023 + i64::from(q.div_euclid(4))) as u64) << 52);
    f64::from(MANTISSAS[q.rem_euclid(4) as usize]) * power_of_two
}

/// The largest step index whose step is at most `size`.
pub(crate) fn step_index(size: f64) -> i32 {
    // NaN and sizes ≤ 0 become the least index by the saturating cast.
    let q = (4.0 * size.log2() + 1e-6).floor();
    if q.is_nan() { -MAX_STEP } else { (q as i32).clamp(-MAX_STEP, MAX_STEP) }
}

/// 1/√3, 1/√2, 1/√6 and 2/√6.
const K3: f64 = 0.577_350_269_189_625_8;
const K2: f64 = std::f64::consts::FRAC_1_SQRT_2;
const K6: f64 = 0.408_248_290_463_863;
const K6_2: f64 = 0.816_496_580_927_726;

/// (r, g, b) → (a, b, c), orthonormal: a is the grey axis.
pub(crate) fn from_rgb(rgb: Vec3) -> [f64; 3] {
    let [r, g, b] = rgb.as_dvec3().to_array();
    [K3 * (r + g + b), K2 * (r - b), K6 * (-r + 2.0 * g - b)]
}

/// (a, b, c) → (r, g, b), computed in f64 from left to right and rounded once.
pub(crate) fn to_rgb([a, b, c]: [f32; 3]) -> Vec3 {
    let (a, b, c) = (K3 * f64::from(a), f64::from(b), f64::from(c));
    let (half, sixth) = (K2 * b, K6 * c);
    Vec3::new((a + half - sixth) as f32, (a + K6_2 * c) as f32, (a - half - sixth) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_round_trip_and_keep_lengths() {
        for rgb in [Vec3::new(1.0, 2.0, 3.0), Vec3::new(-5.0, 0.25, 1e4), Vec3::ZERO] {
            let abc = from_rgb(rgb);
            let length = abc.iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!((length - rgb.as_dvec3().length()).abs() <= 1e-12 * length.max(1.0));
            let back = to_rgb(abc.map(|v| v as f32));
            assert!((back - rgb).length() <= 3e-7 * rgb.length());
        }
    }

    #[test]
    fn steps_double_every_four_and_invert() {
        for q in -MAX_STEP..=MAX_STEP {
            assert!((step(q) / (f64::from(q) / 4.0).exp2() - 1.0).abs() < 1e-7);
            assert_eq!(step_index(step(q)), q);
            assert_eq!(step_index(step(q) * 1.1), q);
        }
        assert_eq!(step(-8), 0.25);
        for bad in [0.0, -1.0, f64::NAN, 1e-300] {
            assert_eq!(step_index(bad), -MAX_STEP);
        }
        assert_eq!(step_index(f64::INFINITY), MAX_STEP);
    }
}
