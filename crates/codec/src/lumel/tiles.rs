//! How the pages of a lightmap are cut into tiles.

use std::ops::Range;

use glam::UVec2;

/// A part of a page, the unit of tracks: the regions of a lightmap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Its number within the field.
    pub id: u32,
    /// Number of its page.
    pub page: u32,
    /// Its first lumel.
    pub min: UVec2,
    /// Lumels along x and y.
    pub size: UVec2,
}

impl Tile {
    /// Number of its lumels.
    pub fn lumel_count(self) -> usize {
        self.size.as_usizevec2().element_product()
    }

    /// Indices of its lumels within all pages, row after row.
    pub fn rows(self, page_size: u32) -> impl Iterator<Item = Range<usize>> + Clone {
        let (side, min, size) =
            (page_size as usize, self.min.as_usizevec2(), self.size.as_usizevec2());
        let first = (self.page as usize * side + min.y) * side + min.x;
        (0..size.y).map(move |y| first + y * side..first + y * side + size.x)
    }
}

/// Cuts pages into tiles of at most `side`² lumels, page after page, row after row.
pub(crate) fn tiles(page_size: u32, side: u32, pages: u32) -> impl Iterator<Item = Tile> {
    let count = pages * per_side(page_size, side).pow(2);
    (0..count).filter_map(move |id| tile(page_size, side, pages, id))
}

/// Tiles along a side of a page.
pub(crate) fn per_side(page_size: u32, side: u32) -> u32 {
    page_size.div_ceil(side)
}

/// The tile of a number.
pub(crate) fn tile(page_size: u32, side: u32, pages: u32, id: u32) -> Option<Tile> {
    let per_side = per_side(page_size, side);
    let page = id.checked_div(per_side.pow(2)).filter(|page| *page < pages)?;
    let min = side * UVec2::new(id % per_side, id / per_side % per_side);
    let size = (UVec2::splat(page_size) - min).min(UVec2::splat(side));
    Some(Tile { id, page, min, size })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_lumel_once() {
        let cases = [
            (1, 256, 1, 1),
            (256, 256, 2, 2),
            (300, 256, 3, 12),
            (1024, 256, 1, 16),
            (300, 300, 3, 3),
        ];
        for (page_size, side, pages, count) in cases {
            let mut seen = vec![0; pages as usize * (page_size as usize).pow(2)];
            let tiles: Vec<Tile> = tiles(page_size, side, pages).collect();
            assert_eq!(tiles.len(), count);
            for (number, cut) in (0..).zip(&tiles) {
                assert_eq!((cut.id, tile(page_size, side, pages, number)), (number, Some(*cut)));
                assert_eq!(cut.rows(page_size).flatten().count(), cut.lumel_count());
                cut.rows(page_size).flatten().for_each(|lumel| seen[lumel] += 1);
            }
            assert!(seen.iter().all(|times| *times == 1));
            assert_eq!(tile(page_size, side, pages, count as u32), None);
        }
        let last = tiles(300, 256, 2).last();
        let (min, size) = (UVec2::splat(256), UVec2::splat(44));
        assert_eq!(last, Some(Tile { id: 7, page: 1, min, size }));
    }
}
