//! Numbers of many vertices, laid out so that loops over vertices become vector instructions.
//!
//! What is computed at a vertex is written for one vertex, and called in a loop over a group of
//! them. All such functions are inlined, without calls, panics or stores that depend on a branch, so
//! the compiler computes eight vertices at a time where the processor can; results do not depend
//! on whether it does.

/// Vertices that are shaded together: vertices and texels of all of them are asked for before the
/// first is needed, and stay in the first level of cache with all that is computed of them.
pub(super) const GROUP: usize = 16;

/// N numbers of each vertex of a group: the first of all vertices, then the second of all, and so on.
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

    /// The same for all vertices.
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
