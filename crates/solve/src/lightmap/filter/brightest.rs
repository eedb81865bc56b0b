//! The brightest lumels about each.

use std::ops::Range;

/// The luminances of the brightest two lumels that lie about each on its surface; 0 where there are fewer.
pub(super) struct Brightest {
    first: Vec<f32>,
    pub(super) second: Vec<f32>,
}

impl Brightest {
    pub(super) fn new(count: usize) -> Self {
        Self { first: vec![0.0; count], second: vec![0.0; count] }
    }

    /// Takes in a neighbour of each of some lumels: its luminance, and how far it lies beside it.
    #[inline(always)]
    pub(super) fn take(&mut self, lumels: &Range<usize>, luminance: &[f32], beside: &[f32]) {
        let neighbours = luminance.iter().zip(beside);
        let known = self.first[lumels.clone()].iter_mut().zip(&mut self.second[lumels.clone()]);
        for ((first, second), (luminance, beside)) in known.zip(neighbours) {
            let luminance = luminance * beside;
            *second = second.max(luminance.min(*first));
            *first = first.max(luminance);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_is_found_in_any_order() {
        for order in [[1.0, 2.0, 3.0], [3.0, 1.0, 2.0], [2.0, 3.0, 1.0], [3.0, 2.0, 1.0]] {
            let mut brightest = Brightest::new(3);
            order.iter().for_each(|luminance| brightest.take(&(1..2), &[*luminance], &[1.0]));
            brightest.take(&(1..2), &[9.0], &[0.0]);
            assert_eq!(
                (brightest.first, brightest.second),
                (vec![0.0, 3.0, 0.0], vec![0.0, 2.0, 0.0])
            );
        }
    }
}
