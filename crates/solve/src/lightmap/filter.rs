//! Noise is taken from lumels by those about them on the surface.
//!
//! An à-trous filter guided by the noise (Dammertz et al. 2010; Schied et al. 2017, equations 3 to 5,
//! without their time): in passes of growing steps, each lumel becomes a mean of the 5 × 5 about it.
//! Who is a neighbour, position and normal decide. Whose light counts, the noise decides: what differs
//! by more than noise explains is detail, and stays. Lumels that are known well are left alone.

use std::ops::Range;

use glam::Vec3;
use lumencast_light::luminance;

/// Passes; steps are 1, 2, 4.
const PASSES: u32 = 3;
/// Lumels so far off count for a lumel, or a little less far.
pub(crate) const REACH: u32 = 16;
/// The B3 spline.
const KERNEL: [f32; 5] = [1.0 / 16.0, 1.0 / 4.0, 3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Standard deviations by which light may differ.
const DEVIATIONS: f32 = 2.0;
/// A neighbour on the surface is at most so many times as far in the world as on the page.
pub(crate) const STRETCH: f32 = 1.5;

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

/// Filters a window of a page, `side` a side, a lumel every `texel` metres. Lumels that are not there
/// take no part. Those within `margin` of its border are not wanted, and filtered in part.
pub(crate) fn filter(window: &mut [Option<Noisy>], side: u32, texel: f32, margin: u32) {
    let mut columns = Columns::new(window, side as usize);
    for pass in 0..PASSES {
        let step = 1 << pass;
        // What later passes read: two of their steps beyond what is wanted.
        let later: u32 = (pass + 1..PASSES).map(|pass| 2 << pass).sum();
        let margin = margin.saturating_sub(later) as usize;
        columns = columns.filtered(step, STRETCH * step as f32 * texel, margin);
    }
    for (number, lumel) in window.iter_mut().enumerate() {
        if let Some(lumel) = lumel {
            columns.put(number, lumel);
        }
    }
}

/// Lumels as columns of numbers, row after row of a window: what is done to many of them at a time is
/// done by vectors.
#[derive(Clone)]
struct Columns {
    side: usize,
    position: [Vec<f32>; 3],
    /// Zero where there is no lumel: nothing faces as it does.
    normal: [Vec<f32>; 3],
    /// Irradiance, and the slope where any lumel has one.
    values: Vec<Vec<f32>>,
    luminance: Vec<f32>,
    variance: Vec<f32>,
    /// 1 where something is known, 0 elsewhere.
    known: Vec<f32>,
}

impl Columns {
    fn new(window: &[Option<Noisy>], side: usize) -> Self {
        let column = |of: &dyn Fn(&Noisy) -> f32| -> Vec<f32> {
            window.iter().map(|lumel| lumel.as_ref().map_or(0.0, of)).collect()
        };
        let three = |of: &dyn Fn(&Noisy) -> Vec3| [0, 1, 2].map(|k| column(&|lumel| of(lumel)[k]));
        let mut values: Vec<Vec<f32>> = three(&|lumel| lumel.irradiance).into();
        if window.iter().flatten().any(|lumel| lumel.slope != Vec3::ZERO) {
            values.extend(three(&|lumel| lumel.slope));
        }
        Self {
            side,
            position: three(&|lumel| lumel.position),
            normal: three(&|lumel| lumel.normal),
            values,
            luminance: column(&|lumel| luminance(lumel.irradiance)),
            variance: column(&|lumel| lumel.variance),
            known: column(&|lumel| f32::from(lumel.variance < f32::INFINITY)),
        }
    }

    /// One pass over all but a margin: neighbours are so many lumels apart on the page, and at most so
    /// many times as `near`, metres, as they are steps apart.
    fn filtered(&self, step: i32, near: f32, margin: usize) -> Self {
        let mut after = self.clone();
        let mut weights = vec![0.0; self.side];
        for y in margin..self.side - margin {
            let own = y * self.side + margin..(y + 1) * self.side - margin;
            let width = own.len();
            let mut sums = vec![vec![0.0; width]; self.values.len()];
            let (mut variance, mut total) = (vec![0.0; width], vec![0.0; width]);
            for k in 0..25 {
                let (dx, dy) = (step * (k % 5 - 2), step * (k / 5 - 2));
                let Some(row) = y.checked_add_signed(dy as isize).filter(|y| *y < self.side) else {
                    continue;
                };
                // Which of the row's lumels have a neighbour there.
                let low = margin.max((-dx).max(0) as usize);
                let high = (self.side - margin).min(self.side - dx.max(0) as usize);
                let inner = low - margin..high - margin;
                let here = y * self.side + low..y * self.side + high;
                let first = (row * self.side + low).wrapping_add_signed(dx as isize);
                let there = first..first + here.len();
                let steps = ((k % 5 - 2).pow(2) + (k / 5 - 2).pow(2)) as f32;
                let kernel = KERNEL[(k % 5) as usize] * KERNEL[(k / 5) as usize];
                let weights = &mut weights[..here.len()];
                self.weigh(here, there.clone(), near * near * steps, kernel, weights);
                for (sum, value) in sums.iter_mut().zip(&self.values) {
                    add(&mut sum[inner.clone()], &value[there.clone()], weights);
                }
                add_up(&mut total[inner.clone()], weights);
                let known = &self.known[there.clone()];
                add_squared(&mut variance[inner], &self.variance[there], known, weights);
            }
            for (at, (total, variance)) in own.zip(total.iter().zip(&variance)) {
                if *total > 0.0 {
                    let x = at - y * self.side - margin;
                    for (value, sum) in after.values.iter_mut().zip(&sums) {
                        value[at] = sum[x] / total;
                    }
                    after.variance[at] = variance / (total * total);
                    after.known[at] = 1.0;
                    let irradiance = Vec3::from_array([0, 1, 2].map(|k| after.values[k][at]));
                    after.luminance[at] = luminance(irradiance);
                }
            }
        }
        after
    }

    /// What neighbours weigh: those `there` for those `here`.
    fn weigh(
        &self,
        here: Range<usize>,
        there: Range<usize>,
        near_squared: f32,
        kernel: f32,
        weights: &mut [f32],
    ) {
        let count = here.len();
        let ([px, py, pz], [qx, qy, qz]) =
            [&here, &there].map(|of| part(&self.position, of)).into();
        let ([nx, ny, nz], [mx, my, mz]) = [&here, &there].map(|of| part(&self.normal, of)).into();
        let (y, z) = (&self.luminance[here.clone()], &self.luminance[there.clone()]);
        let (v, w) = (&self.variance[here], &self.variance[there.clone()]);
        let known = &self.known[there];
        let columns = [px, py, pz, qx, qy, qz, nx, ny, nz, mx, my, mz, y, z, v, w, known];
        assert!(columns.iter().all(|column| column.len() == count) && weights.len() == count);
        for i in 0..count {
            let apart = squared(px[i] - qx[i]) + squared(py[i] - qy[i]) + squared(pz[i] - qz[i]);
            let facing = (nx[i] * mx[i] + ny[i] * my[i] + nz[i] * mz[i]).max(0.0);
            let spread = DEVIATIONS * (v[i] + w[i]).max(0.0).sqrt();
            let differs = (y[i] - z[i]).abs() / spread.max(1e-30);
            // e^−x, but for its tail.
            let alike = power_32((1.0 - differs / 32.0).max(0.0));
            let weight = kernel * known[i] * power_32(facing) * alike;
            weights[i] = if apart <= near_squared { weight } else { 0.0 };
        }
    }

    /// Puts what is known of a lumel there.
    fn put(&self, number: usize, lumel: &mut Noisy) {
        let three = |first: usize| {
            let values = self.values.get(first..first + 3)?;
            Some(Vec3::from_array([0, 1, 2].map(|k| values[k][number])))
        };
        lumel.irradiance = three(0).unwrap_or_default();
        lumel.slope = three(3).unwrap_or_default();
        lumel.variance = self.variance[number];
    }
}

fn part<'a>(columns: &'a [Vec<f32>; 3], range: &Range<usize>) -> [&'a [f32]; 3] {
    [0, 1, 2].map(|k| &columns[k][range.clone()])
}

fn squared(x: f32) -> f32 {
    x * x
}

fn power_32(x: f32) -> f32 {
    squared(squared(squared(squared(squared(x)))))
}

fn add(sums: &mut [f32], values: &[f32], weights: &[f32]) {
    for ((sum, value), weight) in sums.iter_mut().zip(values).zip(weights) {
        *sum += weight * value;
    }
}

fn add_up(sums: &mut [f32], weights: &[f32]) {
    sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight);
}

/// Adds variances of what is known.
fn add_squared(sums: &mut [f32], variances: &[f32], known: &[f32], weights: &[f32]) {
    for (((sum, variance), known), weight) in sums.iter_mut().zip(variances).zip(known).zip(weights)
    {
        *sum += if *known > 0.0 { weight * weight * variance } else { 0.0 };
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
        filter(&mut even, SIDE, 0.1, 0);
        assert!(error(&even, flat) < 0.25, "{}", error(&even, flat));
        // A shadow's edge, twenty standard deviations high.
        let edge = |number: u32| if number % SIDE < SIDE / 2 { 10.0 } else { 30.0 };
        let mut shadow = page(edge, 1.0);
        filter(&mut shadow, SIDE, 0.1, 0);
        assert!(error(&shadow, edge) < 0.3, "{}", error(&shadow, edge));
        // Without noise nothing changes.
        let slope = |number: u32| number as f32;
        let mut clean = page(slope, 0.0);
        filter(&mut clean, SIDE, 0.1, 0);
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
        filter(&mut sparse, SIDE, 0.1, 0);
        assert!(sparse.iter().flatten().all(|lumel| lumel.variance.is_finite()));
        assert!(error(&sparse, slope) < 0.5, "{}", error(&sparse, slope));
        let mut unknown = page(slope, 0.1);
        unknown.iter_mut().flatten().for_each(|lumel| lumel.variance = f32::INFINITY);
        filter(&mut unknown, SIDE, 0.1, 0);
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
            filter(&mut two, SIDE, 0.1, 0);
            let is_mixed = error(&two, edge) > 0.05;
            assert_eq!(is_mixed, fault == "none", "{fault}: {}", error(&two, edge));
        }
    }
}
