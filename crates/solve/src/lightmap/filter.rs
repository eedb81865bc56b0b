//! Noise is taken from lumels by those about them on the surface.
//!
//! An à-trous filter guided by the noise (Dammertz et al. 2010; Schied et al. 2017, equations 3 to 5,
//! without their time): in passes of growing steps, each lumel becomes a mean of the 5 × 5 about it.
//! Who is a neighbour, position and normal decide. Whose light counts, the noise decides: what differs
//! by more than noise explains is detail, and stays. Lumels that are known well are left alone.

use glam::{IVec2, Vec3};
use lumencast_light::luminance;
use rayon::prelude::*;

/// Passes; steps are 1, 2, 4.
const PASSES: u32 = 3;
/// Lumels so far off count for a lumel, or a little less far.
pub(crate) const REACH: u32 = 16;
/// The B3 spline.
const KERNEL: [f32; 5] = [1.0 / 16.0, 1.0 / 4.0, 3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Standard deviations by which light may differ.
const DEVIATIONS: f32 = 2.0;
/// A neighbour is at most so many times as far as it is on the page.
const STRETCH: f32 = 1.5;
/// Power of the cosine between normals.
const NORMAL_POWER: i32 = 32;

/// A lumel that is filtered. One that nothing is known of has an infinite variance: it takes the light
/// of those about it, and gives none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noisy {
    /// World, metres.
    pub(crate) position: Vec3,
    /// World, unit.
    pub(crate) normal: Vec3,
    pub(crate) irradiance: Vec3,
    /// Its slope times its luminance; 0 where it is not known.
    pub(crate) slope: Vec3,
    /// Variance of the mean's luminance.
    pub(crate) variance: f32,
}

/// Filters a page of lumels, `side` a side, a lumel every `texel` metres. Lumels that are not there
/// take no part.
pub(crate) fn filter(page: &mut Vec<Option<Noisy>>, side: u32, texel: f32) {
    for pass in 0..PASSES {
        let step = 1 << pass;
        let near = STRETCH * step as f32 * texel;
        let before = &*page;
        *page = (0..before.len() as u32)
            .into_par_iter()
            .map(|number| {
                let own = before[number as usize]?;
                let at = IVec2::new((number % side) as i32, (number / side) as i32);
                Some(filtered(&own, neighbours(before, side, at, step), near))
            })
            .collect();
    }
}

/// The 5 × 5 lumels about one, with the kernel's weight and their distance on the page in steps.
fn neighbours(
    page: &[Option<Noisy>],
    side: u32,
    at: IVec2,
    step: i32,
) -> impl Iterator<Item = (Noisy, f32, f32)> {
    (0..25).filter_map(move |k| {
        let (x, y) = (k % 5, k / 5);
        let off = IVec2::new(x - 2, y - 2);
        let beside = at + step * off;
        if beside.min_element() < 0 || beside.max_element() >= side as i32 {
            return None;
        }
        let lumel = page[(beside.y as u32 * side + beside.x as u32) as usize]?;
        Some((lumel, KERNEL[x as usize] * KERNEL[y as usize], off.as_vec2().length()))
    })
}

fn filtered(own: &Noisy, about: impl Iterator<Item = (Noisy, f32, f32)>, near: f32) -> Noisy {
    let y = luminance(own.irradiance);
    let (mut sum, mut slope, mut variance, mut weights) = (Vec3::ZERO, Vec3::ZERO, 0.0, 0.0);
    for (lumel, kernel, steps) in about {
        let apart = lumel.position.distance(own.position);
        let facing = lumel.normal.dot(own.normal).max(0.0).powi(NORMAL_POWER);
        if apart > near * steps || facing == 0.0 || lumel.variance == f32::INFINITY {
            continue;
        }
        let spread = DEVIATIONS * (own.variance + lumel.variance).max(0.0).sqrt();
        let differs = (luminance(lumel.irradiance) - y).abs();
        let alike = if differs == 0.0 { 1.0 } else { (-differs / spread.max(1e-30)).exp() };
        let weight = kernel * facing * alike;
        sum += weight * lumel.irradiance;
        slope += weight * lumel.slope;
        variance += weight * weight * lumel.variance;
        weights += weight;
    }
    if weights == 0.0 {
        return *own;
    }
    Noisy {
        irradiance: sum / weights,
        slope: slope / weights,
        variance: variance / (weights * weights),
        ..*own
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{mix, unit};

    const SIDE: u32 = 32;

    /// A page on a plane; what is right, its noise, and the page.
    fn page(right: impl Fn(u32) -> f32, noise: f32) -> Vec<Option<Noisy>> {
        let lumel = |number: u32| {
            let (x, y) = ((number % SIDE) as f32, (number / SIDE) as f32);
            // Uniform, of this standard deviation.
            let off = noise * 12.0f32.sqrt() * (unit((mix(u64::from(number)) >> 32) as u32) - 0.5);
            Some(Noisy {
                position: 0.1 * Vec3::new(x, 0.0, y),
                normal: Vec3::Y,
                irradiance: Vec3::splat(right(number) + off),
                slope: Vec3::ZERO,
                variance: noise * noise,
            })
        };
        (0..SIDE * SIDE).map(lumel).collect()
    }

    fn error(page: &[Option<Noisy>], right: impl Fn(u32) -> f32) -> f32 {
        let squares = page
            .iter()
            .zip(0..)
            .map(|(lumel, number)| (lumel.unwrap().irradiance.x - right(number)).powi(2));
        (squares.sum::<f32>() / page.len() as f32).sqrt()
    }

    #[test]
    fn noise_goes_and_what_it_does_not_explain_stays() {
        let flat = |_| 10.0;
        let mut even = page(flat, 1.0);
        filter(&mut even, SIDE, 0.1);
        assert!(error(&even, flat) < 0.25, "{}", error(&even, flat));
        // A shadow's edge, twenty standard deviations high.
        let edge = |number: u32| if number % SIDE < SIDE / 2 { 10.0 } else { 30.0 };
        let mut shadow = page(edge, 1.0);
        filter(&mut shadow, SIDE, 0.1);
        assert!(error(&shadow, edge) < 0.3, "{}", error(&shadow, edge));
        // Without noise nothing changes.
        let slope = |number: u32| number as f32;
        let mut clean = page(slope, 0.0);
        filter(&mut clean, SIDE, 0.1);
        assert!(error(&clean, slope) < 1e-3, "{}", error(&clean, slope));
    }

    /// Of every sixteenth lumel something is known: the others lie between.
    #[test]
    fn what_is_not_known_is_interpolated() {
        let slope = |number: u32| 10.0 + (number % SIDE) as f32 / 8.0;
        let mut sparse = page(slope, 0.1);
        for (lumel, number) in sparse.iter_mut().flatten().zip(0..) {
            if [number, number / SIDE].iter().any(|at| !at.is_multiple_of(4)) {
                (lumel.irradiance, lumel.variance) = (Vec3::splat(1e4), f32::INFINITY);
            }
        }
        filter(&mut sparse, SIDE, 0.1);
        assert!(sparse.iter().flatten().all(|lumel| lumel.variance.is_finite()));
        assert!(error(&sparse, slope) < 0.5, "{}", error(&sparse, slope));
        let mut unknown = page(slope, 0.1);
        unknown.iter_mut().flatten().for_each(|lumel| lumel.variance = f32::INFINITY);
        filter(&mut unknown, SIDE, 0.1);
        assert!(unknown.iter().flatten().all(|lumel| lumel.variance == f32::INFINITY));
    }

    /// Lumels that lie beside each other on the page alone, and those of a wall beside a floor, do not
    /// count.
    #[test]
    fn neighbours_are_those_on_the_surface() {
        let edge = |number: u32| if number % SIDE < SIDE / 2 { 1.0 } else { 2.0 };
        for fault in ["apart", "another wall", "none"] {
            let mut two = page(edge, 0.0);
            for (lumel, number) in two.iter_mut().flatten().zip(0..) {
                lumel.variance = 100.0;
                if number % SIDE >= SIDE / 2 {
                    match fault {
                        "apart" => lumel.position += Vec3::Y,
                        "another wall" => lumel.normal = Vec3::X,
                        _ => {}
                    }
                }
            }
            filter(&mut two, SIDE, 0.1);
            let is_mixed = error(&two, edge) > 0.05;
            assert_eq!(is_mixed, fault == "none", "{fault}: {}", error(&two, edge));
        }
    }
}
