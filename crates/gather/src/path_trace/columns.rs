//! Values of many vertices, laid out so that loops over vertices are vectorised.
//!
//! A computation is written for one vertex and called in a loop over a group. All such functions
//! are inlined, without calls, panics or stores that depend on a branch. So the compiler computes
//! eight vertices at a time where the processor can. Results do not depend on whether it does.

/// Number of vertices that are shaded together. Data of all of them is prefetched before the first
/// is needed. It stays in the first-level cache with all intermediate values.
pub(super) const GROUP: usize = 16;

/// N numbers of each vertex of a group: the first of all vertices, then the second of all, and so
/// on.
#[derive(Clone, Debug)]
pub(super) struct Columns<const N: usize, T = f32>([[T; GROUP]; N]);

impl<const N: usize, T: Copy> Columns<N, T> {
    /// The numbers of one vertex.
    #[inline(always)]
    pub(super) fn get(&self, vertex: usize) -> [T; N] {
        std::array::from_fn(|n| self.0[n][vertex])
    }

    #[inline(always)]
    pub(super) fn set(&mut self, vertex: usize, numbers: [T; N]) {
        for (column, number) in self.0.iter_mut().zip(numbers) {
            column[vertex] = number;
        }
    }

    /// Sets the same numbers for all vertices.
    #[inline(always)]
    pub(super) fn fill(&mut self, numbers: [T; N]) {
        self.0 = numbers.map(|number| [number; GROUP]);
    }
}

impl<const N: usize, T: Copy + Default> Default for Columns<N, T> {
    fn default() -> Self {
        Self([[T::default(); GROUP]; N])
    }
}
