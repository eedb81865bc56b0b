//! How colours differ to the eye.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::observer::Observer;
use crate::Picture;
use crate::plane::Plane;

/// CIE XYZ of Rec. 709 primaries, divided by that of white: (1, 1, 1) goes to (1, 1, 1). Derived
/// from BT.709's chromaticities, white at (0.3127, 0.3290); matrices for the rounded white
/// (0.95047, 1, 1.08883) are 7e-5 off, and a pixel's FLIP then 1e-4.
const XYZ_FROM_RGB: Mat3 = {
    const X: [f32; 3] = [0.412_390_8, 0.357_584_34, 0.180_480_8];
    const Y: [f32; 3] = [0.212_639, 0.715_168_7, 0.072_192_32];
    const Z: [f32; 3] = [0.019_330_818, 0.119_194_78, 0.950_532_15];
    const fn column(i: usize) -> Vec3 {
        Vec3::new(
            X[i] / (X[0] + X[1] + X[2]),
            Y[i] / (Y[0] + Y[1] + Y[2]),
            Z[i] / (Z[0] + Z[1] + Z[2]),
        )
    }
    Mat3::from_cols(column(0), column(1), column(2))
};

/// A picture as it is seen from a distance.
#[derive(Debug)]
pub(super) struct Seen {
    /// CIELAB with Hunt's adjustment.
    pub(super) colours: Vec<Vec3>,
    pub(super) edges: Vec<f32>,
    pub(super) points: Vec<f32>,
}

impl Seen {
    /// Of linear colour, 0 to 1.
    pub(super) fn new(picture: &Picture, observer: &Observer) -> Self {
        // YCxCz without its factors and its offset, which filters that keep what is flat do not
        // change.
        let xyz = picture.map(|p| XYZ_FROM_RGB * p);
        let luminance = Plane::of(&xyz, |c| c.y);
        let red_green = Plane::of(&xyz, |c| c.x - c.y);
        let blue_yellow = Plane::of(&xyz, |c| c.y - c.z);

        let [of_luminance, of_red_green, of_blue_yellow] = &observer.contrast;
        let y = of_luminance.filter(&luminance).values;
        let x = of_red_green.filter(&red_green).values;
        let z = of_blue_yellow.filter(&blue_yellow).values;
        let rgb_from_xyz = XYZ_FROM_RGB.inverse();
        let colours = (0..y.len())
            .into_par_iter()
            .map(|i| {
                let xyz = Vec3::new(y[i] + x[i], y[i], y[i] - z[i]);
                // Filters that differ by channel leave the display's range; it ends there.
                hunt_lab((rgb_from_xyz * xyz).clamp(Vec3::ZERO, Vec3::ONE))
            })
            .collect();
        let [edges, points] = observer.feature.detect(&luminance);
        Self { colours, edges, points }
    }
}

/// CIELAB of linear colour, a* and b* times L*/100: colours of dark things look less colourful
/// (Hunt's effect).
fn hunt_lab(rgb: Vec3) -> Vec3 {
    let f = Vec3::from((XYZ_FROM_RGB * rgb).to_array().map(|t| {
        const DELTA: f32 = 6.0 / 29.0;
        if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    }));
    let lightness = 116.0 * f.y - 16.0;
    Vec3::new(
        lightness,
        0.01 * lightness * 500.0 * (f.x - f.y),
        0.01 * lightness * 200.0 * (f.y - f.z),
    )
}

/// HyAB distance to the power of q_c = 0.7.
pub(super) fn difference(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    (d.x.abs() + d.y.hypot(d.z)).powf(0.7)
}

/// The largest difference there is on a display: from green to blue.
pub(super) fn largest_difference() -> f32 {
    difference(hunt_lab(Vec3::Y), hunt_lab(Vec3::Z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn green_and_blue_differ_most() {
        assert!((largest_difference() - 41.276).abs() < 0.01, "{}", largest_difference());
        assert!((hunt_lab(Vec3::ONE) - Vec3::new(100.0, 0.0, 0.0)).length() < 1e-3);
        assert!(hunt_lab(Vec3::ZERO).length() < 1e-4);
        // L* of 18 % grey is 49.5.
        assert!((hunt_lab(Vec3::splat(0.18)).x - 49.496).abs() < 0.01);
    }
}
