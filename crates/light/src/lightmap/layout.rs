//! Where the surfaces of a scene lie on pages.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{UVec2, Vec2, Vec3};

use super::charts::Charts;

/// Which surface: one side of a primitive of an instance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SurfaceId {
    /// Number of the node that shows the mesh.
    pub node: u32,
    /// Which of the node's instances; 0 where it has no list of them.
    pub copy: u32,
    /// Index into the mesh's primitives.
    pub primitive: u32,
    /// The side on which triangles wind clockwise.
    pub back: bool,
}

/// A surface that has lumels.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Which it is.
    pub id: SurfaceId,
    /// How it is cut and laid out; shared by surfaces of one mesh that are equally large.
    pub charts: Arc<Charts>,
    /// Where each of the charts' rectangles lies.
    pub rectangles: Vec<Rectangle>,
}

/// A rectangle of a page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rectangle {
    /// Number of the page.
    pub page: u32,
    /// Its first lumel.
    pub corner: UVec2,
}

/// Where the surfaces of a scene lie on pages of lumels. No two rectangles overlap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// Lumels a side of every page.
    pub page_size: u32,
    /// Number of pages.
    pub pages: u32,
    /// In order of their numbers.
    surfaces: Vec<Surface>,
    /// How far surfaces have come that pass from probes to lumels, or back.
    shares: BTreeMap<SurfaceId, f32>,
}

impl Layout {
    /// A layout of surfaces, which may stand in any order.
    pub fn new(page_size: u32, pages: u32, mut surfaces: Vec<Surface>) -> Self {
        surfaces.sort_by_key(|surface| surface.id);
        Self { page_size, pages, surfaces, shares: BTreeMap::new() }
    }

    /// The same, some of whose surfaces have come so far from probes to lumels, 0 to 1.
    #[must_use]
    pub fn with_shares(self, shares: BTreeMap<SurfaceId, f32>) -> Self {
        Self { shares, ..self }
    }

    /// How far a surface has come from probes to lumels: a display's codes of its light have come as far.
    pub fn share(&self, id: SurfaceId) -> f32 {
        self.shares.get(&id).copied().unwrap_or(1.0)
    }

    /// The surfaces, in order of their numbers.
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// Number of lumels of all pages.
    pub fn lumel_count(&self) -> usize {
        self.pages as usize * (self.page_size as usize).pow(2)
    }

    /// Index of a lumel among those of all pages, page after page, row after row.
    pub fn index(&self, page: u32, lumel: UVec2) -> usize {
        let size = self.page_size as usize;
        (page as usize * size + lumel.y as usize) * size + lumel.x as usize
    }

    /// The four lumels that bilinear filtering reads at a point of a page, and their weights, together
    /// 1. Beyond the page's border the border counts.
    pub fn taps(&self, page: u32, at: Vec2) -> [(usize, f32); 4] {
        let most = Vec2::splat(self.page_size.saturating_sub(1) as f32);
        let at = (at - 0.5).clamp(Vec2::ZERO, most);
        let low = at.floor();
        let (share, high) = (at - low, (low + 1.0).min(most));
        let tap = |x: f32, y: f32, weight: f32| {
            (self.index(page, UVec2::new(x as u32, y as u32)), weight)
        };
        [
            tap(low.x, low.y, (1.0 - share.x) * (1.0 - share.y)),
            tap(high.x, low.y, share.x * (1.0 - share.y)),
            tap(low.x, high.y, (1.0 - share.x) * share.y),
            tap(high.x, high.y, share.x * share.y),
        ]
    }

    /// A surface, where it has lumels.
    pub fn surface(&self, id: SurfaceId) -> Option<&Surface> {
        let at = self.surfaces.binary_search_by_key(&id, |surface| surface.id).ok()?;
        Some(&self.surfaces[at])
    }
}

impl Surface {
    /// Whether all of it lies on the first so many pages.
    pub fn is_on_first(&self, pages: u32) -> bool {
        self.rectangles.iter().all(|rectangle| rectangle.page < pages)
    }

    /// Where a point of a triangle lies: the page, and lumels from its corner; nothing where it has no
    /// lumels. `weights` are barycentric.
    pub fn at(&self, triangle: u32, weights: Vec3) -> Option<(u32, Vec2)> {
        let (rectangle, at) = self.charts.at(triangle, weights)?;
        let Rectangle { page, corner } = self.rectangles[rectangle as usize];
        Some((page, corner.as_vec2() + at))
    }
}
