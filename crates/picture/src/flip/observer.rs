//! What an eye resolves at a distance, as kernels of pixels.

use std::f64::consts::PI;

use crate::plane::{Plane, gaussian, offsets, single};

/// The paper's contrast sensitivities of luminance, red–green and blue–yellow: each a sum of
/// Gaussians a √(π/b) exp(−π² d²/b) of d in degrees.
const ACHROMATIC: &[(f64, f64)] = &[(1.0, 0.0047)];
const RED_GREEN: &[(f64, f64)] = &[(1.0, 0.0053)];
const BLUE_YELLOW: &[(f64, f64)] = &[(34.1, 0.04), (13.5, 0.025)];
/// The largest b of them, which sets how far all kernels reach.
const WIDEST: f64 = 0.04;

/// Degrees from one flank of a feature to the other (w).
const FEATURE_WIDTH: f64 = 0.082;

/// The kernels for one distance.
#[derive(Debug)]
pub(super) struct Observer {
    /// Of luminance, red–green and blue–yellow.
    pub(super) contrast: [Contrast; 3],
    pub(super) feature: Feature,
}

impl Observer {
    pub(super) fn new(pixels_per_degree: f32) -> Self {
        // What is not a number counts as the bound, too.
        let ppd =
            if pixels_per_degree > 1.0 { f64::from(pixels_per_degree).min(1000.0) } else { 1.0 };
        Self {
            contrast: [ACHROMATIC, RED_GREEN, BLUE_YELLOW].map(|of| Contrast::new(of, ppd)),
            feature: Feature::new(ppd),
        }
    }
}

/// A filter by contrast sensitivity: a weighted sum of separable Gaussians, 1 in all.
#[derive(Debug)]
pub(super) struct Contrast(Vec<(f32, Vec<f32>)>);

impl Contrast {
    fn new(gaussians: &[(f64, f64)], ppd: f64) -> Self {
        // Three standard deviations: exp(−π² d²/b) has √(b/2)/π.
        let radius = (3.0 * (WIDEST / 2.0).sqrt() / PI * ppd).ceil() as usize;
        let terms = gaussians.iter().map(|&(a, b)| {
            let sigma = (b / 2.0).sqrt() / PI * ppd;
            let sum: f64 = offsets(radius).map(|x| (-x * x / (2.0 * sigma * sigma)).exp()).sum();
            (a * (PI / b).sqrt() * sum * sum, gaussian(sigma, radius))
        });
        let terms: Vec<_> = terms.collect();
        let total: f64 = terms.iter().map(|(weight, _)| weight).sum();
        Self(terms.into_iter().map(|(w, kernel)| ((w / total) as f32, single(&kernel))).collect())
    }

    pub(super) fn filter(&self, plane: &Plane) -> Plane {
        let mut sum = Plane { width: plane.width, values: vec![0.0; plane.values.len()] };
        for (weight, kernel) in &self.0 {
            let filtered = plane.across(kernel).down(kernel);
            for (sum, value) in sum.values.iter_mut().zip(filtered.values) {
                *sum += weight * value;
            }
        }
        sum
    }
}

/// Detectors of edges and of points: a Gaussian's first and second derivative along one axis times
/// the Gaussian along the other. Positive taps sum to 1, negative ones to −1.
#[derive(Debug)]
pub(super) struct Feature {
    blur: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Feature {
    fn new(ppd: f64) -> Self {
        let sigma = 0.5 * FEATURE_WIDTH * ppd;
        let radius = (3.0 * sigma).ceil() as usize;
        let blur = gaussian(sigma, radius);
        let with = |factor: &dyn Fn(f64) -> f64| -> Vec<f32> {
            let taps: Vec<f64> =
                offsets(radius).zip(&blur).map(|(x, g)| factor(x / sigma) * g).collect();
            let total = |sign: f64| taps.iter().map(|t| (sign * t).max(0.0)).sum::<f64>();
            let (positive, negative) = (total(1.0), total(-1.0));
            single(
                &taps
                    .iter()
                    .map(|t| t / if *t > 0.0 { positive } else { negative })
                    .collect::<Vec<_>>(),
            )
        };
        Self { edge: with(&|x| -x), point: with(&|x| x * x - 1.0), blur: single(&blur) }
    }

    /// How strong an edge and a point each pixel is, from 0 up.
    pub(super) fn detect(&self, luminance: &Plane) -> [Vec<f32>; 2] {
        let blurred = luminance.across(&self.blur);
        [&self.edge, &self.point].map(|kernel| {
            let across = luminance.across(kernel).down(&self.blur);
            let down = blurred.down(kernel);
            across.values.iter().zip(down.values).map(|(x, y)| x.hypot(y)).collect()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_keep_what_is_flat_and_see_no_feature_in_it() {
        for ppd in [-1.0, 0.5, 20.0, 67.0, 1e9, f32::NAN] {
            let observer = Observer::new(ppd);
            let flat = Plane { width: 5, values: vec![0.7; 20] };
            for contrast in &observer.contrast {
                let filtered = contrast.filter(&flat);
                assert!(filtered.values.iter().all(|v| (v - 0.7).abs() < 1e-5), "{ppd}");
            }
            for feature in observer.feature.detect(&flat) {
                assert!(feature.iter().all(|v| *v < 1e-4), "{ppd}: {feature:?}");
            }
        }
    }

    #[test]
    fn a_step_is_an_edge_of_its_height() {
        let mut step = vec![0.0; 61];
        step[30..].fill(0.5);
        let [edges, points] =
            Observer::new(67.0).feature.detect(&Plane { width: 61, values: step });
        // The two pixels beside the step; half the middle tap is missing of the sum.
        assert!((edges[30] - 0.5).abs() < 1e-3, "{}", edges[30]);
        assert!(edges[0] < 1e-6 && points[60] < 1e-6);
        assert!(points[30] < points[32], "a point is seen beside a step, not on it");
    }
}
