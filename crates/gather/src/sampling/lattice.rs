//! Directions of a probe's samples: a randomly rotated spherical Fibonacci lattice.
//!
//! n points lie at heights 1 − (2i+1)/n, each one golden angle further round (Keinert et al. 2015,
//! "Spherical Fibonacci mapping"). All have the same weight. A random rotation for each receiver
//! and seed makes the estimate unbiased. Each tick takes another seed, so that successive estimates
//! average out.

use std::f32::consts::TAU;

use glam::{Quat, Vec2, Vec3};

use super::{mix2, rotation, unit};

/// The golden ratio's fractional part, as a fraction of 2³².
const GOLDEN: u32 = 2_654_435_769;

/// Direction `i` of `n`, before the rotation.
#[inline]
pub(crate) fn direction(i: u32, n: u32) -> Vec3 {
    let z = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
    let r = (1.0 - z * z).max(0.0).sqrt();
    // The product is computed in integers, so that the fraction stays exact for large i.
    let turns = i.wrapping_mul(GOLDEN) as f32 / 4_294_967_296.0;
    (r * Vec2::from_angle(TAU * turns)).extend(z)
}

/// The rotation of a receiver's lattice.
#[inline]
pub(crate) fn turn(seed: u64, receiver: u32) -> Quat {
    let a = mix2(seed ^ 0x1a77_1ce5_eed0_0001, u64::from(receiver));
    let b = mix2(a, 2);
    rotation(Vec3::new(unit(a as u32), unit((a >> 32) as u32), unit(b as u32)))
}

#[cfg(test)]
mod tests {
    use lumencast_light::{Order, sh};

    use super::*;

    /// The mean of Y_lm over the lattice is close to its integral, which is 0 except for l = 0. It
    /// is within a few hundredths for 16 directions, and closer for more.
    #[test]
    fn integrates_low_bands() {
        for (n, tolerance) in [(16, 0.08), (256, 0.008), (4096, 0.001)] {
            let mut mean = [0.0; sh::MAX_COEFFICIENTS];
            for i in 0..n {
                let b = sh::basis(Order::L4, direction(i, n));
                mean.iter_mut().zip(b).for_each(|(m, y)| *m += y / n as f32);
            }
            for (k, m) in mean.iter().enumerate().take(9).skip(1) {
                assert!(m.abs() < tolerance, "{n} directions, coefficient {k}: {m}");
            }
        }
    }

    #[test]
    fn turns_are_uniform() {
        let n = 4000;
        let mean: Vec3 = (0..n).map(|r| turn(5, r) * Vec3::X).sum::<Vec3>() / n as f32;
        // Each component has standard deviation √(1/3n).
        assert!(mean.abs().max_element() < 4.0 / (3.0 * n as f32).sqrt(), "{mean}");
        assert_ne!(turn(5, 0), turn(6, 0));
    }
}
