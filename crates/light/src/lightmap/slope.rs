//! How irradiance depends on the normal that a surface is shaded by.
//!
//! A normal map tilts normals about the surface's own, n. Irradiance on a normal n' is told by one
//! vector, the *slope* s, for all channels: E(n') = E(n) · max(0, 1 + s·(n' − n)). Light from a single
//! direction ω has s = ω/(n·ω), which is exact wherever n' faces it. Light from behind n' would count
//! below 0 so. Therefore s is fitted to a ring of normals that are all tilted by [`TILT`]: their mean
//! irradiance is exact, and so is its first harmonic around the ring. An even sky has s = n/2.
//!
//! S = s E is linear in light, so that it can be gathered, filtered and averaged.

use std::f32::consts::PI;

use glam::Vec3;

/// The tilt that slopes are fitted at, radians.
pub const TILT: f32 = PI / 6.0;
/// Upper limit of a slope's length. Light that comes in flatter has more, but is told by it as if it
/// stood 18° above the surface.
pub const STEEPEST: f32 = 3.0;

/// What radiance from the unit `direction`, a unit of it a steradian, adds to S on a surface of this
/// unit normal: nothing from beneath it.
pub fn slope_by(direction: Vec3, normal: Vec3) -> Vec3 {
    let cosine = normal.dot(direction);
    if cosine <= 0.0 {
        return Vec3::ZERO;
    }
    let (tilt_sine, tilt_cosine) = TILT.sin_cos();
    let across = direction - cosine * normal;
    let sine = across.length();
    let (middle, swing) = (tilt_cosine * cosine, tilt_sine * sine);
    if middle >= swing {
        return direction;
    }
    // Normals of the ring face the light up to this angle about the surface's normal.
    let end_cosine = -middle / swing;
    let (end, end_sine) = (end_cosine.acos(), (1.0 - end_cosine * end_cosine).max(0.0).sqrt());
    let mean = (middle * end + swing * end_sine) / PI;
    let harmonic = (2.0 * middle * end_sine + swing * (end + end_sine * end_cosine)) / PI;
    (cosine - mean) / (1.0 - tilt_cosine) * normal + harmonic / tilt_sine * across / sine
}

/// The slope of light of this S and irradiance on the surface's normal: 0 where there is none.
pub fn slope(sum: Vec3, irradiance: f32) -> Vec3 {
    let slope = sum / irradiance;
    if slope.is_finite() { slope.clamp_length_max(STEEPEST) } else { Vec3::ZERO }
}

/// Irradiance on a unit normal of shading, over that on the surface's own unit normal.
pub fn tilted(slope: Vec3, normal: Vec3, shading: Vec3) -> f32 {
    (1.0 + slope.dot(shading - normal)).max(0.0)
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    /// Normals at a tilt from +Y, around it.
    fn ring(tilt: f32) -> impl Iterator<Item = Vec3> {
        let turn = move |k: usize| Quat::from_rotation_y(k as f32 * PI / 180.0);
        (0..360).map(move |k| turn(k) * Quat::from_rotation_z(tilt) * Vec3::Y)
    }

    fn light_at(elevation: f32) -> Vec3 {
        Vec3::new(elevation.cos() * 0.6, elevation.sin(), elevation.cos() * 0.8)
    }

    /// Light from one direction that all tilted normals face is told exactly.
    #[test]
    fn light_from_one_direction_is_exact() {
        for elevation in [0.6, 1.0, 1.5] {
            let light = light_at(elevation);
            assert_eq!(slope_by(light, Vec3::Y), light);
            let slope = slope(slope_by(light, Vec3::Y), light.y);
            for shading in ring(0.5) {
                let right = shading.dot(light) / light.y;
                assert!((tilted(slope, Vec3::Y, shading) - right).abs() < 1e-5, "{elevation}");
            }
        }
        assert_eq!(slope_by(light_at(-0.1), Vec3::Y), Vec3::ZERO, "from beneath");
    }

    /// Whatever the light, the mean of the ring is right, and its first harmonic.
    #[test]
    fn the_ring_is_right_on_average() {
        for elevation in [0.01, 0.2, 0.5, 1.2] {
            let light = light_at(elevation);
            let slope = slope_by(light, Vec3::Y) / light.y;
            let (mut mean, mut harmonic) = (0.0, Vec3::ZERO);
            for shading in ring(TILT) {
                let told = 1.0 + slope.dot(shading - Vec3::Y);
                let apart = told - shading.dot(light).max(0.0) / light.y;
                mean += apart / 360.0;
                harmonic += apart * (shading - shading.y * Vec3::Y) / 360.0;
            }
            let size = 1.0 / light.y;
            assert!(mean.abs() < 1e-4 * size && harmonic.length() < 1e-4 * size, "{elevation}");
        }
    }

    /// An even sky: half of what the cosine of the tilt takes away.
    #[test]
    fn an_even_sky_has_half_its_normal() {
        let (mut sum, mut irradiance) = (Vec3::ZERO, 0.0);
        for (a, b) in (0..200).flat_map(|a| (0..200).map(move |b| (a, b))) {
            let (up, turn) = ((a as f32 + 0.5) / 200.0, b as f32 * PI / 100.0);
            let round = (1.0 - up * up).sqrt();
            let direction = Vec3::new(round * turn.cos(), up, round * turn.sin());
            sum += slope_by(direction, Vec3::Y);
            irradiance += up;
        }
        let slope = slope(sum, irradiance);
        assert!(slope.abs_diff_eq(0.5 * Vec3::Y, 1e-3), "{slope}");
        let shading = Vec3::new(TILT.sin(), TILT.cos(), 0.0);
        assert!((tilted(slope, Vec3::Y, shading) - 0.5 * (1.0 + TILT.cos())).abs() < 1e-3);
    }

    #[test]
    fn slopes_are_bounded() {
        let flat = light_at(0.01);
        assert!(slope(slope_by(flat, Vec3::Y), flat.y).length() < STEEPEST * 1.001);
        for (sum, irradiance) in [(Vec3::ZERO, 0.0), (Vec3::X, 0.0), (Vec3::NAN, 1.0)] {
            assert_eq!(slope(sum, irradiance), Vec3::ZERO);
        }
        assert_eq!(
            tilted(3.0 * Vec3::X, Vec3::Y, Vec3::NEG_X),
            0.0,
            "light is never below nothing"
        );
    }
}
