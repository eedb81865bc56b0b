//! Position, normals and material at a ray's hit.

mod frames;
mod hit_point;
mod shading;
pub(crate) mod texture;
mod triangle;

use glam::Vec3;
use lumencast_scene::Material;

use crate::accel::Hit;
use crate::bsdf::Bsdf;

pub(crate) use frames::{Frames, gamma};
pub(crate) use hit_point::{Bump, HitPoint, interpolate, scaled_cross};
pub use shading::shading_normal;
pub(crate) use triangle::{Spot, Triangle};

/// The material model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MaterialModel {
    /// Materials as glTF describes them.
    #[default]
    Full,
    /// Every surface is opaque, two-sided and Lambert with its base colour. It is shaded by vertex
    /// normals without normal maps and emits from its front only. For comparisons with other
    /// renderers.
    Lambert,
}

/// A point on a surface that a ray has met.
pub(crate) struct Point<'a> {
    pub(crate) place: HitPoint,
    pub(crate) spot: Spot<'a>,
    /// The vertex normal there, object space.
    vertex_normal: Vec3,
    frames: &'a Frames,
    /// Unit direction towards the ray's origin.
    view: Vec3,
}

impl<'a> Point<'a> {
    /// The point of a hit; `direction` is the unit direction of the ray. `None` for triangles so
    /// thin that they have no normal.
    pub(crate) fn new(
        hit: &Hit,
        triangle: Triangle<'a>,
        frames: &'a Frames,
        material: &'a Material,
        direction: Vec3,
    ) -> Option<Self> {
        let weights = hit.weights();
        let place = HitPoint::new(frames, triangle.positions(), weights, direction);
        let vertex_normal = interpolate(triangle.normals(), weights);
        let spot = triangle.at(material, weights);
        let point = Self { place, spot, vertex_normal, frames, view: -direction };
        (place.normal != Vec3::ZERO).then_some(point)
    }

    /// Emitted radiance towards the ray, cd/m².
    pub(crate) fn emission(&self, model: MaterialModel) -> Vec3 {
        self.spot.emission_seen(self.place.is_front(), model)
    }

    /// The BSDF, and the shading normal on the ray's side, not yet bent to face the ray. `None`
    /// where the surface scatters nothing.
    pub(crate) fn scattering(&self, model: MaterialModel) -> Option<(Bsdf, Vec3)> {
        let bsdf = self.spot.bsdf(self.place.is_front(), model)?;
        let bump = self.spot.bump(model);
        Some((bsdf, self.place.unbent_normal(self.frames, self.vertex_normal, &bump)))
    }

    /// The shading normal, bent to face the ray; `None` where the surface scatters nothing.
    pub(crate) fn shading_normal(&self, model: MaterialModel) -> Option<Vec3> {
        self.scattering(model).map(|(_, normal)| self.place.facing(normal, self.view))
    }
}
