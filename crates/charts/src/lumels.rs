//! Where the lumels of charts lie on the surface.

use glam::{UVec2, Vec3};
use lumencast_light::{Charts, Layout, Rectangle, Surface};

use crate::raster::shares;

/// A lumel that a chart covers a part of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lumel {
    /// Index into [`Charts::sizes`].
    pub rectangle: u32,
    /// Its place in the rectangle.
    pub at: UVec2,
    /// The primitive's triangle that it lies on.
    pub triangle: u32,
    /// Barycentric weights of its point: nearly its middle where a triangle holds that, or else the
    /// middle of the largest share that a triangle has of it.
    pub weights: Vec3,
    /// Its middle lies in the triangle.
    pub holds_middle: bool,
}

/// The lumels that charts cover, whole or in part, row by row.
pub fn lumels(charts: &Charts) -> Vec<Lumel> {
    let mut best = Best::new(&charts.sizes);
    for triangle in 0..charts.triangles.len() as u32 {
        let Some(corners) = charts.corners(triangle) else { continue };
        let rectangle = corners[0].rectangle;
        let size = charts.sizes[rectangle as usize];
        for share in shares(corners.map(|corner| corner.at), size) {
            let lumel = Lumel {
                rectangle,
                at: share.lumel,
                triangle,
                weights: share.weights,
                holds_middle: share.holds_middle,
            };
            best.offer(lumel, share.area);
        }
    }
    best.lumels()
}

/// The same of a surface on the pages of its layout, each with its index among the lumels of all pages
/// ([`Layout::index`]).
pub fn lumels_on_pages<'a>(
    layout: &'a Layout,
    surface: &'a Surface,
) -> impl Iterator<Item = (usize, Lumel)> + 'a {
    lumels(&surface.charts).into_iter().map(|lumel| {
        let Rectangle { page, corner } = surface.rectangles[lumel.rectangle as usize];
        (layout.index(page, corner + lumel.at), lumel)
    })
}

/// The best offer for each lumel.
struct Best {
    rectangles: Vec<Vec<Option<(Lumel, f32)>>>,
    widths: Vec<u32>,
}

impl Best {
    fn new(sizes: &[UVec2]) -> Self {
        let empty = |size: &UVec2| vec![None; size.element_product() as usize];
        Self {
            rectangles: sizes.iter().map(empty).collect(),
            widths: sizes.iter().map(|size| size.x).collect(),
        }
    }

    fn offer(&mut self, lumel: Lumel, area: f32) {
        let rectangle = lumel.rectangle as usize;
        let at = (lumel.at.y * self.widths[rectangle] + lumel.at.x) as usize;
        let place = &mut self.rectangles[rectangle][at];
        let rank = |lumel: &Lumel, area| (lumel.holds_middle, area);
        if place
            .as_ref()
            .is_none_or(|(held, held_area)| rank(held, *held_area) < rank(&lumel, area))
        {
            *place = Some((lumel, area));
        }
    }

    fn lumels(self) -> Vec<Lumel> {
        let all = self.rectangles.into_iter().flatten();
        all.flatten().map(|(lumel, _)| lumel).collect()
    }
}
