//! Lumels beside each other, compared.

use std::ops::Range;

use super::columns::{Columns, part};
use super::numbers::{after, long, power_32, squared};
use super::patches::{PATCH, Patches};

/// A single lumel may differ by so many times the standard deviation of both: an edge is thinner than a
/// patch.
const DEVIATIONS: f32 = 1.5;
/// Light that differs by so many times more than noise explains counts by 1/e.
const SURPRISE: f32 = 1.5;

/// What lumels and those a shift on are to each other, by the first one's place.
pub(super) struct Pairs {
    /// How far they lie on one surface: 0 to 1.
    pub(super) beside: Vec<f32>,
    /// How far the light about both is the same: 0 to 1.
    pub(super) alike: Vec<f32>,
    /// Squares of differences of luminance.
    squares: Patches,
    /// What noise makes of them.
    expected: Patches,
}

impl Pairs {
    pub(super) fn new(count: usize) -> Self {
        let [beside, alike] = [0, 1].map(|_| vec![0.0; count]);
        let [squares, expected] = [0, 1].map(|_| Patches::new(count));
        Self { beside, alike, squares, expected }
    }

    /// Finds who lies beside whom on a surface, within a squared distance. Returns those of the first ones
    /// that have another.
    #[inline(always)]
    pub(super) fn find(
        &mut self,
        of: &Columns,
        first: Range<usize>,
        shift: usize,
        near_squared: f32,
    ) -> Range<usize> {
        let here = first.start..first.end.min(self.beside.len().saturating_sub(shift));
        let there = after(&here, shift);
        let ([px, py, pz], [qx, qy, qz]) = (part(&of.position, &here), part(&of.position, &there));
        let ([nx, ny, nz], [mx, my, mz]) = (part(&of.normal, &here), part(&of.normal, &there));
        let beside = &mut self.beside[here.clone()];
        let count = beside.len();
        let [px, py, pz, qx, qy, qz] = long([px, py, pz, qx, qy, qz], count);
        let [nx, ny, nz, mx, my, mz] = long([nx, ny, nz, mx, my, mz], count);
        // Loops over more columns at a time are not done by vectors.
        for i in 0..count {
            beside[i] = squared(px[i] - qx[i]) + squared(py[i] - qy[i]) + squared(pz[i] - qz[i]);
        }
        for i in 0..count {
            let facing = (nx[i] * mx[i] + ny[i] * my[i] + nz[i] * mz[i]).max(0.0);
            beside[i] = if beside[i] <= near_squared { power_32(facing) } else { 0.0 };
        }
        here
    }

    /// Finds who lies beside whom, and compares their light, for all pairs of which one is wanted.
    #[inline(always)]
    pub(super) fn compare(
        &mut self,
        of: &Columns,
        wanted: &Range<usize>,
        shift: usize,
        near_squared: f32,
    ) {
        let first = wanted.start.saturating_sub(shift)..wanted.end;
        let patch = PATCH * of.side + PATCH;
        let about = first.start.saturating_sub(patch)..(first.end + patch).min(of.samples.len());
        let here = self.find(of, about, shift, near_squared);
        let there = after(&here, shift);
        let (y, z) = (&of.luminance[here.clone()], &of.luminance[there.clone()]);
        let (v, w) = (&of.variance[here.clone()], &of.variance[there.clone()]);
        let (known, is_there) = (&of.known[here.clone()], &of.known[there]);
        let beside = &self.beside[here.clone()];
        let [squares, expected] =
            [&mut self.squares, &mut self.expected].map(|patches| patches.own(&here));
        let count = here.len();
        let [y, z, v, w, known, is_there, beside] =
            long([y, z, v, w, known, is_there, beside], count);
        let (squares, expected) = (&mut squares[..count], &mut expected[..count]);
        for i in 0..count {
            squares[i] = beside[i] * known[i] * is_there[i] * squared(y[i] - z[i]);
        }
        for i in 0..count {
            expected[i] = beside[i] * known[i] * is_there[i] * (v[i] + w[i]);
        }
        let first = first.start..first.end.min(here.end);
        let [squares, expected] =
            [&mut self.squares, &mut self.expected].map(|patches| patches.add_up(of.side, &first));
        let alike = &mut self.alike[first];
        let count = alike.len();
        let ([s, all_s], [e, all_e]) = (long(squares, count), long(expected, count));
        for (i, alike) in alike.iter_mut().enumerate() {
            let own = s[i] / e[i].max(f32::MIN_POSITIVE);
            let all = all_s[i] / all_e[i].max(f32::MIN_POSITIVE);
            let surprise = all.max(own / (DEVIATIONS * DEVIATIONS)) - 1.0;
            // e^(−surprise / SURPRISE), but for its tail.
            *alike = power_32((1.0 - surprise.max(0.0) / (32.0 * SURPRISE)).max(0.0));
        }
    }
}
