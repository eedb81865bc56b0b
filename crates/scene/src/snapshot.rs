//! One moment of a scene: what a gatherer traces.

use std::sync::Arc;

use glam::{Affine3A, Vec3};

use crate::{Deformation, Environment, Material, Mesh, MeshId, NodeId, PlacedLight, Vertices};

/// One moment of a scene. Immutable; cheap to clone and to send to other threads.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Grows by one at every change that can change light (accepted edits, animation steps).
    /// Every lighting update carries the version it was computed from.
    pub version: u64,
    /// Scene time in seconds.
    pub time: f64,
    /// The point of the world, metres, that places in here are relative to, those of instances and of
    /// lights: zero unless the scene lies far away ([`View::relative_to`](crate::View::relative_to)).
    /// Whatever else has a place, receivers, cameras, volumes, has it in the world.
    pub origin: Vec3,
    /// Placed meshes.
    pub instances: Vec<Instance>,
    /// Indexed by [`crate::MaterialId`].
    pub materials: Arc<[Material]>,
    /// Punctual lights with an intensity above zero.
    pub lights: Vec<PlacedLight>,
    /// Light from afar.
    pub environment: Environment,
}

/// A mesh at its place.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The node that carries it. Several where that has instances (EXT_mesh_gpu_instancing), which
    /// share a deformation.
    pub node: NodeId,
    /// Which mesh: equal ids have equal `mesh` pointers, so acceleration structures can be kept.
    pub mesh_id: MeshId,
    /// The mesh at rest.
    pub mesh: Arc<Mesh>,
    /// How it is skinned and morphed; absent for rigid meshes. A skinned mesh's vertices are in the
    /// space of `world_from_object` like any other's. Equal pointers are equal vertices.
    pub deformation: Option<Arc<Deformation>>,
    /// To the world, moved to the snapshot's origin. Affine, invertible; a negative determinant mirrors and flips the winding.
    pub world_from_object: Affine3A,
}

impl Instance {
    /// The vertices of a primitive in object space, deformed where the mesh is.
    #[inline]
    pub fn vertices(&self, primitive: usize) -> &Vertices {
        match &self.deformation {
            Some(deformation) => &deformation.vertices()[primitive],
            None => &self.mesh.primitives[primitive].vertices,
        }
    }
}
