//! Slices in huge pages.
//!
//! Incoherent rays touch single cache lines scattered over tens of megabytes. Those lie in more 4
//! KiB pages than the processor's TLB holds. In 2 MiB pages, which Linux gives on request only,
//! closest-hit rays on Sponza are 6 % faster.

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use bytemuck::Pod;
use memmap2::MmapMut;
use rayon::prelude::*;

const HUGE: usize = 2 << 20;
/// Least number of values that a thread makes.
const RUN: usize = 256;

/// A slice of fixed length. It lies in huge pages where it is large enough and the system has them.
pub(super) enum Pages<T> {
    Few(Vec<T>),
    Mapped { memory: MmapMut, first: usize, bytes: usize, of: PhantomData<T> },
}

impl<T: Pod + Send + Sync> Pages<T> {
    /// A slice of `count` values whose bytes are all 0.
    pub(super) fn zeroed(count: usize) -> Self {
        let bytes = count * size_of::<T>();
        let mapped = if bytes < HUGE { None } else { map(bytes) };
        match mapped {
            None => Self::Few(vec![T::zeroed(); count]),
            Some(memory) => {
                let first = memory.as_ptr().align_offset(HUGE);
                Self::Mapped { memory, first, bytes, of: PhantomData }
            }
        }
    }

    /// A slice of `count` values, which several threads compute in place.
    pub(super) fn filled(count: usize, value: impl Fn(usize) -> T + Send + Sync) -> Self {
        let mut pages = Self::zeroed(count);
        let places = pages.par_iter_mut().with_min_len(RUN).enumerate();
        places.for_each(|(n, place)| *place = value(n));
        pages
    }

    /// Concatenates slices.
    pub(super) fn concat(parts: &[impl AsRef<[T]> + Sync]) -> Self {
        let lengths = || parts.iter().map(|part| part.as_ref().len());
        let mut pages = Self::zeroed(lengths().sum());
        let places = split(&mut pages, lengths()).into_par_iter().zip(parts);
        places.for_each(|(places, part)| places.copy_from_slice(part.as_ref()));
        pages
    }
}

impl<T> From<Vec<T>> for Pages<T> {
    fn from(values: Vec<T>) -> Self {
        Self::Few(values)
    }
}

/// Splits a slice into parts of these lengths, whose sum is the slice's length.
pub(super) fn split<T>(mut rest: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let parts = lengths.map_while(|length| rest.split_off_mut(..length));
    parts.collect()
}

/// Maps memory for `bytes` bytes that begin at a multiple of the huge page size.
fn map(bytes: usize) -> Option<MmapMut> {
    let memory = MmapMut::map_anon(bytes + HUGE).ok()?;
    #[cfg(target_os = "linux")]
    {
        // If the system refuses, pages are small and all else stays the same.
        let _ = memory.advise(memmap2::Advice::HugePage);
    }
    Some(memory)
}

impl<T: Pod> Deref for Pages<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match self {
            Self::Few(values) => values,
            Self::Mapped { memory, first, bytes, .. } => {
                bytemuck::cast_slice(&memory[*first..first + bytes])
            }
        }
    }
}

impl<T: Pod> DerefMut for Pages<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match self {
            Self::Few(values) => values,
            Self::Mapped { memory, first, bytes, .. } => {
                bytemuck::cast_slice_mut(&mut memory[*first..*first + *bytes])
            }
        }
    }
}

impl<T: Pod + Send + Sync> Clone for Pages<T> {
    fn clone(&self) -> Self {
        Self::filled(self.len(), |n| self[n])
    }
}

impl<T> fmt::Debug for Pages<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pages").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hold_what_was_put_in() {
        for count in [0, 3, HUGE / 4, HUGE + 5] {
            let values: Vec<u32> = (0..count as u32).collect();
            let mut pages = Pages::filled(values.len(), |n| values[n]);
            assert_eq!(*pages, *values);
            if let Some(last) = pages.last_mut() {
                *last = 7;
            }
            assert_eq!(pages.clone().last(), pages.last());
        }
    }
}
