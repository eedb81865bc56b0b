//! False colours.

use glam::Vec3;

/// Every seventeenth of the 256 colours, first and last among them: 8-bit codes of sRGB.
const MAGMA: [[u8; 3]; 16] = [
    [0, 0, 4],
    [11, 9, 36],
    [32, 17, 75],
    [59, 15, 112],
    [87, 21, 126],
    [114, 31, 129],
    [140, 41, 129],
    [168, 50, 125],
    [196, 60, 117],
    [222, 73, 104],
    [241, 96, 93],
    [250, 127, 94],
    [254, 159, 109],
    [254, 191, 132],
    [253, 222, 160],
    [252, 253, 191],
];

/// The colour map *magma* (Smith and van der Walt 2015, in the public domain): codes of sRGB for 0
/// to 1, black over purple and orange to pale yellow, ever lighter. Interpolated between 16 of the
/// 256 published colours, at most 2.2 of 255 steps off the others.
pub fn magma(value: f32) -> Vec3 {
    let at = value.clamp(0.0, 1.0) * (MAGMA.len() - 1) as f32;
    let low = (at as usize).min(MAGMA.len() - 2);
    let colour = |i: usize| Vec3::from(MAGMA[i].map(f32::from)) / 255.0;
    colour(low).lerp(colour(low + 1), at - low as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_between_are_near_the_published_ones() {
        for (index, published) in [
            (0, [0.0, 0.0, 0.0138]),
            (40, [0.159, 0.0684, 0.3527]),
            (100, [0.5378, 0.1569, 0.5066]),
            (150, [0.8521, 0.2761, 0.4186]),
            (230, [0.9957, 0.8127, 0.5726]),
            (255, [0.9871, 0.9914, 0.7495]),
        ] {
            let off = magma(index as f32 / 255.0) - Vec3::from(published);
            assert!(off.abs().max_element() < 0.009, "{index}: {off}");
        }
        assert_eq!(magma(-1.0), magma(0.0));
        assert_eq!(magma(2.0), magma(1.0));
        assert!(magma(f32::NAN).is_nan());
    }
}
