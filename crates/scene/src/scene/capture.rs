//! Captures the scene at one moment, flattened to instances and lights.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{Affine3A, DAffine3, Mat3A, Vec3, Vec3A};

use super::Scene;
use super::nodes::{Node, PlacedSkin};
use crate::trs::is_invertible;
use crate::{Deformation, Instance, Mesh, NodeId, PlacedLight, Pose, Snapshot};

/// Deformations by node, kept while they are unchanged.
#[derive(Clone, Debug, Default)]
pub(crate) struct Deformations(BTreeMap<NodeId, Kept>);

#[derive(Clone, Debug)]
struct Kept {
    deformation: Arc<Deformation>,
    used: bool,
}

/// The space of skinned meshes that are mirrored. Their triangles then wind as at rest. The
/// transform says, as for any mirrored instance, that they are seen from the other side.
const MIRROR: Affine3A =
    Affine3A { matrix3: Mat3A::from_diagonal(Vec3::new(-1.0, 1.0, 1.0)), translation: Vec3A::ZERO };

impl Scene {
    /// The scene at the current moment. It is cheap while nothing changes, since it returns the
    /// same one.
    pub fn snapshot(&mut self) -> Arc<Snapshot> {
        let snapshot = match self.snapshot.take() {
            Some(mut snapshot) => {
                if snapshot.time != self.time {
                    Arc::make_mut(&mut snapshot).time = self.time;
                }
                snapshot
            }
            None => Arc::new(self.capture()),
        };
        self.snapshot = Some(snapshot.clone());
        snapshot
    }

    fn capture(&mut self) -> Snapshot {
        let materials =
            self.shared_materials.get_or_insert_with(|| Arc::from(self.materials.clone())).clone();
        let mut deformations = std::mem::take(&mut self.deformations);
        deformations.0.values_mut().for_each(|kept| kept.used = false);
        let instances = self.instances(&mut deformations);
        deformations.0.retain(|_, kept| kept.used);
        self.deformations = deformations;
        let mut lights = self.lights();
        lights.retain(|l| l.light.shines());
        let environment = self.environment.clone();
        let (version, time, origin) = (self.version, self.time, self.nodes.origin());
        Snapshot { version, time, origin, instances, materials, lights, environment }
    }

    pub(super) fn instances(&self, deformations: &mut Deformations) -> Vec<Instance> {
        let mut instances = Vec::new();
        let mut moving = BTreeSet::new();
        for (id, node, place) in self.nodes.shown() {
            // Parents come first.
            if node.animated || node.parent.is_some_and(|parent| moving.contains(&parent)) {
                moving.insert(id);
            }
            let still = !moving.contains(&id);
            let of_place = |place| {
                let mut instance = self.instance(id, node, place, deformations)?;
                instance.still &= still;
                Some(instance)
            };
            instances.extend(node.places(&place).filter_map(of_place));
        }
        instances
    }

    /// The instance of a node's mesh; `None` where there is no mesh or it has shrunk to nothing.
    fn instance(
        &self,
        id: NodeId,
        node: &Node,
        (copy, place): (u32, DAffine3),
        deformations: &mut Deformations,
    ) -> Option<Instance> {
        let mesh_id = node.mesh?;
        let mesh = self.meshes.get(mesh_id.0 as usize).filter(|m| m.triangle_count() > 0)?.clone();
        let origin = DAffine3::from_translation(mesh.origin.as_dvec3());
        let world_from_node = (place * origin).as_affine3a();
        let world_from_rest =
            node.skin.as_ref().map(|skin| self.world_from_rest(skin, world_from_node));
        if let Some(joints) = &world_from_rest {
            if !joints.iter().chain([&world_from_node]).all(|m| m.is_finite()) {
                return None;
            }
        } else if !is_invertible(&world_from_node) {
            return None;
        }
        // The joints place a skinned mesh; its own node's transform does not.
        let world_from_object = match &world_from_rest {
            Some(joints) if is_mirrored(joints) => MIRROR,
            Some(_) => Affine3A::IDENTITY,
            None => world_from_node,
        };
        let is_deformed = world_from_rest.is_some() || !node.weights.is_empty();
        let deformation = is_deformed.then(|| {
            // A mirror is its own inverse.
            let pose = world_from_rest.map(|joints| Pose {
                joints: joints.into_iter().map(|joint| world_from_object * joint).collect(),
                rigid: world_from_object * world_from_node,
            });
            deformations.of(id, &mesh, &node.weights, pose)
        });
        let still = deformation.is_none();
        Some(Instance { node: id, copy, still, mesh_id, mesh, deformation, world_from_object })
    }

    fn world_from_rest(&self, placed: &PlacedSkin, world_from_node: Affine3A) -> Vec<Affine3A> {
        let world_from_rest = |(joint, joint_from_rest): &(u32, Affine3A)| {
            let joint = NodeId(placed.first_node.saturating_add(*joint));
            if self.nodes.contains(joint) {
                self.nodes.place_of(joint).as_affine3a() * *joint_from_rest
            } else {
                world_from_node
            }
        };
        placed.skin.joints.iter().map(world_from_rest).collect()
    }

    /// All punctual lights that the scene shows, also those without intensity. Positions are
    /// relative to [`Snapshot::origin`].
    pub fn lights(&self) -> Vec<PlacedLight> {
        let shown = self.nodes.shown().into_iter();
        shown.filter_map(|(id, node, place)| place_light(id, node, &place.as_affine3a())).collect()
    }
}

impl Deformations {
    fn of(
        &mut self,
        id: NodeId,
        mesh: &Arc<Mesh>,
        weights: &[f32],
        pose: Option<Pose>,
    ) -> Arc<Deformation> {
        if let Some(kept) = self.0.get_mut(&id)
            && kept.deformation.has_cause(mesh, weights, pose.as_ref())
        {
            kept.used = true;
            return kept.deformation.clone();
        }
        let deformation = Arc::new(Deformation::new(mesh.clone(), weights.to_vec(), pose));
        self.0.insert(id, Kept { deformation: deformation.clone(), used: true });
        deformation
    }
}

/// Whether most joints mirror the mesh.
fn is_mirrored(joints: &[Affine3A]) -> bool {
    let mirrored = joints.iter().filter(|joint| joint.matrix3.determinant() < 0.0).count();
    2 * mirrored > joints.len()
}

/// The light of a node. The node's scale does not change its intensity.
fn place_light(id: NodeId, node: &Node, world_from_node: &Affine3A) -> Option<PlacedLight> {
    let light = node.light?;
    let direction = (world_from_node.matrix3 * Vec3A::NEG_Z).try_normalize()?;
    let position = Vec3::from(world_from_node.translation);
    position.is_finite().then(|| PlacedLight {
        node: id,
        light,
        position,
        direction: direction.into(),
    })
}
