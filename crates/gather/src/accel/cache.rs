//! Hierarchies kept from snapshot to snapshot.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::Affine3A;
use lumencast_scene::{Deformation, Instance, Mesh, NodeId, Snapshot};

use super::{Accel, Kernel, Levels, TriangleBvh};

/// Keeps one hierarchy a mesh (by the mesh's pointer) and one a deforming instance (by its node),
/// and drops those that the latest snapshot does not use. With one level, keeps that of the latest
/// snapshot.
#[derive(Debug, Default)]
pub(crate) struct AccelCache {
    levels: Levels,
    whole: Option<(Arc<Snapshot>, Arc<TriangleBvh>)>,
    pub(super) rigid: HashMap<Address, Kept<()>>,
    pub(super) deforming: HashMap<(NodeId, Address), Kept<Arc<Deformation>>>,
}

#[derive(Debug)]
pub(super) struct Kept<D> {
    /// Keeps the address from being used again.
    mesh: Arc<Mesh>,
    /// What the hierarchy was last fitted to.
    deformation: D,
    bvh: Arc<TriangleBvh>,
    used: bool,
}

/// Where a mesh lies; only compared, while [`Kept`] keeps the place from being used again.
pub(super) type Address = usize;

fn address(mesh: &Arc<Mesh>) -> Address {
    Arc::as_ptr(mesh).addr()
}

impl AccelCache {
    pub(crate) fn new(levels: Levels) -> Self {
        Self { levels, ..Self::default() }
    }

    /// The structure of a snapshot; what has not changed since the last one is taken from there.
    pub(crate) fn update(&mut self, snapshot: &Arc<Snapshot>, kernel: Kernel) -> Accel {
        if self.levels == Levels::One && copies_are_few(&snapshot.instances) {
            let whole = (0, Affine3A::IDENTITY, self.whole(snapshot));
            return Accel::new([whole], kernel);
        }
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

    fn whole(&mut self, snapshot: &Arc<Snapshot>) -> Arc<TriangleBvh> {
        if let Some((of, bvh)) = &self.whole
            && Arc::ptr_eq(of, snapshot)
        {
            return bvh.clone();
        }
        let bvh = Arc::new(TriangleBvh::whole(&snapshot.instances));
        self.whole = Some((snapshot.clone(), bvh.clone()));
        bvh
    }

    fn rigid(&mut self, instance: &Instance) -> Arc<TriangleBvh> {
        let kept = self.rigid.entry(address(&instance.mesh)).or_insert_with(|| Kept {
            mesh: instance.mesh.clone(),
            deformation: (),
            bvh: Arc::new(TriangleBvh::build(&instance.mesh, None)),
            used: true,
        });
        kept.used = true;
        kept.bvh.clone()
    }

    fn deformed(
        &mut self,
        instance: &Instance,
        deformation: &Arc<Deformation>,
    ) -> Arc<TriangleBvh> {
        let key = (instance.node, address(&instance.mesh));
        let kept = self.deforming.entry(key).or_insert_with(|| Kept {
            mesh: instance.mesh.clone(),
            deformation: deformation.clone(),
            bvh: Arc::new(TriangleBvh::build(&instance.mesh, Some(deformation.vertices()))),
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

/// Up to so many triangles, however often the same one, are taken into one hierarchy anyway: about
/// 40 MB.
const FEW: usize = 1 << 19;

/// Whether a scene's instances have at most twice as many triangles as its meshes, or [`FEW`].
fn copies_are_few(instances: &[Instance]) -> bool {
    let mut seen = HashSet::new();
    let (mut all, mut distinct) = (0, 0);
    for instance in instances {
        let count = instance.mesh.triangle_count();
        all += count;
        if instance.deformation.is_some() || seen.insert(address(&instance.mesh)) {
            distinct += count;
        }
    }
    all <= FEW.max(2 * distinct)
}
