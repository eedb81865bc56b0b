//! How the pages of a lightmap are cut into tiles.

use std::ops::Range;

use glam::UVec2;
use lumencast_light::{Lightmap, Told};

use super::tile_light::TileLight;

/// A part of a page, the unit of tracks: the regions of a lightmap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Its number within the field.
    pub id: u32,
    /// What it holds.
    pub told: Told,
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

    /// Puts what was decoded of the tile to where it belongs.
    pub fn put(self, light: TileLight, lightmap: &mut Lightmap) {
        let rows = self.rows(lightmap.layout.page_size);
        let (told, shown) = (light.told(self.told), lightmap.told_mut(self.told));
        for (row, values) in rows.zip(told.chunks(self.size.x as usize)) {
            shown[row].copy_from_slice(values);
        }
    }
}

/// How pages are cut into tiles, page after page, row after row: those of slopes after those of
/// irradiance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    pub(crate) page_size: u32,
    pub(crate) pages: u32,
    /// Whether there are slopes.
    pub(crate) slopes: bool,
    /// Lumels of a tile along a side, at most.
    pub(crate) side: u32,
}

impl Cut {
    /// Pages of irradiance, and of slopes.
    fn pictures(self) -> u32 {
        if self.slopes { 2 * self.pages } else { self.pages }
    }

    /// Tiles along a side of a page.
    fn per_side(self) -> u32 {
        self.page_size.div_ceil(self.side)
    }

    /// Number of all tiles.
    pub(crate) fn count(self) -> usize {
        self.pictures() as usize * (self.per_side() as usize).pow(2)
    }

    /// The tiles, in order of their numbers.
    pub(crate) fn tiles(self) -> impl Iterator<Item = Tile> {
        (0..self.count() as u32).filter_map(move |id| self.tile(id))
    }

    /// The tile of a number.
    pub(crate) fn tile(self, id: u32) -> Option<Tile> {
        let (per_side, pages) = (self.per_side(), self.pages);
        let picture = id.checked_div(per_side.pow(2)).filter(|page| *page < self.pictures())?;
        let told = if picture < pages { Told::Irradiance } else { Told::Slopes };
        let min = self.side * UVec2::new(id % per_side, id / per_side % per_side);
        let size = (UVec2::splat(self.page_size) - min).min(UVec2::splat(self.side));
        Some(Tile { id, told, page: picture % pages, min, size })
    }
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
            for (slopes, all) in [(false, count), (true, 2 * count)] {
                let cut = Cut { page_size, side, pages, slopes };
                let lumels = pages as usize * (page_size as usize).pow(2);
                let mut seen = [vec![0; lumels], vec![0; lumels]];
                let tiles: Vec<Tile> = cut.tiles().collect();
                assert_eq!((tiles.len(), cut.count()), (all, all));
                for (number, tile) in (0..).zip(&tiles) {
                    assert_eq!((tile.id, cut.tile(number)), (number, Some(*tile)));
                    assert_eq!(tile.rows(page_size).flatten().count(), tile.lumel_count());
                    let seen = &mut seen[usize::from(tile.told == Told::Slopes)];
                    tile.rows(page_size).flatten().for_each(|lumel| seen[lumel] += 1);
                }
                assert!(seen[0].iter().all(|times| *times == 1));
                assert!(seen[1].iter().all(|times| *times == u32::from(slopes)));
                assert_eq!(cut.tile(all as u32), None);
            }
        }
        let cut = Cut { page_size: 300, side: 256, pages: 2, slopes: true };
        let (min, size) = (UVec2::splat(256), UVec2::splat(44));
        let last = |id, told| Some(Tile { id, told, page: 1, min, size });
        assert_eq!(cut.tile(7), last(7, Told::Irradiance));
        assert_eq!(cut.tiles().last(), last(15, Told::Slopes));
    }
}
