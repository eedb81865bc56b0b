//! What arrives at lumels.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::layout::Layout;
use super::slope::tilted;
use crate::field_id::FieldId;
use crate::place::OnTriangle;

/// What is told of lumels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Told {
    /// [`Lightmap::irradiance`].
    #[default]
    Irradiance,
    /// [`Lightmap::slopes`].
    Slopes,
}

/// Irradiance on the surfaces of a scene, lumel by lumel.
#[derive(Clone, Debug, PartialEq)]
pub struct Lightmap {
    /// Its number within the scene.
    pub id: FieldId,
    /// Where surfaces lie on its pages.
    pub layout: Arc<Layout>,
    /// Lux; in the order of [`Layout::index`].
    pub irradiance: Vec<Vec3>,
    /// How irradiance depends on the normal of shading ([`tilted`]), in the same order; nothing where it
    /// is told on the surface's own normal alone.
    pub slopes: Option<Vec<Vec3>>,
}

impl Lightmap {
    /// Pages without light.
    pub fn dark(id: FieldId, layout: Arc<Layout>) -> Self {
        let irradiance = vec![Vec3::ZERO; layout.lumel_count()];
        Self { id, layout, irradiance, slopes: None }
    }

    /// The same with slopes of 0, or without any.
    #[must_use]
    pub fn with_slopes(self, directional: bool) -> Self {
        let slopes = directional.then(|| vec![Vec3::ZERO; self.irradiance.len()]);
        Self { slopes, ..self }
    }

    /// What is told of lumels, to be told anew. Slopes are 0 where there were none.
    pub fn told_mut(&mut self, told: Told) -> &mut [Vec3] {
        match told {
            Told::Irradiance => &mut self.irradiance,
            Told::Slopes => {
                let count = self.irradiance.len();
                self.slopes.get_or_insert_with(|| vec![Vec3::ZERO; count])
            }
        }
    }

    /// Irradiance at a point of the scene, lux, filtered bilinearly; nothing where it has no lumels.
    pub fn irradiance_at(&self, point: &OnTriangle) -> Option<Vec3> {
        let surface = self.layout.surface(point.surface)?;
        let (page, at) = surface.at(point.triangle, point.weights)?;
        Some(self.read(page, at))
    }

    /// The same on a unit normal of shading, where the surface's own unit normal is another: world, on
    /// the side that is asked for.
    pub fn irradiance_on(&self, point: &OnTriangle, normal: Vec3, shading: Vec3) -> Option<Vec3> {
        let surface = self.layout.surface(point.surface)?;
        let (page, at) = surface.at(point.triangle, point.weights)?;
        let slope =
            self.slopes.as_ref().map_or(Vec3::ZERO, |slopes| self.read_of(slopes, page, at));
        Some(tilted(slope, normal, shading) * self.read(page, at))
    }

    /// Irradiance at a point of a page, lux: lumels from the page's corner, filtered bilinearly.
    pub fn read(&self, page: u32, at: Vec2) -> Vec3 {
        self.read_of(&self.irradiance, page, at)
    }

    fn read_of(&self, lumels: &[Vec3], page: u32, at: Vec2) -> Vec3 {
        let taps = self.layout.taps(page, at);
        taps.into_iter().map(|(lumel, weight)| weight * lumels[lumel]).sum()
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;
    use crate::lightmap::{ChartVertex, Charts, Rectangle, Surface, SurfaceId};

    /// Two triangles of a square of 4 × 4 lumels, at (8, 4) of the second page.
    fn lightmap() -> Lightmap {
        let at = |x: f32, y: f32, source| ChartVertex { source, rectangle: 0, at: Vec2::new(x, y) };
        let charts = Charts {
            sizes: vec![UVec2::splat(8)],
            vertices: vec![at(2.5, 2.5, 0), at(6.5, 2.5, 1), at(6.5, 6.5, 2), at(2.5, 6.5, 3)],
            triangles: vec![[0, 1, 2], [0, 2, 3], Charts::NOWHERE],
        };
        let rectangles = vec![Rectangle { page: 1, corner: UVec2::new(8, 4) }];
        let id = SurfaceId { node: 3, primitive: 1, ..SurfaceId::default() };
        let surface = Surface { id, charts: Arc::new(charts), rectangles };
        let mut lightmap = Lightmap::dark(FieldId(7), Arc::new(Layout::new(16, 2, vec![surface])));
        // What is linear over the pages comes out exactly.
        for y in 0..16 {
            for x in 0..16 {
                let index = lightmap.layout.index(1, UVec2::new(x, y));
                lightmap.irradiance[index] = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 1.0);
            }
        }
        lightmap
    }

    #[test]
    fn points_are_read_where_their_charts_lie() {
        let lightmap = lightmap();
        let surface = SurfaceId { node: 3, primitive: 1, ..SurfaceId::default() };
        let read =
            |triangle, weights| lightmap.irradiance_at(&OnTriangle { surface, triangle, weights });
        let close = |got: Option<Vec3>, want: Vec3| got.unwrap().abs_diff_eq(want, 1e-5);
        assert!(close(read(0, Vec3::X), Vec3::new(10.5, 6.5, 1.0)));
        assert!(close(read(0, Vec3::splat(1.0 / 3.0)), Vec3::new(13.166_667, 7.833_333, 1.0)));
        assert!(close(read(1, Vec3::new(0.5, 0.25, 0.25)), Vec3::new(11.5, 8.5, 1.0)));
        assert_eq!(read(2, Vec3::X), None, "a triangle without area");
        assert_eq!(read(9, Vec3::X), None, "no such triangle");
        let back = SurfaceId { back: true, ..surface };
        let point = OnTriangle { surface: back, triangle: 0, weights: Vec3::X };
        assert_eq!(lightmap.irradiance_at(&point), None, "no such surface");
    }

    /// Light from above +X, on a surface that faces +Y.
    #[test]
    fn slopes_turn_light_with_the_normal() {
        let flat = lightmap();
        let surface = SurfaceId { node: 3, primitive: 1, ..SurfaceId::default() };
        let point = OnTriangle { surface, triangle: 0, weights: Vec3::X };
        let tilts = [0.5, 0.0, -0.5].map(|x: f32| Vec3::new(x, 1.0, 0.0).normalize());
        let read = |lightmap: &Lightmap| {
            tilts.map(|shading| lightmap.irradiance_on(&point, Vec3::Y, shading).unwrap().x)
        };
        let own = flat.irradiance_at(&point).unwrap().x;
        assert_eq!(read(&flat), [own; 3], "without slopes all normals see the same");
        let mut tilted = flat.with_slopes(true);
        assert_eq!(read(&tilted), [own; 3]);
        tilted.slopes.as_mut().unwrap().fill(Vec3::new(1.0, 1.0, 0.0));
        let right = tilts.map(|shading| own * (shading.x + shading.y));
        read(&tilted).iter().zip(right).for_each(|(a, b)| assert!((a - b).abs() < 1e-4, "{a} {b}"));
        let nowhere = OnTriangle { triangle: 2, ..point };
        assert_eq!(tilted.irradiance_on(&nowhere, Vec3::Y, Vec3::Y), None);
    }

    #[test]
    fn beyond_the_border_the_border_counts() {
        let lightmap = lightmap();
        assert_eq!(lightmap.read(1, Vec2::new(-5.0, 3.5)), lightmap.read(1, Vec2::new(0.5, 3.5)));
        assert_eq!(lightmap.read(1, Vec2::splat(99.0)), lightmap.read(1, Vec2::splat(15.5)));
        for at in [Vec2::ZERO, Vec2::splat(3.7), Vec2::new(15.9, 0.2)] {
            let sum: f32 = lightmap.layout.taps(0, at).iter().map(|(_, weight)| weight).sum();
            assert!((sum - 1.0).abs() < 1e-6);
        }
    }
}
