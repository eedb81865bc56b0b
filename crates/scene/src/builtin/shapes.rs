//! Shapes for built-in scenes.

use std::f32::consts::TAU;

use glam::{Affine3A, Vec3};

/// A triangle mesh with normals; triangles are counter-clockwise as seen from the front.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shape {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// A grid of `columns` × `rows` quadrilaterals over a surface, parametrised by (s, t) in [0,
    /// 1]². Its front is in the direction of the derivative along s crossed with the one along t.
    /// Normals are those of the surface, by finite differences.
    pub(crate) fn surface(columns: u32, rows: u32, at: impl Fn(f32, f32) -> Vec3) -> Self {
        let mut shape = Self::default();
        const STEP: f32 = 1e-3;
        for row in 0..=rows {
            for column in 0..=columns {
                let (s, t) = (column as f32 / columns as f32, row as f32 / rows as f32);
                let along_s = at(s + STEP, t) - at(s - STEP, t);
                let along_t = at(s, t + STEP) - at(s, t - STEP);
                shape.positions.push(at(s, t));
                shape.normals.push(along_s.cross(along_t).normalize_or(Vec3::Y));
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = row * (columns + 1) + column;
                let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
                shape.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        shape.without_degenerate()
    }

    /// A rectangle from a corner along two edges, in `n` × `n` cells; its front is in the direction
    /// along × up.
    pub(crate) fn rectangle(corner: Vec3, along: Vec3, up: Vec3, n: u32) -> Self {
        Self::surface(n, n, |s, t| corner + s * along + t * up)
    }

    /// A box between two corners, each face in `n` × `n` cells, with the front outside.
    pub(crate) fn cuboid(min: Vec3, max: Vec3, n: u32) -> Self {
        let size = max - min;
        let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
        Self::joined([
            Self::rectangle(min + z, x, y, n),
            Self::rectangle(max - y - z, -x, y, n),
            Self::rectangle(min + x + z, -z, y, n),
            Self::rectangle(min, z, y, n),
            Self::rectangle(min + y + z, x, -z, n),
            Self::rectangle(min, x, z, n),
        ])
    }

    /// A sphere about the origin.
    pub(crate) fn sphere(radius: f32, around: u32, rings: u32) -> Self {
        let point = |s: f32, t: f32| {
            let (polar, azimuth) = (TAU / 2.0 * (1.0 - t), -TAU * s);
            let (sin, cos) = polar.sin_cos();
            radius * Vec3::new(sin * azimuth.cos(), cos, sin * azimuth.sin())
        };
        let mut sphere = Self::surface(around, rings, point);
        for (normal, position) in sphere.normals.iter_mut().zip(&sphere.positions) {
            *normal = position.normalize_or(Vec3::Y);
        }
        sphere
    }

    /// A solid of revolution about +Y. `profile` gives radius and height from bottom to top.
    pub(crate) fn lathe(around: u32, rings: u32, profile: impl Fn(f32) -> (f32, f32)) -> Self {
        Self::surface(around, rings, |s, t| {
            let (radius, height) = profile(t.clamp(0.0, 1.0));
            let azimuth = -TAU * s;
            Vec3::new(radius * azimuth.cos(), height, radius * azimuth.sin())
        })
    }

    /// A closed tube along a closed curve of s in [0, 1].
    pub(crate) fn tube(
        along: u32,
        around: u32,
        curve: impl Fn(f32) -> Vec3,
        radius: impl Fn(f32, f32) -> f32,
    ) -> Self {
        Self::surface(along, around, |s, t| {
            const STEP: f32 = 1e-3;
            let forward = (curve(s + STEP) - curve(s - STEP)).normalize_or(Vec3::Z);
            let side = forward.cross(Vec3::Y).normalize_or(Vec3::X);
            let up = side.cross(forward);
            let (sin, cos) = (TAU * t).sin_cos();
            curve(s) + radius(s, t) * (cos * side + sin * up)
        })
    }

    pub(crate) fn joined(shapes: impl IntoIterator<Item = Self>) -> Self {
        let mut joined = Self::default();
        for shape in shapes {
            let first = joined.positions.len() as u32;
            joined.positions.extend(shape.positions);
            joined.normals.extend(shape.normals);
            joined.triangles.extend(shape.triangles.iter().map(|t| t.map(|i| first + i)));
        }
        joined
    }

    /// The transformed shape; the transform may turn and scale but not mirror.
    pub(crate) fn placed(mut self, world_from_shape: Affine3A) -> Self {
        let normal_matrix = world_from_shape.matrix3.inverse().transpose();
        self.positions.iter_mut().for_each(|p| *p = world_from_shape.transform_point3(*p));
        self.normals.iter_mut().for_each(|n| *n = (normal_matrix * *n).normalize_or(Vec3::Y));
        self
    }

    fn without_degenerate(mut self) -> Self {
        let p = &self.positions;
        self.triangles.retain(|t| {
            let [a, b, c] = t.map(|i| p[i as usize]);
            (b - a).cross(c - a).length() > 1e-12
        });
        self
    }
}
