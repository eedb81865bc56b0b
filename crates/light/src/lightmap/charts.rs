//! A surface cut into charts and laid out flat.

use glam::{UVec2, Vec2, Vec3};

/// How the surface of a primitive is cut into charts, and where they lie on rectangles of lumels.
///
/// The charts of a primitive share one rectangle, or several where it is too large for a page. Each
/// triangle lies in one chart, and no two charts overlap. Costs, in memory: 16 bytes a vertex, 12 a
/// triangle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Charts {
    /// Size of each rectangle, lumels.
    pub sizes: Vec<UVec2>,
    /// Vertices; where charts part, a vertex of the file has several.
    pub vertices: Vec<ChartVertex>,
    /// As many triangles as the file's primitive has, in its order; [`Charts::NOWHERE`] for those that
    /// have no lumels.
    pub triangles: Vec<[u32; 3]>,
}

/// A vertex of a chart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChartVertex {
    /// The vertex, as the file numbers those of the primitive.
    pub source: u32,
    /// Index into [`Charts::sizes`].
    pub rectangle: u32,
    /// Lumels from the rectangle's corner; the middle of its first lumel is at ½, ½.
    pub at: Vec2,
}

impl Charts {
    /// What a triangle without lumels has.
    pub const NOWHERE: [u32; 3] = [u32::MAX; 3];

    /// The corners of a triangle; nothing where it has no lumels.
    pub fn corners(&self, triangle: u32) -> Option<[ChartVertex; 3]> {
        let triangle = *self.triangles.get(triangle as usize)?;
        (triangle != Self::NOWHERE).then(|| triangle.map(|vertex| self.vertices[vertex as usize]))
    }

    /// Where a point of a triangle lies: the rectangle, and lumels from its corner. `weights` are
    /// barycentric.
    pub fn at(&self, triangle: u32, weights: Vec3) -> Option<(u32, Vec2)> {
        let [a, b, c] = self.corners(triangle)?;
        Some((a.rectangle, weights.x * a.at + weights.y * b.at + weights.z * c.at))
    }
}
