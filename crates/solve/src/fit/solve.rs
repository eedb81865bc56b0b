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
pub(super) const FREE: Order = Order::L2;
/// Coefficients of a probe up to that band.
pub(super) const SIZE: usize = FREE.coefficients();

/// What is read at a point, and what it should be. Light is in units of the mean.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// What irradiance takes of each coefficient.
    basis: [f32; SIZE],
    /// Irradiance.
    target: Vec3,
    /// Irradiance that is read beside what is solved for.
    beside: Vec3,
    /// w.
    weight: f32,
    /// Where what it reads stands in [`System::reads`].
    reads: [usize; 2],
}

impl Row {
    /// Of a point with a world unit normal.
    pub(super) fn new(normal: Vec3, target: Vec3) -> Self {
        let all = sh::cosine_basis(FREE, normal);
        let basis = std::array::from_fn(|k| all[k]);
        Self { basis, target, beside: Vec3::ZERO, weight: 0.0, reads: [0; 2] }
    }

    /// The same where so much irradiance is read beside what is solved for.
    pub(super) fn beside(self, beside: Vec3) -> Self {
        Self { beside, ..self }
    }
}

/// All rows, and what holds probes to their own light.
pub(super) struct System {
    rows: Vec<Row>,
    /// The probes that rows read, and how much each counts there.
    reads: Vec<(u32, f32)>,
    /// Of each probe: the rows that read it, and its share in them.
    readers: Vec<Vec<(u32, f32)>>,
    /// s of each probe.
    stiffness: Vec<f32>,
    /// How many of each probe's coefficients may change.
    free: Vec<usize>,
}

impl System {
    /// Without rows. `stiffness` is s and `free` the number of coefficients that may change, of each
    /// probe.
    pub(super) fn new(stiffness: Vec<f32>, free: Vec<usize>) -> Self {
        let readers = vec![Vec::new(); stiffness.len()];
        Self { rows: Vec::new(), reads: Vec::new(), readers, stiffness, free }
    }

    /// Adds a row that reads these probes by these shares; one that reads none asks for nothing.
    pub(super) fn push(&mut self, row: Row, reads: Vec<(u32, f32)>) {
        if reads.is_empty() {
            return;
        }
        for &(probe, share) in &reads {
            self.readers[probe as usize].push((self.rows.len() as u32, share));
        }
        let first = self.reads.len();
        self.reads.extend(reads);
        self.rows.push(Row { reads: [first, self.reads.len()], ..row });
    }

    /// The irradiance that coefficients show at a row's point.
    fn shown(&self, row: &Row, coefficients: &[Vec3]) -> Vec3 {
        let of = |&(probe, share): &(u32, f32)| {
            let c = &coefficients[probe as usize * SIZE..][..SIZE];
            share * c.iter().zip(&row.basis).map(|(c, b)| *c * *b).sum::<Vec3>()
        };
        let [from, to] = row.reads;
        self.reads[from..to].iter().map(of).sum()
    }

    fn read(&self, coefficients: &[Vec3]) -> Vec<Vec3> {
        self.rows.par_iter().map(|row| self.shown(row, coefficients)).collect()
    }

    /// Sets every row's weight from the irradiance that coefficients show there.
    pub(super) fn weigh(&mut self, coefficients: &[Vec3], weight: impl Fn(Vec3) -> f32 + Sync) {
        let shown = self.read(coefficients);
        self.rows
            .par_iter_mut()
            .zip(shown)
            .for_each(|(row, shown)| row.weight = weight(shown + row.beside));
    }

    /// s A²/4π of each coefficient.
    fn hold(&self) -> Vec<f32> {
        let factor: [f32; SIZE] = std::array::from_fn(|k| COSINE[sh::BAND[k]].powi(2) / (4.0 * PI));
        self.stiffness.iter().flat_map(|s| factor.map(|factor| s * factor)).collect()
    }

    /// The inverse of the diagonal of the normal equations; 0 of coefficients that stay: those on which
    /// nothing depends, and those that are not free.
    fn preconditioner(&self, hold: &[f32]) -> Vec<f32> {
        let mut diagonal = hold.to_vec();
        diagonal.par_chunks_mut(SIZE).zip(&self.readers).for_each(|(diagonal, readers)| {
            for (row, share) in readers {
                let row = &self.rows[*row as usize];
                for (d, b) in diagonal.iter_mut().zip(row.basis) {
                    *d += row.weight * (share * b).powi(2);
                }
            }
        });
        let inverse = |(i, d): (usize, &f32)| {
            let moves = *d > 0.0 && i % SIZE < self.free[i / SIZE];
            if moves { 1.0 / *d } else { 0.0 }
        };
        diagonal.iter().enumerate().map(inverse).collect()
    }

    /// Adds to the coefficients of every probe what rows with these values hand back to it.
    fn add_transposed(&self, values: &[Vec3], coefficients: &mut [Vec3]) {
        coefficients.par_chunks_mut(SIZE).zip(&self.readers).for_each(|(coefficients, readers)| {
            for (r, share) in readers {
                let row = &self.rows[*r as usize];
                let value = row.weight * share * values[*r as usize];
                for (c, b) in coefficients.iter_mut().zip(row.basis) {
                    *c += b * value;
                }
            }
        });
    }

    /// Brings `found` nearer to the solution, by so many steps at most.
    pub(super) fn solve(&self, found: &mut [Vec3], gathered: &[Vec3], steps: u32) {
        let hold = self.hold();
        let preconditioner = self.preconditioner(&hold);
        let preconditioned = |residual: &[Vec3]| -> Vec<Vec3> {
            residual.iter().zip(&preconditioner).map(|(r, p)| *r * *p).collect()
        };
        let shown = self.read(found);
        let missing: Vec<Vec3> =
            shown.iter().zip(&self.rows).map(|(s, row)| row.target - row.beside - s).collect();
        let mut residual: Vec<Vec3> =
            found.iter().zip(gathered).zip(&hold).map(|((x, g), hold)| *hold * (*g - *x)).collect();
        self.add_transposed(&missing, &mut residual);
        let mut direction = preconditioned(&residual);
        let mut left = inner(&residual, &direction);
        let enough = left * ENOUGH;
        for _ in 0..steps {
            if left.cmple(enough).all() {
                break;
            }
            let mut image: Vec<Vec3> = direction.iter().zip(&hold).map(|(d, h)| *d * *h).collect();
            self.add_transposed(&self.read(&direction), &mut image);
            let length = ratio(left, inner(&direction, &image));
            for (x, d) in found.iter_mut().zip(&direction) {
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
    use crate::random::{mix, unit};

    const PROBES: usize = 3;
    const UNKNOWNS: usize = PROBES * SIZE;

    fn number(seed: u64) -> f32 {
        unit(mix(seed) as u32)
    }

    /// Rows with the probes that they read, two or three each.
    fn rows(count: u64) -> Vec<(Row, Vec<(u32, f32)>)> {
        let row = |i: u64| {
            let direction = Vec3::from_array([0, 1, 2].map(|k| number(16 * i + k) - 0.5));
            let target = Vec3::new(1.0, number(16 * i + 5), number(16 * i + 6));
            let share = number(16 * i + 3);
            let shares = [share, 0.7 * (1.0 - share), 0.3 * (1.0 - share)];
            let reads =
                (0..2 + i % 2).map(|k| (((k + i) % PROBES as u64) as u32, shares[k as usize]));
            let row = Row::new(direction.normalize(), target);
            (row.beside(Vec3::splat(0.1 * number(16 * i + 7))), reads.collect())
        };
        (0..count).map(row).collect()
    }

    fn system(rows: &[(Row, Vec<(u32, f32)>)], stiffness: [f32; PROBES]) -> System {
        let mut system = System::new(stiffness.to_vec(), vec![SIZE; PROBES]);
        rows.iter().for_each(|(row, reads)| system.push(row.clone(), reads.clone()));
        let mut number = 0;
        // Each row has a weight of its own.
        system.rows.iter_mut().for_each(|row| {
            row.weight = 0.2 + self::number(16 * number + 4);
            number += 1;
        });
        system
    }

    /// The normal equations written out and solved by elimination, first channel to last.
    fn by_elimination(system: &System, gathered: &[Vec3]) -> Vec<Vec3> {
        let mut matrix = vec![[0.0_f64; UNKNOWNS + 3]; UNKNOWNS];
        for i in 0..UNKNOWNS {
            let factor = COSINE[sh::BAND[i % SIZE]].powi(2) / (4.0 * PI);
            let hold = f64::from(system.stiffness[i / SIZE] * factor);
            matrix[i][i] += hold;
            for channel in 0..3 {
                matrix[i][UNKNOWNS + channel] += hold * f64::from(gathered[i][channel]);
            }
        }
        for row in &system.rows {
            let mut line = [0.0_f64; UNKNOWNS];
            for (probe, share) in &system.reads[row.reads[0]..row.reads[1]] {
                for (k, b) in row.basis.into_iter().enumerate() {
                    line[*probe as usize * SIZE + k] += f64::from(share * b);
                }
            }
            for i in 0..UNKNOWNS {
                let scaled = f64::from(row.weight) * line[i];
                (0..UNKNOWNS).for_each(|j| matrix[i][j] += scaled * line[j]);
                for channel in 0..3 {
                    let wanted = row.target[channel] - row.beside[channel];
                    matrix[i][UNKNOWNS + channel] += scaled * f64::from(wanted);
                }
            }
        }
        for i in 0..UNKNOWNS {
            let pivot = matrix[i][i];
            matrix[i].iter_mut().for_each(|value| *value /= pivot);
            let line = matrix[i];
            for (_, other) in matrix.iter_mut().enumerate().filter(|(j, _)| *j != i) {
                let factor = other[i];
                other.iter_mut().zip(line).for_each(|(value, l)| *value -= factor * l);
            }
        }
        let solution = |l: &[f64; UNKNOWNS + 3]| [0, 1, 2].map(|c| l[UNKNOWNS + c] as f32);
        matrix.iter().map(|line| Vec3::from_array(solution(line))).collect()
    }

    fn farthest(a: &[Vec3], b: &[Vec3]) -> f32 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs().max_element()).fold(0.0, f32::max)
    }

    #[test]
    fn the_solution_is_that_of_the_normal_equations() {
        let gathered: Vec<Vec3> =
            (0..UNKNOWNS as u64).map(|i| Vec3::splat(number(900 + i)) - 0.5).collect();
        let mut system = system(&rows(60), [1.0, 0.05, 3.0]);
        let expected = by_elimination(&system, &gathered);
        assert!(farthest(&expected, &gathered) > 0.3, "the rows ask for something");
        for start in [gathered.clone(), vec![Vec3::splat(7.0); UNKNOWNS]] {
            let mut found = start;
            // It stops at a share of the error that it begins with.
            (0..3).for_each(|_| system.solve(&mut found, &gathered, 200));
            assert!(farthest(&found, &expected) < 2e-3, "{}", farthest(&found, &expected));
        }
        system.rows.iter_mut().for_each(|row| row.weight *= 1.0 + row.basis[3]);
        let other = by_elimination(&system, &gathered);
        assert!(farthest(&other, &expected) > 2e-2, "weights matter to this test");
    }

    #[test]
    fn coefficients_that_nothing_depends_on_or_that_are_not_free_stay() {
        let system = System::new(vec![0.0, 1.0, 1.0], vec![SIZE, 4, SIZE]);
        let mut found = vec![Vec3::ONE; UNKNOWNS];
        system.solve(&mut found, &vec![Vec3::splat(2.0); UNKNOWNS], 50);
        let [stay, solved] = [Vec3::ONE, Vec3::splat(2.0)];
        assert_eq!(found[..SIZE], [stay; SIZE]);
        assert!(farthest(&found[SIZE..SIZE + 4], &[solved; 4]) < 1e-4);
        assert_eq!(found[SIZE + 4..2 * SIZE], [stay; SIZE - 4]);
        assert!(farthest(&found[2 * SIZE..], &[solved; SIZE]) < 1e-4);
    }
}
