//! Irradiance as the integers that are coded.
//!
//! Value / 2^scale is rounded to a half float. The bits of halves that are not negative, seen as
//! integers, grow with the value. Red, green and blue are then turned into Y, Co and Cg by whole
//! numbers alone, so that nothing is lost (YCoCg-R: Malvar and Sullivan 2003).

use glam::Vec3;
use half::f16;

/// The largest finite half, 65504, as an integer.
const LARGEST: i32 = 0x7BFF;

/// Y, Co and Cg of a lumel: 0 to 0x7BFF, and −0x7BFF to 0x7BFF.
pub(crate) type Lumel = [i16; 3];

/// A lumel's integers. What is negative or no number becomes 0, what is too large the largest half.
pub(crate) fn from_rgb(irradiance: Vec3, scale_log2: i8) -> Lumel {
    let inverse_scale = (-f64::from(scale_log2)).exp2();
    let [r, g, b] = irradiance.to_array().map(|value| {
        let scaled = f64::from(value) * inverse_scale;
        let bounded = scaled.min(f16::MAX.into());
        if scaled > 0.0 { i32::from(f16::from_f64(bounded).to_bits()) } else { 0 }
    });
    let co = r - b;
    let t = b + (co >> 1);
    let cg = g - t;
    [t + (cg >> 1), co, cg].map(|channel| channel as i16)
}

/// Irradiance of a lumel, in f64 rounded once; not finite where it is beyond f32.
pub(crate) fn to_rgb(lumel: Lumel, scale_log2: i8) -> Vec3 {
    let scale = f64::from(scale_log2).exp2();
    let value = |half: i32| (f16::from_bits(half as u16).to_f64() * scale) as f32;
    Vec3::from_array(halves(lumel.map(i32::from)).map(value))
}

/// A lumel of such channels; nothing where its halves are none.
pub(crate) fn lumel(channels: [i32; 3]) -> Option<Lumel> {
    let is_half = |half: i32| (0..=LARGEST).contains(&half);
    halves(channels).into_iter().all(is_half).then(|| channels.map(|channel| channel as i16))
}

/// Red, green and blue as integers.
fn halves([y, co, cg]: [i32; 3]) -> [i32; 3] {
    let t = y - (cg >> 1);
    let b = t - (co >> 1);
    [b + co, t + cg, b]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_survive() {
        let halves = [0, 1, 2, 1023, 1024, 1025, 15_360, 31_742, LARGEST];
        for number in 0..halves.len().pow(3) {
            let [r, g, b] = [1, 9, 81].map(|step| halves[number / step % halves.len()]);
            let value = |half: i32| f16::from_bits(half as u16).to_f32();
            let colour = Vec3::new(value(r), value(g), value(b));
            for scale_log2 in [0, 16, -20, 100] {
                let scaled = colour * f32::from(scale_log2).exp2();
                let coded = from_rgb(scaled, scale_log2);
                assert_eq!(to_rgb(coded, scale_log2), scaled);
                assert_eq!(lumel(coded.map(i32::from)), Some(coded));
            }
        }
    }

    #[test]
    fn values_are_rounded_to_even_and_bounded() {
        let half = |value: f32, scale_log2| from_rgb(Vec3::splat(value), scale_log2);
        // Steps of halves between 2048 and 4096 are 2.
        assert_eq!(half(2049.0, 0), half(2048.0, 0));
        assert_eq!(half(2051.0, 0), half(2052.0, 0));
        assert_eq!(half(2049.0 * 16.0, 4), half(2048.0, 0));
        for (value, becomes) in [
            (f32::NAN, 0.0),
            (-1.0, 0.0),
            (-0.0, 0.0),
            (f32::NEG_INFINITY, 0.0),
            (65_519.0, 65_504.0),
            (70_000.0, 65_504.0),
            (f32::INFINITY, 65_504.0),
        ] {
            assert_eq!(to_rgb(half(value, 0), 0), Vec3::splat(becomes), "{value}");
        }
        // The extremes of the scale.
        assert_eq!(half(f32::MAX, 127), half(2.0, 0));
        assert_eq!(to_rgb(half(f32::MIN_POSITIVE, -128), -128), Vec3::splat(f32::MIN_POSITIVE));
        assert!(!to_rgb(half(65_504.0, 0), 127).is_finite());
    }

    #[test]
    fn channels_of_no_halves_are_refused() {
        assert_eq!(lumel([LARGEST, 0, 0]), Some([0x7BFF, 0, 0]));
        for channels in [[LARGEST + 1, 0, 0], [-1, 0, 0], [0, 5, 0], [100, 0, 1000], [1 << 20; 3]] {
            assert_eq!(lumel(channels), None, "{channels:?}");
        }
    }
}
