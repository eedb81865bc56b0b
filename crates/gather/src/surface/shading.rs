//! Normals of shading at points of a scene.

use glam::Vec3;
use lumencast_light::OnTriangle;
use lumencast_scene::Snapshot;

use super::{Frames, MaterialModel, Triangle, interpolate};

/// The world unit normal that a normal map gives to a point of a scene, on the side that is asked for;
/// nothing where there is no such point, or its material has no normal map.
pub fn shading_normal(scene: &Snapshot, on: &OnTriangle) -> Option<Vec3> {
    let id = on.surface;
    let instance = scene.instances.iter().find(|i| (i.node.0, i.copy) == (id.node, id.copy))?;
    let primitive = instance.mesh.primitives.get(id.primitive as usize)?;
    primitive.triangles.get(on.triangle as usize)?;
    let material = scene.materials.get(primitive.material.0 as usize)?;
    material.normal_texture.as_ref()?;
    let triangle = Triangle::new(instance, id.primitive, on.triangle);
    let bump = triangle.at(material, on.weights).bump(MaterialModel::Full);
    let vertex_normal = interpolate(triangle.normals(), on.weights);
    let normal = Frames::new(instance.world_from_object).normal(bump.bend(vertex_normal));
    (normal != Vec3::ZERO).then_some(if id.back { -normal } else { normal })
}
