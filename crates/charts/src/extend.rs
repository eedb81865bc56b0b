//! Room on the pages of a layout for surfaces that come later.

use std::sync::Arc;

use glam::UVec2;
use lumencast_light::{Charts, Layout, Rectangle, Surface, SurfaceId};

use crate::error::ChartError;
use crate::layout::{ALIGNMENT, LaidOut, PAGE, Room, charts};
use crate::sheet::Sheet;

/// Lumels of all pages, at most.
const MOST_LUMELS: usize = 8 << 20;

/// A layout that has more surfaces than before.
#[derive(Clone, Debug, PartialEq)]
pub struct Extended {
    /// Where surfaces lie; those of before lie where they lay.
    pub laid_out: LaidOut,
    /// Those for which there is no room.
    pub left_out: Vec<SurfaceId>,
}

/// Lays out more sheets beside the surfaces that `keeps` names, at the same density, on further pages
/// where there is no room on those that there are. Those with a chart that would be larger than a page of
/// [`PAGE`]² have larger lumels. The place of surfaces that are not kept is free.
///
/// # Errors
/// Whatever the unwrapper finds wrong.
pub fn extended(
    before: &LaidOut,
    keeps: impl Fn(SurfaceId) -> bool,
    sheets: &[Sheet],
) -> Result<Extended, ChartError> {
    let Layout { page_size, pages, .. } = before.layout;
    let kept = before.layout.surfaces().iter().filter(|surface| keeps(surface.id));
    let mut surfaces: Vec<Surface> = kept.cloned().collect();
    let mut taken: Vec<Taken> = (0..pages).map(|_| Taken::new(page_size)).collect();
    for surface in &surfaces {
        for (rectangle, size) in surface.rectangles.iter().zip(&surface.charts.sizes) {
            taken[rectangle.page as usize].take(rectangle.corner, *size);
        }
    }
    let most = (MOST_LUMELS / (page_size as usize).pow(2).max(1)).max(pages as usize);
    let room = Room { size: page_size, pages: most as u32, shrinks: page_size == PAGE };
    let usual = 1.0 / f64::from(before.texel);
    let mut larger = before.larger.clone();
    larger.retain(|id, _| keeps(*id));
    let mut left_out = Vec::new();
    for sheet in sheets {
        let density = room.density_of(sheet, usual);
        let charts = match charts(sheet, density as f32, page_size) {
            Ok(charts) => Arc::new(charts),
            Err(ChartError::NoRoom) => {
                left_out.push(sheet.id);
                continue;
            }
            Err(error) => return Err(error),
        };
        let as_it_was = taken.clone();
        match rectangles(&charts, &mut taken, page_size, most) {
            Some(rectangles) => {
                surfaces.push(Surface { id: sheet.id, charts, rectangles });
                if density < usual {
                    larger.insert(sheet.id, (1.0 / density) as f32);
                }
            }
            None => {
                taken = as_it_was;
                left_out.push(sheet.id);
            }
        }
    }
    let layout = Layout::new(page_size, taken.len() as u32, surfaces);
    let LaidOut { texel, coarser, .. } = *before;
    Ok(Extended { laid_out: LaidOut { layout, texel, larger, coarser }, left_out })
}

/// A place for each rectangle of charts; nothing where the pages, `most` of them, have no room.
fn rectangles(
    charts: &Charts,
    taken: &mut Vec<Taken>,
    page_size: u32,
    most: usize,
) -> Option<Vec<Rectangle>> {
    let place = |size: &UVec2| {
        let mut found = taken.iter().zip(0..).find_map(|(page, n)| Some((n, page.free(*size)?)));
        if found.is_none() && taken.len() < most {
            taken.push(Taken::new(page_size));
            let page = taken.len() - 1;
            found = taken[page].free(*size).map(|corner| (page as u32, corner));
        }
        let (page, corner) = found?;
        taken[page as usize].take(corner, *size);
        Some(Rectangle { page, corner })
    };
    charts.sizes.iter().map(place).collect()
}

/// Which squares of a page are taken.
#[derive(Clone, Debug)]
struct Taken {
    side: u32,
    squares: Vec<bool>,
}

impl Taken {
    fn new(page_size: u32) -> Self {
        let side = page_size / ALIGNMENT as u32;
        Self { side, squares: vec![false; (side * side) as usize] }
    }

    fn take(&mut self, corner: UVec2, size: UVec2) {
        let (low, high) = (corner / ALIGNMENT as u32, squares(corner + size));
        for y in low.y..high.y.min(self.side) {
            for x in low.x..high.x.min(self.side) {
                self.squares[(y * self.side + x) as usize] = true;
            }
        }
    }

    /// The first corner, row by row, from which on a rectangle is free.
    fn free(&self, size: UVec2) -> Option<UVec2> {
        let size = squares(size);
        if size.max_element() > self.side {
            return None;
        }
        for y in 0..=self.side - size.y {
            let mut x = 0;
            while x + size.x <= self.side {
                match self.last_taken(UVec2::new(x, y), size) {
                    None => return Some(UVec2::new(x, y) * ALIGNMENT as u32),
                    Some(column) => x = column + 1,
                }
            }
        }
        None
    }

    /// The last column of a rectangle in which a square is taken.
    fn last_taken(&self, corner: UVec2, size: UVec2) -> Option<u32> {
        (corner.x..corner.x + size.x).rev().find(|x| {
            (corner.y..corner.y + size.y).any(|y| self.squares[(y * self.side + x) as usize])
        })
    }
}

/// So many squares hold so many lumels.
fn squares(lumels: UVec2) -> UVec2 {
    let side = ALIGNMENT as u32;
    UVec2::new(lumels.x.div_ceil(side), lumels.y.div_ceil(side))
}
