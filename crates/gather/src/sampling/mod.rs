//! Where samples go: the sampler's numbers, the lattice of directions, maps from the unit square,
//! and tables to choose from by weight.

pub(crate) mod lattice;
mod sobol;
mod table;

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

pub(crate) use sobol::Sampler;
pub(crate) use table::{Grid2, Table};

/// The largest f32 below 1.
pub(crate) const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// Rec. 709 luminance.
#[inline]
pub(crate) fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// A well-mixed function of its input (the finaliser of splitmix64).
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

/// The upper bits as a number in [0, 1).
#[inline]
pub(crate) fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

/// The unit disc, equal areas, without tearing neighbours apart (Shirley and Chiu 1997).
#[inline]
pub(crate) fn disc(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, angle) = if p.x.abs() > p.y.abs() {
        (p.x, PI / 4.0 * (p.y / p.x))
    } else {
        (p.y, PI / 2.0 - PI / 4.0 * (p.x / p.y))
    };
    radius * Vec2::from_angle(angle)
}

/// The upper hemisphere with density cos θ/π.
#[inline]
pub(crate) fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = disc(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// The sphere, uniform (density 1/4π).
#[inline]
#[cfg(test)]
pub(crate) fn sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    (r * Vec2::from_angle(TAU * u.y)).extend(z)
}

/// Barycentric weights of the second and third vertex, uniform in area.
#[inline]
pub(crate) fn triangle(u: Vec2) -> Vec2 {
    let root = u.x.sqrt();
    Vec2::new(root * (1.0 - u.y), root * u.y)
}

/// A rotation, uniform (Shoemake 1992).
pub(crate) fn rotation(u: Vec3) -> glam::Quat {
    let (a, b) = ((1.0 - u.x).sqrt(), u.x.sqrt());
    let (p, q) = (Vec2::from_angle(TAU * u.y), Vec2::from_angle(TAU * u.z));
    glam::Quat::from_xyzw(a * p.y, a * p.x, b * q.y, b * q.x).normalize()
}

/// The weight of a strategy with density `a` beside one with density `b`: the power heuristic
/// (Veach 1997, equation 9.13, β = 2).
#[inline]
pub(crate) fn power_heuristic(a: f32, b: f32) -> f32 {
    if a.is_infinite() {
        return 1.0;
    }
    // By their ratio, since the square of a density may overflow.
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
        // Moments: E[z] of the cosine hemisphere 2/3, E[z²] of the sphere 1/3, E[r²] of the disc 1/2.
        assert!((mean(&|u| cosine_hemisphere(u).z) - 2.0 / 3.0).abs() < 1e-3);
        assert!((mean(&|u| sphere(u).z.powi(2)) - 1.0 / 3.0).abs() < 1e-3);
        assert!((mean(&|u| disc(u).length_squared()) - 0.5).abs() < 1e-3);
        assert!((mean(&|u| triangle(u).x) - 1.0 / 3.0).abs() < 2e-3);
        assert!((mean(&|u| triangle(u).y) - 1.0 / 3.0).abs() < 2e-3);
    }

    #[test]
    fn power_heuristic_is_a_partition() {
        for (a, b) in [(1.0, 2.0), (1e30, 1e30), (0.0, 3.0), (1e-30, 1e-20), (5.0, 0.0)] {
            let sum = power_heuristic(a, b) + power_heuristic(b, a);
            assert!((sum - 1.0).abs() < 1e-6, "{a} {b}: {sum}");
        }
    }
}
