//! Hierarchies kept from snapshot to snapshot.

use std::collections::{HashMap, HashSet};
use std::hash::Hash;
use std::sync::Arc;

use glam::Affine3A;
use lumencast_scene::{Deformation, Instance, Mesh, NodeId, Snapshot};
use rayon::prelude::*;

use super::{Accel, Kernel, Levels, Trees, TriangleBvh};

/// Hierarchies of the latest snapshot: one for each mesh (by the mesh's address) and one for each
/// deforming instance (by its node). Those that the latest snapshot does not use are dropped. With
/// one level, it keeps the single hierarchy of the latest snapshot.
#[derive(Debug, Default)]
pub(crate) struct AccelCache {
    levels: Levels,
    /// Effort to build hierarchies of rigid meshes and of whole scenes.
    trees: Trees,
    whole: Option<(Arc<Snapshot>, Arc<TriangleBvh>)>,
    pub(super) rigid: HashMap<Address, Kept<()>>,
    pub(super) deforming: HashMap<(NodeId, Address), Kept<Arc<Deformation>>>,
}

#[derive(Debug)]
pub(super) struct Kept<D> {
    /// Keeps the mesh's address from being reused.
    mesh: Arc<Mesh>,
    /// The deformation that the hierarchy was last fitted to.
    deformation: D,
    bvh: Arc<TriangleBvh>,
}

/// Address of a mesh. It is only compared, while [`Kept`] keeps the mesh alive.
pub(super) type Address = usize;

fn address(mesh: &Arc<Mesh>) -> Address {
    Arc::as_ptr(mesh).addr()
}

impl AccelCache {
    pub(crate) fn new(levels: Levels) -> Self {
        Self { levels, ..Self::default() }
    }

    /// A cache that builds its hierarchies with this effort.
    pub(crate) fn with_trees(self, trees: Trees) -> Self {
        Self { trees, ..self }
    }

    pub(crate) fn levels(&self) -> Levels {
        self.levels
    }

    /// The acceleration structure of a snapshot; unchanged parts are reused.
    pub(crate) fn update(&mut self, snapshot: &Arc<Snapshot>, kernel: Kernel) -> Accel {
        if self.levels == Levels::One && copies_are_few(&snapshot.instances) {
            let whole = (0, Affine3A::IDENTITY, self.whole(snapshot));
            return Accel::new([whole], kernel);
        }
        let rigid = snapshot.instances.iter().filter(|i| i.deformation.is_none());
        let (trees, rigid) = (self.trees, rigid.map(|i| (address(&i.mesh), i)));
        update_all(&mut self.rigid, rigid, |kept, i| Kept::rigid(kept, i, trees), Kept::is_owned);
        let deforming =
            snapshot.instances.iter().filter_map(|i| Some((i, i.deformation.as_ref()?)));
        update_all(
            &mut self.deforming,
            deforming.map(|of| (deforming_key(of.0), of)),
            Kept::deformed,
            |_| false,
        );
        let placed = (0..).zip(&snapshot.instances).map(|(index, instance)| {
            let bvh = match &instance.deformation {
                None => &self.rigid[&address(&instance.mesh)].bvh,
                Some(_) => &self.deforming[&deforming_key(instance)].bvh,
            };
            (index, instance.world_from_object, bvh.clone())
        });
        Accel::new(placed, kernel)
    }

    fn whole(&mut self, snapshot: &Arc<Snapshot>) -> Arc<TriangleBvh> {
        if let Some((of, bvh)) = &self.whole
            && Arc::ptr_eq(of, snapshot)
        {
            return bvh.clone();
        }
        let bvh = Arc::new(TriangleBvh::whole(&snapshot.instances, self.trees));
        self.whole = Some((snapshot.clone(), bvh.clone()));
        bvh
    }
}

fn deforming_key(instance: &Instance) -> (NodeId, Address) {
    (instance.node, address(&instance.mesh))
}

/// Updates the kept hierarchies to the present ones, in parallel. It drops the rest, except those
/// that are to stay.
fn update_all<K, I, D>(
    all: &mut HashMap<K, Kept<D>>,
    now: impl Iterator<Item = (K, I)>,
    update: impl Fn(Option<Kept<D>>, I) -> Kept<D> + Sync + Send,
    stays: impl Fn(&Kept<D>) -> bool,
) where
    K: Copy + Eq + Hash + Send,
    I: Send,
    D: Send,
{
    let mut seen = HashSet::new();
    let distinct = now.filter(|(key, _)| seen.insert(*key));
    let both: Vec<_> = distinct.map(|(key, of)| (key, all.remove(&key), of)).collect();
    all.retain(|_, kept| stays(kept));
    all.par_extend(both.into_par_iter().map(|(key, kept, of)| (key, update(kept, of))));
}

impl Kept<()> {
    /// Whether somebody else owns the mesh, as a scene owns the meshes of files that edits have
    /// added. An object that is removed and added again then needs no new build.
    fn is_owned(&self) -> bool {
        Arc::strong_count(&self.mesh) > 1
    }

    fn rigid(kept: Option<Self>, instance: &Instance, trees: Trees) -> Self {
        kept.unwrap_or_else(|| Self {
            mesh: instance.mesh.clone(),
            deformation: (),
            bvh: Arc::new(TriangleBvh::build(&instance.mesh, None, trees)),
        })
    }
}

impl Kept<Arc<Deformation>> {
    fn deformed(
        kept: Option<Self>,
        (instance, deformation): (&Instance, &Arc<Deformation>),
    ) -> Self {
        let Some(mut kept) = kept else {
            return Self {
                mesh: instance.mesh.clone(),
                deformation: deformation.clone(),
                bvh: Arc::new(TriangleBvh::build(
                    &instance.mesh,
                    Some(deformation.vertices()),
                    Trees::AsBuilt,
                )),
            };
        };
        if !Arc::ptr_eq(&kept.deformation, deformation) {
            kept.deformation = deformation.clone();
            // A running job may still trace the old hierarchy; `make_mut` then copies it.
            Arc::make_mut(&mut kept.bvh).refit(&kept.mesh, deformation.vertices());
        }
        kept
    }
}

/// Up to this number of triangles (about 40 MB), one hierarchy is used however many copies there
/// are.
const FEW: usize = 1 << 19;

/// Whether a scene's instances have at most twice as many triangles as its distinct meshes, or at
/// most [`FEW`].
fn copies_are_few(instances: &[Instance]) -> bool {
    let mut seen = HashSet::new();
    let (mut all, mut distinct) = (0, 0);
    for instance in instances {
        let count = instance.mesh.triangle_count();
        all += count;
        let shape = match &instance.deformation {
            Some(deformation) => Arc::as_ptr(deformation).addr(),
            None => address(&instance.mesh),
        };
        if seen.insert(shape) {
            distinct += count;
        }
    }
    all <= FEW.max(2 * distinct)
}
