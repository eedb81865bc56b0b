//! Sums over patches of a page.

use std::ops::Range;

/// Lumels of a patch to each side of its middle.
pub(super) const PATCH: usize = 2;

/// Numbers of lumels, and their sums over patches.
pub(super) struct Patches {
    own: Vec<f32>,
    rows: Vec<f32>,
    sums: Vec<f32>,
}

impl Patches {
    pub(super) fn new(count: usize) -> Self {
        let [own, rows, sums] = [0, 1, 2].map(|_| vec![0.0; count]);
        Self { own, rows, sums }
    }

    /// Room for the numbers of some; those of others become 0.
    #[inline(always)]
    pub(super) fn own(&mut self, range: &Range<usize>) -> &mut [f32] {
        self.own[..range.start].fill(0.0);
        self.own[range.end..].fill(0.0);
        &mut self.own[range.clone()]
    }

    /// The numbers of some, and sums over the patches about them.
    #[inline(always)]
    pub(super) fn add_up(&mut self, side: usize, range: &Range<usize>) -> [&[f32]; 2] {
        let all = self.own.len();
        let rows = range.start.saturating_sub(PATCH * side)..(range.end + PATCH * side).min(all);
        sum_about(&self.own, 1, &rows, &mut self.rows);
        sum_about(&self.rows, side, range, &mut self.sums);
        [&self.own[range.clone()], &self.sums[range.clone()]]
    }
}

/// Sums of numbers that are up to [`PATCH`] times a stride off, for a range of them.
#[inline(always)]
fn sum_about(numbers: &[f32], stride: usize, range: &Range<usize>, sums: &mut [f32]) {
    let off = PATCH * stride;
    // Near the ends there are fewer.
    let inner = range.start.max(off)..range.end.min(numbers.len() - off);
    let ends =
        (range.start..inner.start.min(range.end)).chain(inner.end.max(range.start)..range.end);
    for i in ends {
        let all = (0..=2 * PATCH).filter_map(|k| numbers.get((i + k * stride).checked_sub(off)?));
        sums[i] = all.sum();
    }
    let count = inner.len();
    let sums = &mut sums[inner.clone()];
    let [a, b, c, d, e] =
        [0, 1, 2, 3, 4].map(|k| &numbers[inner.start + k * stride - off..][..count]);
    for i in 0..count {
        sums[i] = a[i] + b[i] + c[i] + d[i] + e[i];
    }
}
