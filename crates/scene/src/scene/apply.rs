//! Application of edits. Each is checked, then applied wholly, or refused without any change.
//!
//! **Animated nodes.** A node has one transform, and the last one to set it wins. A running
//! animation sets its nodes at every step, so an edit of such a part lasts until the next step. A
//! paused animation leaves its nodes where they are, and edits move them from there. Pausing,
//! seeking and playing move the animation's nodes to where it has them at that moment.

use glam::{Affine3A, Quat, Vec3, Vec4};

use super::Scene;
use super::nodes::Node;
use crate::asset::Asset;
use crate::error::Fault;
use crate::gltf::source::shorten;
use crate::limits;
use crate::trs::{Trs, is_in_world, is_invertible};
use crate::{
    AlphaMode, AnimationId, Edit, Environment, InstanceSource, LightKind, LightSpec, Material,
    MaterialChange, MaterialId, MeshId, NodeId, NodeName, Playback, PunctualLight, Transform,
};

/// The reason why an edit is refused, meant for its sender.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EditError {
    /// There is no node of that number.
    #[error("node {0} does not exist")]
    UnknownNode(NodeId),
    /// There is no mesh of that number.
    #[error("mesh {0} does not exist")]
    UnknownMesh(MeshId),
    /// There is no material of that number.
    #[error("material {0} does not exist")]
    UnknownMaterial(MaterialId),
    /// There is no animation of that number.
    #[error("animation {0} does not exist")]
    UnknownAnimation(AnimationId),
    /// The node carries no light.
    #[error("{0} carries no light")]
    NoLight(String),
    /// The number of a node to add is in use or was used.
    #[error("node number {0} is taken")]
    Taken(NodeId),
    /// A value makes no sense.
    #[error("{what}: {why}")]
    Senseless {
        /// The thing to be changed.
        what: String,
        /// What is wrong with the value.
        why: String,
    },
    /// A file cannot be added.
    #[error("{file:?} {fault}")]
    File {
        /// Its URI, as the edit writes it.
        file: String,
        /// What is wrong with it.
        fault: Fault,
    },
    /// The scene would have too many nodes.
    #[error("a scene has at most {} nodes and instances of nodes", limits::NODES)]
    TooMany,
}

/// The source of the numbers of nodes that an edit adds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Numbers {
    /// This scene gives the number; one in the edit is ignored.
    Given,
    /// The edit has the number.
    InEdit,
}

impl Scene {
    /// Applies an edit, or refuses it and changes nothing. Returns the edit with the number of the
    /// added node filled in; this scene chooses that number, whatever the edit says. Reads the file
    /// that the edit names unless it has been read ([`Scene::file_to_read`]).
    ///
    /// # Errors
    /// The edit makes no sense for this scene.
    pub fn apply(&mut self, edit: &Edit) -> Result<Edit, EditError> {
        self.apply_numbered(edit, Numbers::Given)
    }

    /// Applies an edit that another replica of the scene has accepted, with the numbers in it.
    ///
    /// # Errors
    /// Those of [`Scene::apply`], and a number that is missing or taken.
    pub fn replay(&mut self, edit: &Edit) -> Result<(), EditError> {
        self.apply_numbered(edit, Numbers::InEdit).map(|_| ())
    }

    fn apply_numbered(&mut self, edit: &Edit, numbers: Numbers) -> Result<Edit, EditError> {
        self.read_now(self.file_to_read(edit));
        let mut edit = edit.clone();
        match &mut edit {
            Edit::MoveNode { node, transform } => self.move_node(*node, transform)?,
            Edit::AddInstance { node, name, source, parent, transform } => {
                let id = self.number(*node, numbers)?;
                self.add_instance(id, source, *parent, transform)?;
                self.name_node(id, name.as_ref());
                *node = Some(id);
            }
            Edit::AddLight { node, name, light, parent, transform } => {
                let id = self.number(*node, numbers)?;
                self.add_light(id, *light, *parent, transform)?;
                self.name_node(id, name.as_ref());
                *node = Some(id);
            }
            Edit::RemoveNode { node } => self.remove_node(*node)?,
            Edit::SetLight { node, light } => self.set_light(*node, light)?,
            Edit::RemoveLight { node } => self.remove_light(*node)?,
            Edit::SetMaterial { material, change } => self.set_material(*material, change)?,
            Edit::SetAnimation { animation, playback } => {
                self.set_animation(*animation, playback)?;
            }
            Edit::SetEnvironment { environment } => self.set_environment(environment)?,
        }
        self.changed();
        Ok(edit)
    }

    fn number(&self, in_edit: Option<NodeId>, numbers: Numbers) -> Result<NodeId, EditError> {
        let next = NodeId(self.nodes.next());
        match (numbers, in_edit) {
            (Numbers::Given, _) => Ok(next),
            (Numbers::InEdit, Some(id)) if id >= next => Ok(id),
            (Numbers::InEdit, Some(id)) => Err(EditError::Taken(id)),
            (Numbers::InEdit, None) => Err(EditError::Senseless {
                what: "an added node".into(),
                why: "it has no number".into(),
            }),
        }
    }

    fn name_node(&mut self, id: NodeId, name: Option<&NodeName>) {
        if let (Some(node), Some(name)) = (self.nodes.get_mut(id), name) {
            node.name = name.as_str().to_owned();
        }
    }

    /// A node's name for messages.
    fn describe(&self, id: NodeId) -> String {
        match self.nodes.get(id) {
            Some(node) if !node.name.is_empty() => format!("node {id} {:?}", node.name),
            _ => format!("node {id}"),
        }
    }

    fn senseless(&self, id: NodeId, why: impl Into<String>) -> EditError {
        EditError::Senseless { what: self.describe(id), why: why.into() }
    }

    fn move_node(&mut self, id: NodeId, transform: &Transform) -> Result<(), EditError> {
        check_transform(transform).map_err(|why| self.senseless(id, why))?;
        let node = self.nodes.get_mut(id).ok_or(EditError::UnknownNode(id))?;
        let before = node.parent_from_node;
        node.parent_from_node = before.with(transform);
        if let Err(error) = self.check_places(id, &before) {
            if let Some(node) = self.nodes.get_mut(id) {
                node.parent_from_node = before;
            }
            return Err(error);
        }
        Ok(())
    }

    /// Checks that a changed node and all nodes below it still have transforms within the world.
    fn check_places(&self, id: NodeId, before: &Trs) -> Result<(), EditError> {
        let local = self.nodes.get(id).map(|n| n.parent_from_node.affine()).unwrap_or_default();
        if !is_invertible(&local) && is_invertible(&before.affine()) {
            return Err(self.senseless(id, "its transform would flatten it"));
        }
        let mut placed = self.nodes.placed_from(id).into_iter();
        let lost = placed.find(|(_, _, place)| !is_in_world(&place.as_affine3a()));
        match lost {
            None => Ok(()),
            Some((lost, _, _)) => {
                Err(self.senseless(id, format!("it would put node {lost} out of the world")))
            }
        }
    }

    /// Checks that there is room for `nodes` nodes from `id` on, and for `size` more nodes and
    /// instances.
    fn check_room(&self, id: NodeId, nodes: usize, size: usize) -> Result<(), EditError> {
        let there_are_numbers =
            u32::try_from(nodes).is_ok_and(|n| id.0.checked_add(n).is_some_and(|n| n < u32::MAX));
        match there_are_numbers && self.nodes.size() + size <= limits::NODES {
            true => Ok(()),
            false => Err(EditError::TooMany),
        }
    }

    /// The transform that an added node would have; an error where it cannot be there.
    pub(super) fn check_addition(
        &self,
        what: &str,
        parent: Option<NodeId>,
        transform: &Transform,
    ) -> Result<(Trs, Affine3A), EditError> {
        let senseless = |why: &str| EditError::Senseless { what: what.into(), why: why.into() };
        check_transform(transform).map_err(senseless)?;
        let trs = Trs::default().with(transform);
        let world_from_parent = match parent {
            None => Affine3A::IDENTITY,
            Some(parent) if self.nodes.contains(parent) => {
                self.nodes.place_of(parent).as_affine3a()
            }
            Some(parent) => return Err(EditError::UnknownNode(parent)),
        };
        let world = world_from_parent * trs.affine();
        if !is_invertible(&trs.affine()) {
            return Err(senseless("its transform would flatten it"));
        }
        if !is_in_world(&world) {
            return Err(senseless("it would be out of the world"));
        }
        Ok((trs, world))
    }

    fn add_instance(
        &mut self,
        id: NodeId,
        source: &InstanceSource,
        parent: Option<NodeId>,
        transform: &Transform,
    ) -> Result<(), EditError> {
        let (trs, world) = self.check_addition("the instance", parent, transform)?;
        self.check_room(id, 1, 1)?;
        match source {
            InstanceSource::Mesh(mesh) => {
                let Some(m) = self.meshes.get(mesh.0 as usize) else {
                    return Err(EditError::UnknownMesh(*mesh));
                };
                let (mesh, weights) = (Some(*mesh), m.morph_weights.clone());
                let node = Node { parent, parent_from_node: trs, mesh, weights, ..Node::default() };
                self.nodes.attach(id, node);
            }
            InstanceSource::File(file) => self.add_file(id, file, parent, (trs, world))?,
        }
        Ok(())
    }

    fn add_file(
        &mut self,
        id: NodeId,
        file: &str,
        parent: Option<NodeId>,
        (trs, world): (Trs, Affine3A),
    ) -> Result<(), EditError> {
        let fail = |fault| EditError::File { file: shorten(file), fault };
        let name = self.file_name(file).map_err(fail)?;
        let known = self.models[1..].iter().position(|model| model.name == name);
        let model = match known {
            Some(known) => {
                let asset = self.models[known + 1].asset.clone();
                self.check_file(id, &asset, world)?;
                known + 1
            }
            None => {
                let found = self.find_model(&name).map_err(fail)?;
                if let Err(error) = self.check_file(id, &found.asset, world) {
                    self.put_back(&name, found);
                    return Err(error);
                }
                self.take_model(name, found, id)
            }
        };
        self.place_below(model, id, parent, trs);
        self.pose_new_copy(model, id.0 + 1);
        Ok(())
    }

    /// Checks that the scene has room for a file's nodes and that their transforms are within the
    /// world.
    fn check_file(&self, id: NodeId, asset: &Asset, world: Affine3A) -> Result<(), EditError> {
        self.check_room(id, asset.nodes.len() + 1, asset.size() + 1)?;
        match asset.fits(world) {
            true => Ok(()),
            false => Err(EditError::Senseless {
                what: "the instance".into(),
                why: "it would be out of the world".into(),
            }),
        }
    }

    fn add_light(
        &mut self,
        id: NodeId,
        light: PunctualLight,
        parent: Option<NodeId>,
        transform: &Transform,
    ) -> Result<(), EditError> {
        let (trs, _) = self.check_addition("the light", parent, transform)?;
        light.check().map_err(|why| EditError::Senseless { what: "the light".into(), why })?;
        self.check_room(id, 1, 1)?;
        let light = Some(light);
        self.nodes.attach(id, Node { parent, parent_from_node: trs, light, ..Node::default() });
        Ok(())
    }

    fn remove_node(&mut self, id: NodeId) -> Result<(), EditError> {
        if !self.nodes.contains(id) {
            return Err(EditError::UnknownNode(id));
        }
        self.nodes.remove(id);
        for model in &mut self.models[1..] {
            // A copy exists as long as the node that it was added with.
            model.copies.retain(|first| self.nodes.contains(NodeId(first - 1)));
        }
        Ok(())
    }

    fn light_mut(&mut self, id: NodeId) -> Result<&mut PunctualLight, EditError> {
        let described = self.describe(id);
        let node = self.nodes.get_mut(id).ok_or(EditError::UnknownNode(id))?;
        node.light.as_mut().ok_or(EditError::NoLight(described))
    }

    fn set_light(&mut self, id: NodeId, spec: &LightSpec) -> Result<(), EditError> {
        let light = *self.light_mut(id)?;
        let light = changed_light(light, spec).map_err(|why| self.senseless(id, why))?;
        light.check().map_err(|why| self.senseless(id, why))?;
        *self.light_mut(id)? = light;
        Ok(())
    }

    fn remove_light(&mut self, id: NodeId) -> Result<(), EditError> {
        self.light_mut(id)?;
        if let Some(node) = self.nodes.get_mut(id) {
            node.light = None;
        }
        Ok(())
    }

    fn set_material(&mut self, id: MaterialId, change: &MaterialChange) -> Result<(), EditError> {
        let material =
            self.materials.get_mut(id.0 as usize).ok_or(EditError::UnknownMaterial(id))?;
        check_material(material, change).map_err(|why| {
            let what = format!("material {id} {:?}", material.name);
            EditError::Senseless { what, why: why.into() }
        })?;
        material.base_color = change.base_color.unwrap_or(material.base_color);
        material.metallic = change.metallic.unwrap_or(material.metallic);
        material.roughness = change.roughness.unwrap_or(material.roughness);
        material.emissive = change.emissive.unwrap_or(material.emissive);
        material.transmission = change.transmission.unwrap_or(material.transmission);
        material.ior = change.ior.unwrap_or(material.ior);
        material.specular = change.specular.unwrap_or(material.specular);
        material.specular_color = change.specular_color.unwrap_or(material.specular_color);
        material.normal_scale = change.normal_scale.unwrap_or(material.normal_scale);
        if let Some(cutoff) = change.alpha_cutoff {
            material.alpha_mode = AlphaMode::Mask(cutoff);
        }
        self.shared_materials = None;
        Ok(())
    }

    fn set_animation(&mut self, id: AnimationId, change: &Playback) -> Result<(), EditError> {
        let (now, edit) = (self.time, self.version + 1);
        let index = id.0 as usize;
        let clock = self.clocks.get_mut(index).ok_or(EditError::UnknownAnimation(id))?;
        let within = |v: Option<f64>, most: f64| v.is_none_or(|v| v.abs() <= most);
        if !(within(change.time, 1e9) && within(change.speed, 1e6)) {
            return Err(EditError::Senseless {
                what: format!("animation {id}"),
                why: "times are at most 1e9 s, speeds at most 1e6".into(),
            });
        }
        clock.set(change, now, edit);
        self.pose(index);
        self.play();
        Ok(())
    }

    fn set_environment(&mut self, environment: &Environment) -> Result<(), EditError> {
        let senseless = |why| EditError::Senseless { what: "the environment".into(), why };
        environment.check().map_err(senseless)?;
        let file = match environment {
            Environment::Image { uri, .. } => shorten(uri),
            _ => String::new(),
        };
        self.environment = self
            .with_picture(environment.clone())
            .map_err(|fault| EditError::File { file, fault })?;
        self.environment_replaced = true;
        self.give_back_pictures();
        Ok(())
    }
}

fn check_transform(transform: &Transform) -> Result<(), &'static str> {
    let within = |v: Vec3| v.abs().cmple(Vec3::splat(limits::EXTENT)).all();
    if !transform.translation.is_none_or(within) {
        return Err("its translation is not finite, or over 1e9 m");
    }
    let is_rotation = |q: Quat| q.length() > 1e-6 && q.length() < 1e6;
    if !transform.rotation.is_none_or(is_rotation) {
        return Err("its rotation is not a quaternion of a length near 1");
    }
    let is_scale = |v: Vec3| within(v) && v.cmpne(Vec3::ZERO).all();
    if !transform.scale.is_none_or(is_scale) {
        return Err("its scale is not finite, over 1e9, or 0 along an axis");
    }
    Ok(())
}

fn changed_light(
    mut light: PunctualLight,
    spec: &LightSpec,
) -> Result<PunctualLight, &'static str> {
    light.color = spec.color.unwrap_or(light.color);
    light.intensity = spec.intensity.unwrap_or(light.intensity);
    light.range = spec.range.or(light.range);
    light.kind.resize(spec.radius, spec.angle)?;
    if let LightKind::Spot { inner, outer, .. } = &mut light.kind {
        *inner = spec.inner.unwrap_or(*inner);
        *outer = spec.outer.unwrap_or(*outer);
    } else if spec.inner.is_some() || spec.outer.is_some() {
        return Err("only spot lights have cones");
    }
    Ok(light)
}

fn check_material(material: &Material, change: &MaterialChange) -> Result<(), &'static str> {
    let is_share = |v: f32| (0.0..=1.0).contains(&v);
    let all_shares = |c: Vec4| c.to_array().into_iter().all(is_share);
    if !change.base_color.is_none_or(all_shares) {
        return Err("channels of its base colour are 0 to 1");
    }
    if !(change.metallic.is_none_or(is_share) && change.roughness.is_none_or(is_share)) {
        return Err("metalness and roughness are 0 to 1");
    }
    let is_light = |v: Vec3| v.cmpge(Vec3::ZERO).all() && v.max_element() <= limits::LIGHT;
    if !change.emissive.is_none_or(is_light) {
        return Err("its emission is finite and not negative");
    }
    if !change.transmission.is_none_or(is_share) {
        return Err("its transmission is 0 to 1");
    }
    if !change.ior.is_none_or(|n| n == 0.0 || (n >= 1.0 && n.is_finite())) {
        return Err("its ior is finite and 1 or more, or 0");
    }
    if !change.specular.is_none_or(is_share) {
        return Err("its specular strength is 0 to 1");
    }
    let is_tint = |v: Vec3| v.cmpge(Vec3::ZERO).all() && v.max_element() <= limits::EXTENT;
    if !change.specular_color.is_none_or(is_tint) {
        return Err("channels of its specular colour are 0 to 1e9");
    }
    if !change.normal_scale.is_none_or(f32::is_finite) {
        return Err("its normal scale is finite");
    }
    if let Some(cutoff) = change.alpha_cutoff {
        if !matches!(material.alpha_mode, AlphaMode::Mask(_)) {
            return Err("only masked materials have an alpha cutoff");
        }
        if !(cutoff >= 0.0 && cutoff.is_finite()) {
            return Err("its alpha cutoff is finite and 0 or more");
        }
    }
    Ok(())
}
