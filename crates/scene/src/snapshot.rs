//! One moment of a scene: what a gatherer traces.

use std::sync::Arc;

use glam::{Affine3A, Vec3};

use crate::{Deformation, Environment, Material, Mesh, MeshId, NodeId, PlacedLight, Vertices};

/// One moment of a scene. Immutable; cheap to clone and to send to other threads.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Version of the scene, incremented by every change that can change light (accepted edits,
    /// animation steps). Every lighting update carries the version that it was computed from.
    pub version: u64,
    /// Scene time in seconds.
    pub time: f64,
    /// World position, metres, that positions of instances and lights are relative to. It is zero
    /// unless the scene lies far away ([`View::relative_to`](crate::View::relative_to)). Receivers,
    /// cameras and volumes have world positions.
    pub origin: Vec3,
    /// Placed meshes.
    pub instances: Vec<Instance>,
    /// Indexed by [`crate::MaterialId`].
    pub materials: Arc<[Material]>,
    /// Punctual lights with an intensity above zero.
    pub lights: Vec<PlacedLight>,
    /// The environment.
    pub environment: Environment,
}

/// A mesh at its place.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The node that carries it. The instances of one node (EXT_mesh_gpu_instancing) share the node
    /// and its deformation.
    pub node: NodeId,
    /// Number among the node's instances; 0 where the node has no list of them.
    pub copy: u32,
    /// Whether only edits change the instance: nothing deforms it, and no animation moves it or a
    /// node above it, not even a paused one.
    pub still: bool,
    /// Id of the mesh. Equal ids have equal `mesh` pointers, so acceleration structures can be
    /// kept.
    pub mesh_id: MeshId,
    /// The mesh at rest.
    pub mesh: Arc<Mesh>,
    /// Its skinning and morphing; `None` for rigid meshes. Deformed vertices, also those of a
    /// skinned mesh, are in the object space of `world_from_object`. Equal pointers mean equal
    /// vertices.
    pub deformation: Option<Arc<Deformation>>,
    /// Transform to the world, relative to the snapshot's origin. It is affine and invertible; a
    /// negative determinant mirrors and flips the winding.
    pub world_from_object: Affine3A,
}

impl Instance {
    /// Object-space vertices of a primitive, deformed where the mesh is.
    #[inline]
    pub fn vertices(&self, primitive: usize) -> &Vertices {
        match &self.deformation {
            Some(deformation) => &deformation.vertices()[primitive],
            None => &self.mesh.primitives[primitive].vertices,
        }
    }
}
