//! Sampling: the sampler's numbers, the lattice of directions, maps from the unit square, and
//! tables to choose from by weight.

pub(crate) mod lattice;
mod sobol;
mod table;

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use glam::{Vec2, Vec3};
pub(crate) use lumencast_light::luminance;

pub(crate) use sobol::{Draw, Sampler};
pub(crate) use table::{Grid2, Table};

/// The largest f32 below 1.
pub(crate) const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// A hash of one number (the finaliser of splitmix64).
#[inline]
pub(crate) fn mix(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A hash of two numbers.
#[inline]
pub(crate) fn mix2(a: u64, b: u64) -> u64 {
    mix(mix(a.wrapping_add(0x9e37_79b9_7f4a_7c15)) ^ b.wrapping_mul(0xd6e8_feb8_6659_fd93))
}

/// The upper 24 bits as a number in [0, 1).
#[inline]
pub(crate) fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

/// Cosine and sine of an angle of at most π/4 (Moshier's Cephes, sinf.c).
#[inline(always)]
fn cos_sin(angle: f32) -> Vec2 {
    let z = angle * angle;
    let cos = 1.0 - 0.5 * z + z * z * (4.166_664_6e-2 + z * (-1.388_731_6e-3 + z * 2.443_315_7e-5));
    let sin = angle + angle * z * (-1.666_665_5e-1 + z * (8.332_161e-3 - z * 1.951_529_6e-4));
    Vec2::new(cos, sin)
}

/// The point of the unit circle at 0 to 1 turns from +x, within 1.5·10⁻⁷. It makes no library call,
/// so loops over it are vectorised.
#[inline(always)]
pub(crate) fn turned(turns: f32) -> Vec2 {
    let quarters = 4.0 * turns;
    let nearest = (quarters + 0.5).floor();
    let Vec2 { x: c, y: s } = cos_sin(FRAC_PI_2 * (quarters - nearest));
    let (odd, low) = (nearest == 1.0 || nearest == 3.0, nearest == 2.0 || nearest == 3.0);
    let (x, y) = if odd { (-s, c) } else { (c, s) };
    if low { Vec2::new(-x, -y) } else { Vec2::new(x, y) }
}

/// Maps the unit square to the unit disc with equal areas; neighbours stay neighbours (Shirley and
/// Chiu 1997).
#[inline(always)]
pub(crate) fn disc(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    let flat = p.x.abs() > p.y.abs();
    let (radius, other) = if flat { (p.x, p.y) } else { (p.y, p.x) };
    let ratio = if radius == 0.0 { 0.0 } else { other / radius };
    let Vec2 { x: c, y: s } = radius * cos_sin(FRAC_PI_4 * ratio);
    if flat { Vec2::new(c, s) } else { Vec2::new(s, c) }
}

/// Maps the unit square to the upper hemisphere with density cos θ/π.
#[inline(always)]
pub(crate) fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = disc(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Maps the unit square to the upper hemisphere with density (2 cos θ + 1)/4π: half by the cosine, half
/// evenly.
#[inline]
pub(crate) fn tilted_hemisphere(u: Vec2) -> Vec3 {
    let z = 0.5 * ((1.0 + 8.0 * u.x).sqrt() - 1.0);
    let r = (1.0 - z * z).max(0.0).sqrt();
    (r * turned(u.y)).extend(z)
}

/// Maps the unit square to the sphere with density 1/4π.
#[inline]
#[cfg(test)]
pub(crate) fn sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    (r * turned(u.y)).extend(z)
}

/// Barycentric weights of the second and third vertex, uniform over the triangle's area.
#[inline]
pub(crate) fn triangle(u: Vec2) -> Vec2 {
    let root = u.x.sqrt();
    Vec2::new(root * (1.0 - u.y), root * u.y)
}

/// A uniformly distributed rotation (Shoemake 1992).
pub(crate) fn rotation(u: Vec3) -> glam::Quat {
    let (a, b) = ((1.0 - u.x).sqrt(), u.x.sqrt());
    let (p, q) = (Vec2::from_angle(TAU * u.y), Vec2::from_angle(TAU * u.z));
    glam::Quat::from_xyzw(a * p.y, a * p.x, b * q.y, b * q.x).normalize()
}

/// The power heuristic's weight of a strategy with density `a` beside one with density `b` (Veach
/// 1997, equation 9.13, β = 2).
#[inline(always)]
pub(crate) fn power_heuristic(a: f32, b: f32) -> f32 {
    if a.is_infinite() {
        return 1.0;
    }
    // It uses the ratio, since the square of a density may overflow.
    if a >= b {
        let r = b / a;
        if a > 0.0 { 1.0 / (1.0 + r * r) } else { 0.0 }
    } else {
        let r = a / b;
        r * r / (1.0 + r * r)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_have_the_densities_they_state() {
        let n = 256;
        let grid =
            || (0..n * n).map(|i| (Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) / n as f32);
        let mean = |f: &dyn Fn(Vec2) -> f32| grid().map(f).sum::<f32>() / (n * n) as f32;
        // Moments: E[z] of the cosine hemisphere is 2/3, E[z²] of the sphere 1/3, E[r²] of the disc
        // 1/2.
        assert!((mean(&|u| cosine_hemisphere(u).z) - 2.0 / 3.0).abs() < 1e-3);
        assert!((mean(&|u| sphere(u).z.powi(2)) - 1.0 / 3.0).abs() < 1e-3);
        assert!((mean(&|u| disc(u).length_squared()) - 0.5).abs() < 1e-3);
        assert!((mean(&|u| triangle(u).x) - 1.0 / 3.0).abs() < 2e-3);
        assert!((mean(&|u| triangle(u).y) - 1.0 / 3.0).abs() < 2e-3);
    }

    #[test]
    fn turns_are_points_of_the_circle() {
        let n = 100_000;
        for i in 0..=n {
            let turns = i as f32 / n as f32;
            let (sin, cos) = (f64::from(turns) * std::f64::consts::TAU).sin_cos();
            let off = turned(turns).as_dvec2() - glam::DVec2::new(cos, sin);
            assert!(off.abs().max_element() < 1.5e-7, "{turns}: {off}");
        }
    }

    #[test]
    fn power_heuristic_is_a_partition() {
        for (a, b) in [(1.0, 2.0), (1e30, 1e30), (0.0, 3.0), (1e-30, 1e-20), (5.0, 0.0)] {
            let sum = power_heuristic(a, b) + power_heuristic(b, a);
            assert!((sum - 1.0).abs() < 1e-6, "{a} {b}: {sum}");
        }
    }
}
