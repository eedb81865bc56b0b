//! Blocks of a page, which are solved together.

use glam::UVec2;

/// Lumels a side of a block.
pub(crate) const BLOCK: u32 = 64;

/// A square of lumels that are solved together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Block {
    pub(crate) page: u32,
    row: u32,
    column: u32,
}

impl Block {
    /// The block of a lumel.
    pub(crate) fn of(lumel: u32, page_size: u32) -> Self {
        let (page, at) = on_page(lumel, page_size);
        Self { page, row: at.y / BLOCK, column: at.x / BLOCK }
    }

    /// Those about it on its page.
    pub(crate) fn beside(&self, page_size: u32) -> impl Iterator<Item = Self> {
        let Self { page, row, column } = *self;
        let blocks = page_size.div_ceil(BLOCK);
        let near = move |at: u32| at.saturating_sub(1)..(at + 2).min(blocks);
        let all = near(row).flat_map(move |row| near(column).map(move |column| (row, column)));
        all.filter(move |at| *at != (row, column)).map(move |(row, column)| Self {
            page,
            row,
            column,
        })
    }

    /// Its number among those of all pages.
    pub(crate) fn number(&self, page_size: u32) -> usize {
        let across = page_size.div_ceil(BLOCK);
        ((self.page * across + self.row) * across + self.column) as usize
    }

    /// Its first lumel.
    pub(crate) fn corner(&self) -> UVec2 {
        BLOCK * UVec2::new(self.column, self.row)
    }
}

/// The page of a lumel, and its place there.
pub(crate) fn on_page(lumel: u32, page_size: u32) -> (u32, UVec2) {
    let (page, at) = (lumel / (page_size * page_size), lumel % (page_size * page_size));
    (page, UVec2::new(at % page_size, at / page_size))
}
