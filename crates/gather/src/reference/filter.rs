//! The reconstruction filter of a picture's pixels.

use std::f32::consts::TAU;

use glam::Vec2;

use crate::sampling::ONE_MINUS_EPSILON;

/// A pixel's reconstruction filter, by distance from the pixel's centre in pixels. Samples are
/// placed with the filter's density and weigh alike (Ernst, Stamminger and Greiner 2006). So
/// neighbouring pixels share no samples, and neither do tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// The pixel's own square, as in multisampling.
    #[default]
    Box,
    /// Falls linearly to 0 at the neighbours' centres.
    Tent,
    /// A Gaussian with σ of half a pixel, cut off at 1.5 pixels.
    Gaussian,
}

impl Filter {
    /// Position of a sample, in pixels from the pixel's centre.
    #[inline]
    pub(crate) fn place(self, u: Vec2) -> Vec2 {
        match self {
            Self::Box => u - 0.5,
            Self::Tent => Vec2::new(tent(u.x), tent(u.y)),
            Self::Gaussian => {
                const SIGMA: f32 = 0.5;
                const RADIUS: f32 = 1.5;
                let inside = 1.0 - (-0.5 * (RADIUS / SIGMA).powi(2)).exp();
                let r = SIGMA * (-2.0 * (1.0 - u.x.min(ONE_MINUS_EPSILON) * inside).ln()).sqrt();
                r * Vec2::from_angle(TAU * u.y)
            }
        }
    }
}

/// Maps a uniform number to one with density 1 − |x|.
fn tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).max(0.0).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(filter: Filter) -> (Vec2, Vec2, f32) {
        let n = 512;
        let places = (0..n * n)
            .map(|i| filter.place((Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) / n as f32));
        let count = (n * n) as f32;
        let (mut mean, mut square, mut largest) = (Vec2::ZERO, Vec2::ZERO, 0.0f32);
        for p in places {
            mean += p / count;
            square += p * p / count;
            largest = largest.max(p.abs().max_element());
        }
        (mean, square, largest)
    }

    #[test]
    fn filters_have_the_variance_of_their_shape() {
        // Variances: box 1/12, tent 1/6. The cut takes from the Gaussian's σ²: its factor is 1 −
        // (R²/2σ²) q/(1 − q), with q = e^(−R²/2σ²).
        let q = (-4.5f32).exp();
        let gaussian = 0.25 * (1.0 - 4.5 * q / (1.0 - q));
        for (filter, variance, radius) in [
            (Filter::Box, 1.0 / 12.0, 0.5),
            (Filter::Tent, 1.0 / 6.0, 1.0),
            (Filter::Gaussian, gaussian, 1.5),
        ] {
            let (mean, square, largest) = moments(filter);
            assert!(mean.abs().max_element() < 2e-3, "{filter:?}: {mean}");
            assert!((square - variance).abs().max_element() < 2e-3, "{filter:?}: {square}");
            assert!(largest <= radius, "{filter:?}: {largest}");
        }
    }
}
