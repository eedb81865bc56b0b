//! From where, and through which filter, a picture is seen.

use std::f32::consts::TAU;

use glam::{Affine3A, Vec2, Vec3};
use lumencast_scene::Projection;

use crate::sampling::ONE_MINUS_EPSILON;

/// A camera at its place.
///
/// The picture takes its height from the projection and its width from the picture's own size, so
/// that pixels are square whatever aspect ratio the file states. The near and far planes, which a
/// rasteriser needs, cut nothing off here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Looks along −Z, +Y up; scale is taken out.
    pub world_from_camera: Affine3A,
    /// How it projects.
    pub projection: Projection,
}

impl View {
    /// A perspective view from `eye` towards `target` with +Y up where possible; `yfov` is the
    /// vertical field of view in radians, between 0 and π. `None` where eye and target coincide or
    /// a number is not finite.
    #[must_use]
    pub fn look_at(eye: Vec3, target: Vec3, yfov: f32) -> Option<Self> {
        let forward = (target - eye).try_normalize()?;
        let up = if forward.y.abs() > 0.9999 { Vec3::NEG_Z } else { Vec3::Y };
        let right = forward.cross(up).try_normalize()?;
        let camera = glam::Mat3::from_cols(right, right.cross(forward), -forward);
        let projection =
            Projection::Perspective { yfov, aspect_ratio: None, near: 0.01, far: None };
        (eye.is_finite() && yfov > 0.0 && yfov < std::f32::consts::PI).then(|| Self {
            world_from_camera: Affine3A::from_mat3_translation(camera, eye),
            projection,
        })
    }

    /// Origin and unit direction of the ray through a point of the picture: (0, 0) is its upper
    /// left corner, (1, 1) its lower right. `aspect` is width by height.
    #[inline]
    pub(crate) fn ray(&self, at: Vec2, aspect: f32) -> (Vec3, Vec3) {
        let at = Vec2::new((2.0 * at.x - 1.0) * aspect, 1.0 - 2.0 * at.y);
        let m = &self.world_from_camera;
        let axis = |v: glam::Vec3A| Vec3::from(v).normalize_or_zero();
        let (right, up) = (axis(m.matrix3.x_axis), axis(m.matrix3.y_axis));
        let (forward, eye) = (-axis(m.matrix3.z_axis), Vec3::from(m.translation));
        match self.projection {
            Projection::Perspective { yfov, .. } => {
                let at = at * (0.5 * yfov).tan();
                (eye, (forward + at.x * right + at.y * up).normalize())
            }
            Projection::Orthographic { half_height, .. } => {
                let at = at * half_height;
                (eye + at.x * right + at.y * up, forward)
            }
        }
    }
}

/// How a pixel weighs what it sees, by the distance from its centre in pixels. Samples are placed
/// with the filter's density and all count alike (Ernst, Stamminger and Greiner 2006), so that
/// neighbouring pixels share none and tiles none either.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// The pixel's own square: what multisampling resolves to.
    #[default]
    Box,
    /// Falls linearly to 0 at the neighbours' centres.
    Tent,
    /// σ of half a pixel, cut off at 1.5.
    Gaussian,
}

impl Filter {
    /// Where in the picture a sample goes, pixels from the pixel's centre.
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

/// Density 1 − |x|.
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
        // Box 1/12, tent 1/6; Gaussian σ² less what the cut takes: 1 − (R²/2σ²) q/(1 − q), q = e^(−R²/2σ²).
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

    #[test]
    fn rays_go_through_the_corners() {
        let view = View::look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, std::f32::consts::FRAC_PI_2)
            .unwrap();
        let (eye, middle) = view.ray(Vec2::splat(0.5), 2.0);
        assert_eq!(eye, Vec3::new(0.0, 0.0, 5.0));
        assert!((middle - Vec3::NEG_Z).length() < 1e-6);
        // 90° high, twice as wide: the upper left corner is at x = −2, y = 1 one metre ahead.
        let (_, corner) = view.ray(Vec2::ZERO, 2.0);
        assert!((corner / -corner.z - Vec3::new(-2.0, 1.0, -1.0)).length() < 1e-5, "{corner}");
        assert!(View::look_at(Vec3::ONE, Vec3::ONE, 1.0).is_none());
        assert!(View::look_at(Vec3::ONE, Vec3::ZERO, 4.0).is_none());
        assert!(View::look_at(Vec3::Y, Vec3::ZERO, 1.0).is_some(), "straight down");
    }
}
