//! FLIP of pictures with more range than a display.

use rayon::prelude::*;

use super::observer::Observer;
use super::{ErrorMap, of_linear};
use crate::tone::filmic;
use crate::{Pair, Picture, luminance};

/// The tone-mapped luminance that the brightest pixel has at the first exposure, and the median at
/// the last (t).
const TARGET: f64 = 0.85;
/// The least luminance that counts, in whatever unit the picture has. Where half the reference is
/// black there are some 23 exposures for a picture whose brightest pixel is 1.
const LEAST: f32 = f32::EPSILON;

/// What HDR-FLIP found.
#[derive(Clone, Debug, PartialEq)]
pub struct HdrFlip {
    /// The largest error of each pixel at any exposure.
    pub map: ErrorMap,
    /// First exposure, as a power of 2.
    pub start: f32,
    /// Last exposure, as a power of 2.
    pub stop: f32,
    /// Exposures, at least 2, evenly from the first to the last.
    pub exposures: u32,
}

/// FLIP of linear colour: the maximum over the exposures at which anything of the reference can be
/// seen, each tone-mapped by the ACES curve of [`crate::ToneMap::Filmic`]. Andersson et al.,
/// *Visualizing Errors in Rendered High Dynamic Range Images* (2021). Negative light
/// counts as none. About the cost of [`super::flip`] per exposure.
pub fn hdr_flip(linear: &Pair<'_>, pixels_per_degree: f32) -> HdrFlip {
    let observer = Observer::new(pixels_per_degree);
    let (start, stop) = range(linear.reference());
    let exposures = ((stop - start).ceil() as u32).max(2);
    let mut map: Option<ErrorMap> = None;
    for i in 0..exposures {
        let factor = (start + (stop - start) * i as f32 / (exposures - 1) as f32).exp2();
        let shown = |of: &Picture| of.map(|p| filmic(p.max(glam::Vec3::ZERO) * factor));
        let error = of_linear(&shown(linear.reference()), &shown(linear.picture()), &observer);
        map = Some(match map {
            None => error,
            Some(mut largest) => {
                let pairs = largest.values.par_iter_mut().zip(&error.values);
                pairs.for_each(|(largest, new)| *largest = largest.max(*new));
                largest
            }
        });
    }
    let map = map.unwrap_or(ErrorMap { width: 1, values: vec![0.0] });
    HdrFlip { map, start, stop, exposures }
}

/// The exposures, powers of 2, that bring the largest and the median luminance to the target; of
/// an even number the median is the upper of the two in the middle.
fn range(reference: &Picture) -> (f32, f32) {
    let mut values: Vec<f32> =
        reference.pixels().par_iter().map(|p| luminance(p.max(glam::Vec3::ZERO))).collect();
    let half = values.len() / 2;
    let (_, &mut median, above) = values.select_nth_unstable_by(half, f32::total_cmp);
    let largest = above.iter().copied().fold(median, f32::max);
    let white = seen_at_target();
    let exposure = |of: f32| (white / f64::from(of.max(LEAST))).log2() as f32;
    (exposure(largest), exposure(median))
}

/// The linear value whose tone-mapped one is the target: the root of the quadratic that
/// [`filmic`]'s quotient makes of it.
fn seen_at_target() -> f64 {
    let a = 2.51 - TARGET * 2.43;
    let b = 0.03 - TARGET * 0.59;
    let c = -TARGET * 0.14;
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a) / 0.6
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn exposures_bring_the_largest_and_the_median_to_the_target() {
        assert!((filmic(Vec3::splat(seen_at_target() as f32)).x - 0.85).abs() < 1e-5);
        let reference = Picture::from_fn(5, 1, |x, _| Vec3::splat((1 << (4 * x)) as f32));
        let (start, stop) = range(&reference);
        let shown = |stops: f32, light: f32| filmic(Vec3::splat(light * stops.exp2())).x;
        assert!((shown(start, 65_536.0) - 0.85).abs() < 1e-4);
        assert!((shown(stop, 256.0) - 0.85).abs() < 1e-4);
    }

    #[test]
    fn black_and_flat_pictures_have_figures() {
        for value in [0.0, -1.0, 1e-30, 5.0, 1e30] {
            let flat = Picture::from_fn(4, 4, |_, _| Vec3::splat(value));
            let pair = Pair::new(&flat, &flat).expect("the same");
            let found = hdr_flip(&pair, 67.0);
            assert_eq!((found.map.mean(), found.exposures), (0.0, 2), "{value}");
        }
        let (black, lit) =
            (Picture::from_fn(4, 4, |_, _| Vec3::ZERO), Picture::from_fn(4, 4, |_, _| Vec3::ONE));
        let found = hdr_flip(&Pair::new(&black, &lit).expect("of one size"), 67.0);
        assert!(found.map.mean() > 0.9, "{}", found.map.mean());
    }
}
