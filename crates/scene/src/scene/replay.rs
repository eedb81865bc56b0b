//! The changes of a scene since it was loaded, as edits for clients that join late.

use super::nodes::Node;
use super::{Model, Scene};
use crate::trs::Trs;
use crate::{
    AlphaMode, AnimationId, Edit, InstanceSource, LightKind, LightSpec, Material, MaterialChange,
    MaterialId, NodeId, NodeName, Playback, PunctualLight, Transform,
};

impl Scene {
    /// Edits for [`Scene::replay`] that reproduce this scene. They start from the scene as in its
    /// file, [advanced](Scene::advance) to this scene's time. Their number depends on the
    /// differences, not on how many edits there have been.
    pub fn edits_since_load(&self) -> Vec<Edit> {
        let mut edits = self.structure();
        edits.extend(self.playbacks());
        let mut replica = self.pristine(self.time);
        for edit in &edits {
            if let Err(error) = replica.replay(edit) {
                // Tests show that this does not happen. If it does, the differences below say the
                // rest.
                tracing::error!(%error, ?edit, "an own edit is refused");
            }
        }
        edits.extend(self.differences(&replica));
        edits
    }

    /// Edits that add nodes, in ascending order of numbers, then those that remove nodes.
    fn structure(&self) -> Vec<Edit> {
        let mut edits = Vec::new();
        let file_nodes = self.models[0].asset.nodes.len() as u32;
        for (id, node) in self.nodes.iter().filter(|(id, _)| id.0 >= file_nodes) {
            edits.extend(self.addition(id, node).map(|edit| (id, edit)));
        }
        // A file whose first copy has been removed is still added first, since that numbers its
        // materials.
        for model in &self.models[1..] {
            if let Some(id) = model.added_as.filter(|id| !self.nodes.contains(*id)) {
                let source = source_of(model);
                let (parent, transform) = (None, Transform::default());
                let (node, name) = (Some(id), None);
                let add = Edit::AddInstance { node, name, source, parent, transform };
                edits.push((id, add));
                edits.push((id, Edit::RemoveNode { node: id }));
            }
        }
        edits.sort_by_key(|(id, _)| *id);
        let removed = self.removed().into_iter().map(|node| Edit::RemoveNode { node });
        edits.into_iter().map(|(_, edit)| edit).chain(removed).collect()
    }

    /// The edit that adds a node; `None` for nodes that come with another one.
    fn addition(&self, id: NodeId, node: &Node) -> Option<Edit> {
        let (parent, transform) = (node.parent, whole(node.parent_from_node));
        let name = NodeName::new(node.name.as_str());
        let copy_of =
            self.models[1..].iter().find(|m| m.copies.iter().any(|first| first - 1 == id.0));
        if let Some(model) = copy_of {
            let source = source_of(model);
            let name = name.filter(|name| name.as_str() != model.name);
            return Some(Edit::AddInstance { node: Some(id), name, source, parent, transform });
        }
        if self.is_of_a_file(id) {
            return None;
        }
        if let Some(mesh) = node.mesh {
            let source = InstanceSource::Mesh(mesh);
            return Some(Edit::AddInstance { node: Some(id), name, source, parent, transform });
        }
        // An added light. Where the light has been removed, the node remains and a black light
        // stands in.
        let light = node.light.unwrap_or(NO_LIGHT);
        Some(Edit::AddLight { node: Some(id), name, light, parent, transform })
    }

    fn is_of_a_file(&self, id: NodeId) -> bool {
        self.models.iter().any(|model| {
            let nodes = model.asset.nodes.len() as u32;
            model.copies.iter().any(|first| (*first..first + nodes).contains(&id.0))
        })
    }

    /// Nodes of files that have been removed although their parent remains.
    fn removed(&self) -> Vec<NodeId> {
        let mut removed = Vec::new();
        for model in &self.models {
            for &first in &model.copies {
                for (index, node) in (first..).zip(&model.asset.nodes) {
                    let id = NodeId(index);
                    let parent_is_there =
                        node.parent.is_none_or(|p| self.nodes.contains(NodeId(first + p)));
                    if parent_is_there && !self.nodes.contains(id) {
                        removed.push(id);
                    }
                }
            }
        }
        removed
    }

    /// Playback of animations that were set or came with added files, in the order of setting. Of
    /// those that are paused, the last one has placed its nodes.
    fn playbacks(&self) -> impl Iterator<Item = Edit> {
        let of_file = self.models[0].asset.animations.len();
        let mut set: Vec<_> = self.clocks.iter().enumerate().collect();
        set.retain(|(index, clock)| *index >= of_file || clock.set_by > 0);
        set.sort_by_key(|(_, clock)| clock.set_by);
        set.into_iter().map(|(index, clock)| Edit::SetAnimation {
            animation: AnimationId(index as u32),
            playback: Playback {
                playing: Some(clock.playing),
                time: Some(clock.time_at(self.time)),
                speed: Some(clock.speed),
            },
        })
    }

    /// Edits of values that turn `from`, which has the same nodes, into this scene.
    fn differences(&self, from: &Scene) -> Vec<Edit> {
        let mut edits = Vec::new();
        for (id, node) in self.nodes.iter() {
            let Some(old) = from.nodes.get(id) else { continue };
            edits.extend(moved(id, old.parent_from_node, node.parent_from_node));
            match (old.light, node.light) {
                (Some(_), None) => edits.push(Edit::RemoveLight { node: id }),
                (Some(old), Some(new)) if old != new => edits.push(light_change(id, old, new)),
                _ => {}
            }
        }
        for (index, (new, old)) in self.materials.iter().zip(&from.materials).enumerate() {
            edits.extend(material_change(MaterialId(index as u32), old, new));
        }
        if self.environment_replaced {
            edits.push(Edit::SetEnvironment { environment: self.environment.clone() });
        }
        edits
    }
}

/// Stands in for a light until the edit that removes it.
const NO_LIGHT: PunctualLight = PunctualLight {
    kind: LightKind::Point { radius: 0.0 },
    color: glam::Vec3::ZERO,
    intensity: 0.0,
    range: None,
};

/// The source that names a model's file; it is a URI, so `%` is escaped.
fn source_of(model: &Model) -> InstanceSource {
    InstanceSource::File(model.name.replace('%', "%25"))
}

fn whole(trs: Trs) -> Transform {
    Transform {
        translation: Some(trs.translation.as_vec3()),
        rotation: Some(trs.rotation),
        scale: Some(trs.scale),
    }
}

/// The new value where it differs from the old one.
fn differing<T: PartialEq>(old: T, new: T) -> Option<T> {
    (old != new).then_some(new)
}

fn moved(node: NodeId, old: Trs, new: Trs) -> Option<Edit> {
    let transform = Transform {
        translation: differing(old.translation, new.translation).map(|t| t.as_vec3()),
        rotation: differing(old.rotation, new.rotation),
        scale: differing(old.scale, new.scale),
    };
    (transform != Transform::default()).then_some(Edit::MoveNode { node, transform })
}

fn light_change(node: NodeId, old: PunctualLight, new: PunctualLight) -> Edit {
    let (old, new) = (parts(old), parts(new));
    let light = LightSpec {
        color: differing(old.color, new.color).flatten(),
        intensity: differing(old.intensity, new.intensity).flatten(),
        range: differing(old.range, new.range).flatten(),
        inner: differing(old.inner, new.inner).flatten(),
        outer: differing(old.outer, new.outer).flatten(),
        radius: differing(old.radius, new.radius).flatten(),
        angle: differing(old.angle, new.angle).flatten(),
    };
    Edit::SetLight { node, light }
}

/// All values of a light.
fn parts(light: PunctualLight) -> LightSpec {
    let PunctualLight { kind, color, intensity, range } = light;
    let spec =
        LightSpec { color: Some(color), intensity: Some(intensity), range, ..LightSpec::default() };
    match kind {
        LightKind::Point { radius } => LightSpec { radius: Some(radius), ..spec },
        LightKind::Spot { inner, outer, radius } => {
            let (inner, outer, radius) = (Some(inner), Some(outer), Some(radius));
            LightSpec { inner, outer, radius, ..spec }
        }
        LightKind::Directional { angle } => LightSpec { angle: Some(angle), ..spec },
    }
}

fn material_change(material: MaterialId, old: &Material, new: &Material) -> Option<Edit> {
    let change = MaterialChange {
        base_color: differing(old.base_color, new.base_color),
        metallic: differing(old.metallic, new.metallic),
        roughness: differing(old.roughness, new.roughness),
        emissive: differing(old.emissive, new.emissive),
        transmission: differing(old.transmission, new.transmission),
        ior: differing(old.ior, new.ior),
        specular: differing(old.specular, new.specular),
        specular_color: differing(old.specular_color, new.specular_color),
        normal_scale: differing(old.normal_scale, new.normal_scale),
        alpha_cutoff: differing(cutoff(old), cutoff(new)).flatten(),
    };
    (change != MaterialChange::default()).then_some(Edit::SetMaterial { material, change })
}

fn cutoff(material: &Material) -> Option<f32> {
    match material.alpha_mode {
        AlphaMode::Mask(cutoff) => Some(cutoff),
        AlphaMode::Opaque | AlphaMode::Blend => None,
    }
}
