//! Where light is asked for.

use glam::Vec3;

use crate::lightmap::SurfaceId;

/// A place that light is asked for at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// World, metres.
    pub position: Vec3,
    /// World normal of the surface, on the side that is asked for; zero in free space.
    pub normal: Vec3,
    /// Which point of the scene it is, where that is known: fields on surfaces are read by it.
    pub on: Option<OnTriangle>,
}

/// A point of a triangle of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnTriangle {
    /// The surface that it is a part of, on the side that is asked for.
    pub surface: SurfaceId,
    /// Index into the primitive's triangles.
    pub triangle: u32,
    /// Barycentric weights of its vertices; together 1.
    pub weights: Vec3,
}

impl Place {
    /// In free space.
    pub fn in_space(position: Vec3) -> Self {
        Self { position, ..Self::default() }
    }

    /// On a surface of which nothing else is known.
    pub fn on_surface(position: Vec3, normal: Vec3) -> Self {
        Self { position, normal, on: None }
    }
}
