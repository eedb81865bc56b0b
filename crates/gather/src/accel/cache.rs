//! Hierarchies kept from snapshot to snapshot.

use std::collections::HashMap;
use std::sync::Arc;

use lumencast_scene::{Deformation, Instance, Mesh, NodeId, Snapshot};

use super::{Accel, Kernel, MeshBvh};

/// Keeps one hierarchy a mesh (by the mesh's pointer) and one a deforming instance (by its node),
/// and drops those that the latest snapshot does not use.
#[derive(Debug, Default)]
pub(crate) struct AccelCache {
    pub(super) rigid: HashMap<Address, Kept<()>>,
    pub(super) deforming: HashMap<(NodeId, Address), Kept<Arc<Deformation>>>,
}

#[derive(Debug)]
pub(super) struct Kept<D> {
    /// Keeps the address from being used again.
    mesh: Arc<Mesh>,
    /// What the hierarchy was last fitted to.
    deformation: D,
    bvh: Arc<MeshBvh>,
    used: bool,
}

/// Where a mesh lies; only compared, while [`Kept`] keeps the place from being used again.
pub(super) type Address = usize;

fn address(mesh: &Arc<Mesh>) -> Address {
    Arc::as_ptr(mesh).addr()
}

impl AccelCache {
    /// The structure of a snapshot; what has not changed since the last one is taken from there.
    pub(crate) fn update(&mut self, snapshot: &Snapshot, kernel: Kernel) -> Accel {
        self.rigid.values_mut().for_each(|k| k.used = false);
        self.deforming.values_mut().for_each(|k| k.used = false);
        let placed: Vec<_> = (0..)
            .zip(&snapshot.instances)
            .map(|(index, instance)| {
                let bvh = match &instance.deformation {
                    None => self.rigid(instance),
                    Some(deformation) => self.deformed(instance, deformation),
                };
                (index, instance.world_from_object, bvh)
            })
            .collect();
        self.rigid.retain(|_, k| k.used);
        self.deforming.retain(|_, k| k.used);
        Accel::new(placed, kernel)
    }

    fn rigid(&mut self, instance: &Instance) -> Arc<MeshBvh> {
        let kept = self.rigid.entry(address(&instance.mesh)).or_insert_with(|| Kept {
            mesh: instance.mesh.clone(),
            deformation: (),
            bvh: Arc::new(MeshBvh::build(&instance.mesh, None)),
            used: true,
        });
        kept.used = true;
        kept.bvh.clone()
    }

    fn deformed(&mut self, instance: &Instance, deformation: &Arc<Deformation>) -> Arc<MeshBvh> {
        let key = (instance.node, address(&instance.mesh));
        let kept = self.deforming.entry(key).or_insert_with(|| Kept {
            mesh: instance.mesh.clone(),
            deformation: deformation.clone(),
            bvh: Arc::new(MeshBvh::build(&instance.mesh, Some(deformation.vertices()))),
            used: true,
        });
        if !Arc::ptr_eq(&kept.deformation, deformation) {
            kept.deformation = deformation.clone();
            // A job in flight may still trace the old one: `make_mut` then copies it.
            Arc::make_mut(&mut kept.bvh).refit(&kept.mesh, deformation.vertices());
        }
        kept.used = true;
        kept.bvh.clone()
    }
}
