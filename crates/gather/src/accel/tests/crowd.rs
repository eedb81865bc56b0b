//! A scene with many overlapping surfaces.

use super::*;

pub(super) fn snapshot(placed: Vec<(Affine3A, Arc<Mesh>)>) -> Arc<Snapshot> {
    let instance = |(world_from_object, mesh): (Affine3A, Arc<Mesh>)| Instance {
        node: NodeId(0),
        copy: 0,
        still: true,
        mesh_id: MeshId(0),
        mesh,
        deformation: None,
        world_from_object,
    };
    Arc::new(Snapshot {
        version: 0,
        time: 0.0,
        origin: Vec3::ZERO,
        instances: placed.into_iter().map(instance).collect(),
        materials: Arc::new([]),
        lights: vec![],
        environment: Default::default(),
    })
}

pub(super) fn turned(scale: f32, by: f32, to: Vec3) -> Affine3A {
    Affine3A::from_scale_rotation_translation(Vec3::splat(scale), Quat::from_rotation_x(by), to)
}

/// A horizontal square of two triangles, with this half-width.
pub(super) fn sheet(size: f32) -> Arc<Mesh> {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let corners = corners.map(|[x, z]| size * Vec3::new(x, 0.0, z));
    mesh(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
}

/// A ball and scattered triangles between large sheets, one of which is partly transparent.
pub(super) fn crowd(scale: f32, to: Vec3) -> Vec<(Affine3A, Arc<Mesh>)> {
    let at = |by: f32, x: f32, y: f32, z: f32| turned(scale, by, to + scale * Vec3::new(x, y, z));
    vec![
        (at(0.02, 0.0, -1.2, 0.0), sheet(4.0)),
        (at(0.1, 1.0, 1.5, 0.3), sheet(1.0)),
        (at(0.3, 0.0, 0.0, 0.0), ball(12, 0.2)),
        (at(-0.4, 0.5, -0.5, 1.0), soup(300, 0.3)),
    ]
}

/// The instance that is partly transparent.
pub(super) const THIN: u32 = 1;

pub(super) fn lets_pass(hit: &Hit, ray: u32) -> bool {
    hit.instance == THIN && (hit.triangle ^ ray).is_multiple_of(3)
}
