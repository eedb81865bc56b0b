//! Where points of surfaces lie in the world.

use std::collections::HashMap;

use glam::{Mat3, Vec3};
use lumencast_charts::lumels_on_pages;
use lumencast_light::{Layout, Surface, SurfaceId};
use lumencast_scene::{Instance, Snapshot, Vertices};

/// A lumel's point in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LumelPlace {
    /// Index among the lumels of all pages ([`Layout::index`]).
    pub(crate) lumel: u32,
    /// World, metres.
    pub(crate) position: Vec3,
    /// World unit normal of shading, on the surface's side.
    pub(crate) normal: Vec3,
}

/// A surface of a scene, to be asked where its points lie.
pub(crate) struct PlacedSurface<'a> {
    triangles: &'a [[u32; 3]],
    vertices: &'a Vertices,
    world_from_object: glam::Affine3A,
    /// For normals: world from object, inverse transposed.
    normals: Mat3,
    origin: Vec3,
    back: bool,
}

impl<'a> PlacedSurface<'a> {
    pub(crate) fn new(scene: &Snapshot, instance: &'a Instance, id: SurfaceId) -> Option<Self> {
        let primitive = instance.mesh.primitives.get(id.primitive as usize)?;
        let matrix = Mat3::from(instance.world_from_object.matrix3);
        Some(Self {
            triangles: &primitive.triangles,
            vertices: instance.vertices(id.primitive as usize),
            world_from_object: instance.world_from_object,
            normals: matrix.inverse().transpose(),
            origin: scene.origin,
            back: id.back,
        })
    }

    /// Position and unit normal of a point of a triangle, world; `weights` are barycentric. The normal
    /// is that of shading, where it lies on the side of the triangle's own.
    pub(crate) fn at(&self, triangle: u32, weights: Vec3) -> (Vec3, Vec3) {
        let corners = self.triangles[triangle as usize].map(|vertex| vertex as usize);
        let [a, b, c] = corners.map(|vertex| self.vertices.positions[vertex]);
        let position = weights.x * a + weights.y * b + weights.z * c;
        let [k, l, m] = corners.map(|vertex| self.vertices.normals[vertex]);
        let own = (self.normals * (b - a).cross(c - a)).normalize_or(Vec3::Y);
        let shading = self.normals * (weights.x * k + weights.y * l + weights.z * m);
        let shading = shading.normalize_or(own);
        let front = if shading.dot(own) > 0.0 { shading } else { own };
        let position = self.world_from_object.transform_point3(position) + self.origin;
        (position, if self.back { -front } else { front })
    }

    /// Area of a triangle, square metres.
    pub(crate) fn area(&self, triangle: u32) -> f32 {
        let matrix = self.world_from_object.matrix3;
        let corner = |v: u32| matrix * glam::Vec3A::from(self.vertices.positions[v as usize]);
        let [a, b, c] = self.triangles[triangle as usize].map(corner);
        0.5 * (b - a).cross(c - a).length()
    }
}

/// The surfaces of a layout that a scene has, with where they lie.
pub(crate) fn surfaces<'a>(
    scene: &'a Snapshot,
    layout: &'a Layout,
) -> impl Iterator<Item = (&'a Surface, PlacedSurface<'a>)> {
    let by_name: HashMap<(u32, u32), &Instance> =
        scene.instances.iter().map(|i| ((i.node.0, i.copy), i)).collect();
    layout.surfaces().iter().filter_map(move |surface| {
        let instance = by_name.get(&(surface.id.node, surface.id.copy))?;
        Some((surface, PlacedSurface::new(scene, instance, surface.id)?))
    })
}

/// Where all lumels that surfaces cover lie.
pub(crate) fn lumel_places(scene: &Snapshot, layout: &Layout) -> Vec<LumelPlace> {
    let mut places = Vec::new();
    for (surface, placed) in surfaces(scene, layout) {
        places.extend(lumels_on_pages(layout, surface).map(|(index, lumel)| {
            let (position, normal) = placed.at(lumel.triangle, lumel.weights);
            LumelPlace { lumel: index as u32, position, normal }
        }));
    }
    places
}
