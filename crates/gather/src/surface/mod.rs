//! What a ray has met: position, normals and material at a hit.

mod frames;
mod hit_point;
pub(crate) mod texture;
mod triangle;

use glam::Vec3;
use lumencast_scene::Material;

use crate::accel::Hit;
use crate::bsdf::Bsdf;

pub(crate) use frames::{Frames, gamma};
pub(crate) use hit_point::{Bump, HitPoint, interpolate, scaled_cross};
pub(crate) use triangle::{Spot, Triangle};

/// Which materials to believe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MaterialModel {
    /// The materials as glTF describes them.
    #[default]
    Full,
    /// Every surface an opaque two-sided Lambert one with its base colour, shaded by vertex normals
    /// without normal maps, emitting from its front only: for comparisons with other renderers.
    Lambert,
}

/// A point on a surface that a ray has met, looked at alone.
pub(crate) struct Point<'a> {
    pub(crate) place: HitPoint,
    pub(crate) spot: Spot<'a>,
    /// The vertex normal there, object space.
    vertex_normal: Vec3,
    frames: &'a Frames,
    /// Towards where the ray came from, unit.
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

    /// How it scatters, and the normal that it is shaded by, on the ray's side but not yet bent to face
    /// it; `None` where it scatters nothing.
    pub(crate) fn scattering(&self, model: MaterialModel) -> Option<(Bsdf, Vec3)> {
        let bsdf = self.spot.bsdf(self.place.is_front(), model)?;
        let bump = self.spot.bump(model);
        Some((bsdf, self.place.unbent_normal(self.frames, self.vertex_normal, &bump)))
    }

    /// The normal that it is shaded by, on the ray's side; `None` where it scatters nothing.
    pub(crate) fn shading_normal(&self, model: MaterialModel) -> Option<Vec3> {
        self.scattering(model).map(|(_, normal)| self.place.facing(normal, self.view))
    }
}
