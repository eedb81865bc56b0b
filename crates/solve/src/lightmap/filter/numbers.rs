//! What is done to columns of numbers.

use std::ops::Range;

/// The first numbers of columns: compilers know that there are so many.
#[inline(always)]
pub(super) fn long<const N: usize>(columns: [&[f32]; N], count: usize) -> [&[f32]; N] {
    columns.map(|column| &column[..count])
}

/// What lies a shift on.
#[inline(always)]
pub(super) fn after(range: &Range<usize>, shift: usize) -> Range<usize> {
    range.start + shift..range.end + shift
}

/// What lies a shift back.
#[inline(always)]
pub(super) fn before(range: &Range<usize>, shift: usize) -> Range<usize> {
    range.start - shift..range.end - shift
}

#[inline(always)]
pub(super) fn squared(x: f32) -> f32 {
    x * x
}

#[inline(always)]
pub(super) fn power_32(x: f32) -> f32 {
    squared(squared(squared(squared(squared(x)))))
}

/// Adds values by their weights.
#[inline(always)]
pub(super) fn add(sums: &mut [f32], values: &[f32], weights: &[f32]) {
    for ((sum, value), weight) in sums.iter_mut().zip(values).zip(weights) {
        *sum += weight * value;
    }
}
