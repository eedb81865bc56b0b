//! The vertices of paths, where light is scattered.

use glam::{Mat3, Vec3};

use super::columns::{Columns, GROUP};
use crate::bsdf::{Bsdf, Chosen, Scatter, frame};
use crate::numbers::numbers;
use crate::sampling::Draw;
use crate::surface::{HitPoint, MaterialModel, Point};

/// A point where a path's light is scattered.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    pub(super) place: HitPoint,
    /// Unit direction towards the path's previous vertex.
    pub(super) view: Vec3,
    /// Unit shading normal, on the side of `view`.
    pub(super) normal: Vec3,
    pub(super) bsdf: Bsdf,
}

/// A point that scatters light, whatever the direction it is seen from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatterer {
    pub(super) place: HitPoint,
    /// Unit shading normal, before it is bent to face anything.
    unbent: Vec3,
    bsdf: Bsdf,
}

impl Scatterer {
    /// The scatterer at a point; `None` where the surface scatters nothing.
    pub(super) fn at(point: &Point<'_>, model: MaterialModel) -> Option<Self> {
        let (bsdf, unbent) = point.scattering(model)?;
        Some(Self { place: point.place, unbent, bsdf })
    }

    /// The vertex as seen from the unit direction `view`, which must be on the side of its place.
    #[inline(always)]
    pub(super) fn seen_from(&self, view: Vec3) -> Vertex {
        let Self { place, unbent, bsdf } = *self;
        Vertex { place, view, normal: place.facing(unbent, view), bsdf }
    }
}

/// The next ray of a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scattered {
    pub(super) origin: Vec3,
    /// Unit.
    pub(super) direction: Vec3,
    /// Factor of the light that arrives along the ray.
    pub(super) weight: Vec3,
    /// Density per steradian of the choice; 0 where there is no ray.
    pub(super) pdf: f32,
}

numbers!(Scattered of f32 { origin: Vec3, direction: Vec3, weight: Vec3, pdf: f32 });

impl Vertex {
    /// The BSDF's value and density for light from a direction.
    #[inline(always)]
    pub(super) fn eval(&self, direction: Vec3, model: MaterialModel) -> Scatter {
        let frame = frame(self.normal);
        let local = local(&frame, direction);
        let found = self.bsdf.eval(self::local(&frame, self.view), local);
        if self.on_side(local, direction, model) { found } else { Scatter::default() }
    }

    /// Samples the next ray.
    #[inline(always)]
    pub(super) fn scatter(&self, [lobe, u]: [Draw; 2], model: MaterialModel) -> Scattered {
        let frame = frame(self.normal);
        let chosen = self.bsdf.sample(local(&frame, self.view), lobe.number(), u.square());
        let chosen = chosen.unwrap_or(Chosen::NONE);
        let direction = (frame * chosen.direction).normalize();
        let goes_on = self.on_side(chosen.direction, direction, model);
        Scattered {
            origin: self.place.leave(direction),
            direction,
            weight: chosen.weight,
            pdf: if goes_on { chosen.pdf } else { 0.0 },
        }
    }

    /// Whether shading normal and triangle agree on the side that a direction is on. Where they do
    /// not, light would shine through the surface. [`MaterialModel::Lambert`] skips this test, as
    /// does the renderer that it is compared with.
    #[inline(always)]
    fn on_side(&self, local: Vec3, world: Vec3, model: MaterialModel) -> bool {
        model == MaterialModel::Lambert || (local.z > 0.0) == (world.dot(self.place.normal) > 0.0)
    }
}

/// Transforms a direction from the world to the shading frame.
#[inline(always)]
fn local(frame: &Mat3, world: Vec3) -> Vec3 {
    Vec3::new(frame.x_axis.dot(world), frame.y_axis.dot(world), frame.z_axis.dot(world))
}

/// The vertices of a group, in columns.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    pub(super) places: Columns<{ HitPoint::NUMBERS }>,
    pub(super) views: Columns<3>,
    pub(super) normals: Columns<3>,
    pub(super) bsdfs: Columns<{ Bsdf::NUMBERS }>,
}

impl Vertices {
    #[inline(always)]
    pub(super) fn get(&self, vertex: usize) -> Vertex {
        Vertex {
            place: HitPoint::from_array(self.places.get(vertex)),
            view: self.views.get(vertex).into(),
            normal: self.normals.get(vertex).into(),
            bsdf: Bsdf::from_array(self.bsdfs.get(vertex)),
        }
    }

    #[inline(always)]
    pub(super) fn place(&self, vertex: usize) -> HitPoint {
        HitPoint::from_array(self.places.get(vertex))
    }

    /// Evaluates each vertex for its own direction; returns value and density.
    #[inline(always)]
    pub(super) fn eval(&self, directions: &Columns<3>, model: MaterialModel) -> Columns<4> {
        let mut found = Columns::default();
        for vertex in 0..GROUP {
            let Scatter { value, pdf } =
                self.get(vertex).eval(directions.get(vertex).into(), model);
            found.set(vertex, [value.x, value.y, value.z, pdf]);
        }
        found
    }
}
