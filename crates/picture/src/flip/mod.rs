//! FLIP: how strongly a person who flips between two pictures sees them differ.
//!
//! Andersson et al., *FLIP: A Difference Evaluator for Alternating Images* (2020); the symbols in
//! brackets in this module are that paper's. Both pictures are filtered by the eye's contrast
//! sensitivity for the distance they are seen from and compared in a uniform colour space; where
//! edges or points differ too, the colour error counts for more.
//!
//! Cost: some 600 multiplications a pixel at 67 pixels per degree, in proportion to the latter.

mod colour;
mod hdr;
mod observer;

pub use hdr::{HdrFlip, hdr_flip};

use glam::Vec3;
use rayon::prelude::*;

use crate::tone::linear_from_srgb;
use crate::{Pair, Picture, magma};
use colour::Seen;
use observer::Observer;

/// The paper's viewing conditions: a monitor 0.7 m wide of 3840 pixels, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = 67.020_645;

/// Pixels per degree of the visual field: from `distance` metres, on a monitor `width` metres wide
/// that shows `pixels` in a row.
pub fn pixels_per_degree(distance: f32, width: f32, pixels: u32) -> f32 {
    distance * pixels as f32 / width * std::f32::consts::PI / 180.0
}

/// The error of each pixel: 0 not to be seen, 1 as strong as can be.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    width: u32,
    values: Vec<f32>,
}

impl ErrorMap {
    /// Mean error.
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|&v| f64::from(v)).sum::<f64>() / self.values.len() as f64
    }

    /// The errors, row by row from the top left.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The error of a column and a row, or nothing outside the picture.
    pub fn value(&self, x: u32, y: u32) -> Option<f32> {
        let index = y as usize * self.width as usize + x as usize;
        self.values.get(index).copied().filter(|_| x < self.width)
    }

    /// The map in false colours, black over purple and orange to pale yellow, as linear colour; to
    /// be written with [`crate::ToneMap::Srgb`] and exposure 1.
    pub fn in_magma(&self) -> Picture {
        let height = self.values.len() as u32 / self.width.max(1);
        Picture::from_fn(self.width, height, |x, y| {
            linear_from_srgb(magma(self.value(x, y).unwrap_or(0.0)))
        })
    }
}

/// FLIP of display codes: sRGB's, clamped to 0 to 1. `pixels_per_degree` (1 to 1000, clamped to
/// that) says from how far the pictures are looked at: [`PIXELS_PER_DEGREE`].
pub fn flip(codes: &Pair<'_>, pixels_per_degree: f32) -> ErrorMap {
    let linear = |of: &Picture| of.map(|p| linear_from_srgb(p.clamp(Vec3::ZERO, Vec3::ONE)));
    let (reference, picture) = (linear(codes.reference()), linear(codes.picture()));
    of_linear(&reference, &picture, &Observer::new(pixels_per_degree))
}

/// FLIP of linear colour, 0 to 1.
fn of_linear(reference: &Picture, picture: &Picture, observer: &Observer) -> ErrorMap {
    let (a, b) = (Seen::new(reference, observer), Seen::new(picture, observer));
    let largest = colour::largest_difference();
    let values = (0..a.colours.len())
        .into_par_iter()
        .map(|i| {
            let colour = colour_error(colour::difference(a.colours[i], b.colours[i]), largest);
            let edge = (a.edges[i] - b.edges[i]).abs();
            let point = (a.points[i] - b.points[i]).abs();
            colour.powf(1.0 - feature_error(edge.max(point)))
        })
        .collect();
    ErrorMap { width: reference.width(), values }
}

/// Where the two parts of the colour error meet, as parts of its largest value and of 1 (p_c, p_t).
const KNEE: (f32, f32) = (0.4, 0.95);

/// A difference between colours to 0 to 1; the large ones share the last 5 %.
fn colour_error(difference: f32, largest: f32) -> f32 {
    let knee = KNEE.0 * largest;
    if difference < knee {
        KNEE.1 / knee * difference
    } else {
        (KNEE.1 + (difference - knee) / (largest - knee) * (1.0 - KNEE.1)).min(1.0)
    }
}

/// (Δ/√2)^q_f with q_f = ½: of features an eye tells small differences.
fn feature_error(difference: f32) -> f32 {
    (difference * std::f32::consts::FRAC_1_SQRT_2).sqrt().min(1.0)
}
