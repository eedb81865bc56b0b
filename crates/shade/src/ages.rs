//! How long ago the light of lumels came, as shaders read it: squares of one size on all pages.

use glam::UVec2;
use lumencast_light::LumelAges;

use crate::charted::{PlacedLayout, SurfaceLayouts};

/// What stands for the age of light that has not come.
const NONE: f32 = -1.0;

/// The ages of all pages: four bytes a square, which has tens of thousands of lumels where these are
/// those of a server.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AgeGrid {
    /// Lumels along a side of a square.
    pub(crate) side: u32,
    /// Squares along a side of the largest page.
    pub(crate) columns: u32,
    /// Layer after layer of the pages' texture, row after row of squares.
    pub(crate) seconds: Vec<f32>,
}

impl AgeGrid {
    /// Squares as large as can be that no square of `ages` cuts.
    pub(crate) fn new(ages: &[LumelAges], layouts: &SurfaceLayouts) -> Self {
        let all = layouts.all();
        let largest = all.iter().map(|placed| placed.layout.page_size).max().unwrap_or(0).max(1);
        let of = |placed: &PlacedLayout| ages.iter().find(|ages| ages.field == placed.field);
        let known = || all.iter().filter_map(|placed| Some((placed, of(placed)?)));
        let side = known().map(|(_, ages)| ages.side).fold(0, common_divisor);
        let side = if side == 0 { largest } else { side };
        let columns = largest.div_ceil(side);
        let on_layer = (columns as usize).pow(2);
        let layers = all.iter().map(|placed| placed.first_layers[1] + placed.layout.pages).max();
        let mut seconds = vec![NONE; layers.unwrap_or(0) as usize * on_layer];
        for (PlacedLayout { layout, first_layers, .. }, ages) in known() {
            for (page, layer) in (0..layout.pages).zip(first_layers[0] as usize..) {
                for (square, number) in seconds[layer * on_layer..][..on_layer].iter_mut().zip(0..)
                {
                    let lumel = side * UVec2::new(number % columns, number / columns);
                    if lumel.max_element() < layout.page_size {
                        *square = ages.at(layout, page, lumel).map_or(NONE, |age| age as f32);
                    }
                }
            }
        }
        Self { side, columns, seconds }
    }
}

/// The greatest common divisor, of which 0 takes none away.
fn common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use lumencast_light::{FieldId, Layout, Light, Lightmap};

    use super::*;

    fn lightmap(field: u32, page_size: u32, pages: u32) -> Lightmap {
        let layout = Arc::new(Layout::new(page_size, pages, Vec::new()));
        Lightmap::dark(FieldId(field), layout)
    }

    #[test]
    fn pages_of_several_lightmaps_share_one_grid() {
        let first = lightmap(1, 20, 1).with_slopes(true);
        let second = lightmap(2, 12, 2);
        let layouts = SurfaceLayouts::of(&Light::new([first.clone(), second]));
        let seconds = [Some(1.0), None, Some(3.0), Some(4.0)];
        let of_first = LumelAges { field: FieldId(1), side: 12, seconds: seconds.to_vec() };
        let of_second = LumelAges { field: FieldId(2), side: 8, seconds: vec![Some(7.0); 8] };
        let elsewhere = LumelAges::even(FieldId(5), &first.layout, 1.0);
        let grid = AgeGrid::new(&[elsewhere, of_second, of_first], &layouts);
        assert_eq!((grid.side, grid.columns, grid.seconds.len()), (4, 5, 4 * 25));
        let row = |layer: usize, row: usize| &grid.seconds[25 * layer + 5 * row..][..5];
        assert_eq!(row(0, 2), [1.0, 1.0, 1.0, NONE, NONE]);
        assert_eq!(row(0, 3), [3.0, 3.0, 3.0, 4.0, 4.0]);
        assert_eq!(row(1, 0), [NONE; 5], "slopes have no age of their own");
        assert_eq!(row(2, 2), [7.0, 7.0, 7.0, NONE, NONE]);
        assert_eq!((row(3, 0)[0], row(3, 3)), (7.0, &[NONE; 5][..]), "its pages are smaller");
    }

    #[test]
    fn unknown_ages_are_those_of_no_light() {
        let layouts = SurfaceLayouts::of(&Light::new([lightmap(1, 20, 3)]));
        let grid = AgeGrid::new(&[], &layouts);
        assert_eq!(grid, AgeGrid { side: 20, columns: 1, seconds: vec![NONE; 3] });
        let grid = AgeGrid::new(&[], &SurfaceLayouts::default());
        assert_eq!((grid.side, grid.seconds.len()), (1, 0));
    }
}
