//! Which lumels of a page are others than they were.
//!
//! Most of a page stays as it is from one update to the next. A page is looked at by squares, each of
//! which is told from what it was by a hash: that takes a tenth of the time that codes take.

use glam::Vec3;

/// Lumels a side of a square.
pub(crate) const SQUARE: usize = 16;
/// Odd, so that no two states become one (Fowler, Noll and Vo's).
const PRIME: u64 = 0x0000_0100_0000_01b3;

/// What a page was when it was looked at last.
#[derive(Clone, Debug)]
pub(crate) struct PageNews {
    page_size: usize,
    squares: Vec<Square>,
}

#[derive(Clone, Copy, Debug)]
struct Square {
    hash: Option<u64>,
    /// The brightest channel; what is not finite does not count.
    brightest: f32,
    is_new: bool,
}

impl PageNews {
    /// A page that was never looked at.
    pub(crate) fn new(page_size: u32) -> Self {
        let page_size = page_size as usize;
        let square = Square { hash: None, brightest: 0.0, is_new: true };
        Self { page_size, squares: vec![square; page_size.div_ceil(SQUARE).pow(2)] }
    }

    /// Looks at a page, row after row.
    pub(crate) fn look(&mut self, page: &[Vec3]) {
        let (size, across) = (self.page_size, self.page_size.div_ceil(SQUARE));
        for (number, square) in self.squares.iter_mut().enumerate() {
            let [left, top] = [number % across, number / across].map(|at| at * SQUARE);
            let columns = left..(left + SQUARE).min(size);
            let rows = (top..(top + SQUARE).min(size))
                .map(|row| &page[row * size + columns.start..row * size + columns.end]);
            let hash = Some(hash(rows.clone()));
            if square.hash != hash {
                let brightest = rows.map(brightest).fold(0.0, f32::max);
                *square = Square { hash, brightest, is_new: true };
            }
        }
    }

    /// The brightest channel of the page.
    pub(crate) fn brightest(&self) -> f32 {
        self.squares.iter().map(|square| square.brightest).fold(0.0, f32::max)
    }

    /// Lets all squares be news.
    pub(crate) fn forget(&mut self) {
        self.squares.iter_mut().for_each(|square| square.is_new = true);
    }

    /// Column and row of the squares that are others than when this was asked last.
    pub(crate) fn take(&mut self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let across = self.page_size.div_ceil(SQUARE);
        let squares = self.squares.iter_mut().enumerate();
        squares.filter_map(move |(number, square)| {
            std::mem::take(&mut square.is_new).then_some([number % across, number / across])
        })
    }
}

/// A hash of lumels. Any other number makes another hash; others in many places do but for one case in
/// 2⁶⁴.
fn hash<'a>(rows: impl Iterator<Item = &'a [Vec3]>) -> u64 {
    let mut channels = [0u64; 3];
    for row in rows {
        for lumels in row.chunks(2) {
            let [one, other] = [lumels[0], *lumels.last().unwrap_or(&lumels[0])];
            for (k, hash) in channels.iter_mut().enumerate() {
                let word = u64::from(one[k].to_bits()) << 32 | u64::from(other[k].to_bits());
                *hash = (*hash ^ word).wrapping_mul(PRIME);
            }
        }
    }
    let join = |all: u64, channel: u64| (all.rotate_left(21) ^ channel).wrapping_mul(PRIME);
    channels.into_iter().fold(0, join)
}

/// The brightest channel of lumels; what is not finite does not count.
pub(crate) fn brightest(lumels: &[Vec3]) -> f32 {
    lumels.iter().map(|e| e.max_element()).filter(|e| e.is_finite()).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pages whose last squares are cut off, too.
    #[test]
    fn squares_that_change_are_found() {
        for size in [16u32, 33, 64] {
            let side = size as usize;
            let mut page: Vec<Vec3> =
                (0..side * side).map(|n| Vec3::new(n as f32, 1.0, 0.5)).collect();
            let mut news = PageNews::new(size);
            let mut look = |page: &[Vec3]| {
                news.look(page);
                (news.take().collect::<Vec<_>>(), news.brightest())
            };
            assert_eq!(look(&page).0.len(), side.div_ceil(SQUARE).pow(2), "all are news at first");
            assert!(look(&page).0.is_empty());
            for (at, channel) in [(0, 0), (side * side - 1, 2), (side * 7 + 13, 1)] {
                page[at][channel] += 1e4;
                let square = [at % side / SQUARE, at / side / SQUARE];
                assert_eq!(look(&page), (vec![square], page[at][channel]));
                page[at][channel] -= 1e4;
                look(&page);
            }
            page[0] = Vec3::NAN;
            assert_eq!(look(&page), (vec![[0, 0]], (side * side - 1) as f32));
        }
    }

    /// What is found is remembered until it is asked for.
    #[test]
    fn news_wait() {
        let mut news = PageNews::new(32);
        news.look(&vec![Vec3::ONE; 1024]);
        assert_eq!(news.take().count(), 4);
        news.look(&vec![Vec3::ZERO; 1024]);
        news.look(&vec![Vec3::ONE; 1024]);
        assert_eq!(news.take().count(), 4);
        assert_eq!(news.take().count(), 0);
    }
}
