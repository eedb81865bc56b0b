//! How long ago the light of lumels came.

use glam::UVec2;

use super::layout::Layout;
use crate::field_id::FieldId;

/// How long ago the light of a lightmap came, by squares of its pages.
#[derive(Clone, Debug, PartialEq)]
pub struct LumelAges {
    /// The lightmap's number within the scene.
    pub field: FieldId,
    /// Lumels along a side of a square, at least 1. Each page is cut into squares from its first lumel;
    /// the last ones end with the page.
    pub side: u32,
    /// Seconds, at least 0, page after page, row after row of squares; `None` where none has come yet.
    pub seconds: Vec<Option<f64>>,
}

impl LumelAges {
    /// Of a lightmap all of which came at once, so many seconds ago.
    pub fn even(field: FieldId, layout: &Layout, seconds: f64) -> Self {
        let seconds = vec![Some(seconds); layout.pages as usize];
        Self { field, side: layout.page_size.max(1), seconds }
    }

    /// Seconds since the light of a lumel of a page came; `None` where none has come, or there is no such
    /// page.
    pub fn at(&self, layout: &Layout, page: u32, lumel: UVec2) -> Option<f64> {
        let columns = layout.page_size.div_ceil(self.side) as usize;
        let square = (lumel / self.side).as_usizevec2();
        let number = (page as usize * columns + square.y) * columns + square.x;
        self.seconds.get(number).copied().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_lie_page_after_page_and_row_after_row() {
        let layout = Layout::new(10, 2, Vec::new());
        let seconds = (0..18).map(|number| (number != 17).then_some(f64::from(number))).collect();
        let ages = LumelAges { field: FieldId(0), side: 4, seconds };
        let at = |page, x, y| ages.at(&layout, page, UVec2::new(x, y));
        assert_eq!([at(0, 0, 0), at(0, 3, 3), at(0, 4, 3)], [Some(0.0), Some(0.0), Some(1.0)]);
        assert_eq!([at(0, 9, 3), at(0, 0, 4), at(0, 9, 9)], [Some(2.0), Some(3.0), Some(8.0)]);
        assert_eq!([at(1, 0, 0), at(1, 7, 9)], [Some(9.0), Some(16.0)]);
        assert_eq!([at(1, 9, 9), at(2, 0, 0)], [None, None], "no light, no page");
        let even = LumelAges::even(FieldId(0), &layout, 2.5);
        assert_eq!(
            [0, 1, 2].map(|page| even.at(&layout, page, UVec2::splat(9))),
            [Some(2.5), Some(2.5), None]
        );
    }
}
