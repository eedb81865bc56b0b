//! The least-squares problem, solved by conjugate gradients without a matrix.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use lumencast_light::sh::{self, Order};
use lumencast_light::zh::COSINE;
use rayon::prelude::*;

/// Solved when the residual, as the preconditioner measures it, has fallen to this share of its
/// square.
const ENOUGH: f64 = 1e-7;

/// The highest band that is solved for. Irradiance hardly depends on those above, so that little of it
/// would be mended by much of them, at the price of specular light.
pub(super) const FREE: usize = 2;

/// What is read at a point, and what it should be.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// The probes it is read from, and how much each counts.
    pub(super) probes: [u32; 8],
    pub(super) shares: [f32; 8],
    /// World unit normal.
    pub(super) normal: Vec3,
    /// w.
    pub(super) weight: f32,
    /// Irradiance, in units of the mean.
    pub(super) target: Vec3,
}

impl Row {
    fn basis(&self, order: Order) -> [f32; sh::MAX_COEFFICIENTS] {
        sh::cosine_basis(order, self.normal)
    }

    /// The irradiance that coefficients show.
    fn read(&self, order: Order, coefficients: &[Vec3]) -> Vec3 {
        let (n, basis) = (order.coefficients(), self.basis(order));
        let probe = |(probe, share): (&u32, &f32)| {
            let c = &coefficients[*probe as usize * n..][..n];
            *share * c.iter().zip(&basis).map(|(c, b)| *c * *b).sum::<Vec3>()
        };
        self.probes.iter().zip(&self.shares).map(probe).sum()
    }
}

/// All rows, and what holds probes to their own light.
pub(super) struct System {
    order: Order,
    rows: Vec<Row>,
    /// Of each probe: the rows that read it, and its share in them.
    readers: Vec<Vec<(u32, f32)>>,
    /// s A²/4π, of each coefficient.
    hold: Vec<f32>,
}

impl System {
    /// `stiffness` is s, of each probe.
    pub(super) fn new(order: Order, rows: Vec<Row>, stiffness: &[f32]) -> Self {
        let n = order.coefficients();
        let mut readers = vec![Vec::new(); stiffness.len()];
        for (r, row) in (0..).zip(&rows) {
            for (probe, share) in row.probes.iter().zip(row.shares).filter(|(_, s)| *s > 0.0) {
                readers[*probe as usize].push((r, share));
            }
        }
        let hold = |probe: &f32| {
            let factor = move |k: usize| *probe * COSINE[sh::BAND[k]].powi(2) / (4.0 * PI);
            (0..n).map(factor).collect::<Vec<f32>>()
        };
        let hold: Vec<f32> = stiffness.iter().flat_map(hold).collect();
        Self { order, rows, readers, hold }
    }

    /// Sets every row's weight from the irradiance that coefficients show there.
    pub(super) fn weigh(&mut self, coefficients: &[Vec3], weight: impl Fn(Vec3) -> f32 + Sync) {
        let order = self.order;
        self.rows.par_iter_mut().for_each(|row| row.weight = weight(row.read(order, coefficients)));
    }

    /// The inverse of the diagonal of the normal equations; 0 of coefficients that stay: those on which
    /// nothing depends, and those above [`FREE`].
    fn preconditioner(&self) -> Vec<f32> {
        let n = self.order.coefficients();
        let mut preconditioner = self.diagonal();
        for (i, d) in preconditioner.iter_mut().enumerate() {
            let moves = *d > 0.0 && sh::BAND[i % n] <= FREE;
            *d = if moves { 1.0 / *d } else { 0.0 };
        }
        preconditioner
    }

    fn diagonal(&self) -> Vec<f32> {
        let mut diagonal = self.hold.clone();
        let n = self.order.coefficients();
        diagonal.par_chunks_mut(n).zip(&self.readers).for_each(|(diagonal, readers)| {
            for (row, share) in readers {
                let row = &self.rows[*row as usize];
                let basis = row.basis(self.order);
                for (d, b) in diagonal.iter_mut().zip(basis) {
                    *d += row.weight * (share * b).powi(2);
                }
            }
        });
        diagonal
    }

    /// Adds to the coefficients of every probe what rows with these values hand back to it.
    fn add_transposed(&self, values: &[Vec3], coefficients: &mut [Vec3]) {
        let n = self.order.coefficients();
        coefficients.par_chunks_mut(n).zip(&self.readers).for_each(|(coefficients, readers)| {
            for (r, share) in readers {
                let row = &self.rows[*r as usize];
                let value = row.weight * share * values[*r as usize];
                for (c, b) in coefficients.iter_mut().zip(row.basis(self.order)) {
                    *c += b * value;
                }
            }
        });
    }

    fn read(&self, coefficients: &[Vec3]) -> Vec<Vec3> {
        self.rows.par_iter().map(|row| row.read(self.order, coefficients)).collect()
    }

    /// Brings `coefficients` nearer to the solution, by so many steps at most. Light is in units of
    /// `mean` within, so that squares neither overflow nor vanish.
    pub(super) fn solve(
        &self,
        coefficients: &mut [Vec3],
        gathered: &[Vec3],
        mean: f32,
        steps: u32,
    ) {
        let preconditioner = self.preconditioner();
        let preconditioned = |residual: &[Vec3]| -> Vec<Vec3> {
            residual.iter().zip(&preconditioner).map(|(r, p)| *r * *p).collect()
        };
        let mut x: Vec<Vec3> = coefficients.iter().map(|c| *c / mean).collect();
        let missing: Vec<Vec3> =
            self.read(&x).iter().zip(&self.rows).map(|(read, row)| row.target - read).collect();
        let mut residual: Vec<Vec3> = x
            .iter()
            .zip(gathered)
            .zip(&self.hold)
            .map(|((x, g), hold)| *hold * (*g / mean - x))
            .collect();
        self.add_transposed(&missing, &mut residual);
        let mut direction = preconditioned(&residual);
        let mut left = inner(&residual, &direction);
        let enough = left * ENOUGH;
        for _ in 0..steps {
            if left.cmple(enough).all() {
                break;
            }
            let mut image: Vec<Vec3> =
                direction.iter().zip(&self.hold).map(|(d, hold)| *d * *hold).collect();
            self.add_transposed(&self.read(&direction), &mut image);
            let length = ratio(left, inner(&direction, &image));
            for (x, d) in x.iter_mut().zip(&direction) {
                *x += length * d;
            }
            for (r, i) in residual.iter_mut().zip(&image) {
                *r -= length * i;
            }
            let next = preconditioned(&residual);
            let rest = inner(&residual, &next);
            let turn = ratio(rest, left);
            for (d, n) in direction.iter_mut().zip(&next) {
                *d = n + turn * *d;
            }
            left = rest;
        }
        for (c, x) in coefficients.iter_mut().zip(x) {
            *c = x * mean;
        }
    }
}

/// Of each channel.
fn inner(a: &[Vec3], b: &[Vec3]) -> DVec3 {
    a.iter().zip(b).map(|(a, b)| a.as_dvec3() * b.as_dvec3()).sum()
}

/// Of each channel; 0 where nothing is left to divide.
fn ratio(a: DVec3, b: DVec3) -> Vec3 {
    DVec3::select(b.cmpgt(DVec3::ZERO), a / b, DVec3::ZERO).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{mix, unit};

    const PROBES: usize = 3;
    const ORDER: Order = Order::L2;
    const SIZE: usize = PROBES * 9;

    fn number(seed: u64) -> f32 {
        unit(mix(seed) as u32)
    }

    fn rows(count: u64) -> Vec<Row> {
        let row = |i: u64| {
            let direction = Vec3::from_array([0, 1, 2].map(|k| number(16 * i + k) - 0.5));
            let share = number(16 * i + 3);
            Row {
                probes: [0, 1, 2, 2, 0, 1, 1, 0].map(|p| (p + i as u32) % PROBES as u32),
                shares: [share, 1.0 - share, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                normal: direction.normalize(),
                weight: 0.2 + number(16 * i + 4),
                target: Vec3::new(1.0, number(16 * i + 5), number(16 * i + 6)),
            }
        };
        (0..count).map(row).collect()
    }

    /// The normal equations written out and solved by elimination, first channel to last.
    fn by_elimination(rows: &[Row], stiffness: &[f32], gathered: &[Vec3]) -> Vec<Vec3> {
        let mut matrix = vec![[0.0_f64; SIZE + 3]; SIZE];
        for i in 0..SIZE {
            let hold = f64::from(stiffness[i / 9]) * f64::from(COSINE[sh::BAND[i % 9]]).powi(2)
                / (4.0 * std::f64::consts::PI);
            matrix[i][i] += hold;
            for channel in 0..3 {
                matrix[i][SIZE + channel] += hold * f64::from(gathered[i][channel]);
            }
        }
        for row in rows {
            let basis = sh::cosine_basis(ORDER, row.normal);
            let mut line = [0.0_f64; SIZE];
            for (probe, share) in row.probes.iter().zip(row.shares) {
                for k in 0..9 {
                    line[*probe as usize * 9 + k] += f64::from(share * basis[k]);
                }
            }
            for i in 0..SIZE {
                let scaled = f64::from(row.weight) * line[i];
                (0..SIZE).for_each(|j| matrix[i][j] += scaled * line[j]);
                for channel in 0..3 {
                    matrix[i][SIZE + channel] += scaled * f64::from(row.target[channel]);
                }
            }
        }
        for i in 0..SIZE {
            let pivot = matrix[i][i];
            matrix[i].iter_mut().for_each(|value| *value /= pivot);
            let line = matrix[i];
            for (_, other) in matrix.iter_mut().enumerate().filter(|(j, _)| *j != i) {
                let factor = other[i];
                other.iter_mut().zip(line).for_each(|(value, l)| *value -= factor * l);
            }
        }
        matrix.iter().map(|l| Vec3::from_array([0, 1, 2].map(|c| l[SIZE + c] as f32))).collect()
    }

    fn farthest(a: &[Vec3], b: &[Vec3]) -> f32 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs().max_element()).fold(0.0, f32::max)
    }

    #[test]
    fn the_solution_is_that_of_the_normal_equations() {
        let gathered: Vec<Vec3> =
            (0..SIZE as u64).map(|i| Vec3::splat(number(900 + i)) - 0.5).collect();
        let stiffness = [1.0, 0.05, 3.0];
        let rows = rows(60);
        let expected = by_elimination(&rows, &stiffness, &gathered);
        assert!(farthest(&expected, &gathered) > 0.3, "the rows ask for something");
        let system = System::new(ORDER, rows.clone(), &stiffness);
        for start in [gathered.clone(), vec![Vec3::splat(7.0); SIZE]] {
            let mut found = start;
            // It stops at a share of the error that it begins with.
            (0..3).for_each(|_| system.solve(&mut found, &gathered, 1.0, 200));
            assert!(farthest(&found, &expected) < 2e-3, "{}", farthest(&found, &expected));
        }
        let heavier: Vec<Row> = rows
            .into_iter()
            .map(|row| Row { weight: row.weight * (1.0 + row.normal.x), ..row })
            .collect();
        let other = by_elimination(&heavier, &stiffness, &gathered);
        assert!(farthest(&other, &expected) > 2e-2, "weights matter to this test");
    }

    /// In units of another mean, as bright as the sun and as dim as the stars.
    #[test]
    fn light_may_have_any_scale() {
        let gathered = vec![Vec3::ONE; SIZE];
        let system = System::new(ORDER, rows(60), &[1.0; PROBES]);
        let mut one = gathered.clone();
        system.solve(&mut one, &gathered, 1.0, 200);
        for mean in [1e-12, 1e12] {
            let scaled: Vec<Vec3> = gathered.iter().map(|g| g * mean).collect();
            let mut found = scaled.clone();
            system.solve(&mut found, &scaled, mean, 200);
            let found: Vec<Vec3> = found.iter().map(|c| c / mean).collect();
            assert!(farthest(&found, &one) < 1e-5);
        }
    }

    #[test]
    fn coefficients_that_nothing_depends_on_stay() {
        let system = System::new(ORDER, Vec::new(), &[0.0, 1.0, 1.0]);
        let mut found = vec![Vec3::ONE; SIZE];
        system.solve(&mut found, &vec![Vec3::splat(2.0); SIZE], 1.0, 50);
        assert_eq!(found[..9], [Vec3::ONE; 9]);
        assert!(farthest(&found[9..], &[Vec3::splat(2.0); 18]) < 1e-4);
    }
}
