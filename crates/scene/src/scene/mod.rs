//! The scene: loaded once, changed by edits and by time, captured in snapshots.

mod apply;
mod capture;
mod load;
mod nodes;
mod playback;
mod replay;
mod shelf;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Affine3A, DAffine3, Quat, Vec3};

pub use apply::EditError;
use capture::Deformations;
use nodes::{Node, Nodes};
use playback::Clock;
pub use shelf::{FileRead, FileToRead};
use shelf::{Picture, Shelf};

use crate::animation::Property;
use crate::asset::{Asset, Camera, SceneFile};
use crate::gltf::source::Folder;
use crate::limits::Taken;
use crate::trs::Trs;
use crate::{
    Aabb, AnimationId, Environment, FileContents, LightmapSpec, Material, Mesh, MeshId, NamedView,
    NodeId, PunctualLight, Snapshot, Transform, View, VolumeSpec,
};

/// A scene: the contents of its file, the changes by edits, and its time.
#[derive(Debug)]
pub struct Scene {
    name: String,
    /// The scene's folder; absent for built-in scenes.
    folder: Option<Folder>,
    volumes: Vec<VolumeSpec>,
    lightmap: Option<LightmapSpec>,
    warnings: Vec<String>,
    /// The scene's own file, then the files that edits have added, in order.
    models: Vec<Model>,
    /// Files of another copy of this scene, which can be added without reading them again.
    library: BTreeMap<String, (Arc<Asset>, Taken)>,
    /// Pictures of the current environment and of that in the scene's file, by name.
    pictures: BTreeMap<String, Picture>,
    /// Files that have been read and are not shown.
    shelf: Shelf,
    nodes: Nodes,
    meshes: Vec<Arc<Mesh>>,
    materials: Vec<Material>,
    clocks: Vec<Clock>,
    environment: Environment,
    /// Whether the environment differs from the glTF file's.
    environment_replaced: bool,
    time: f64,
    version: u64,
    deformations: Deformations,
    shared_materials: Option<Arc<[Material]>>,
    snapshot: Option<Arc<Snapshot>>,
}

/// A glTF file in the scene, with the first numbers of its meshes and animations. All copies of the
/// file share meshes, materials and animations.
#[derive(Clone, Debug)]
struct Model {
    /// Name within the scene's folder.
    name: String,
    asset: Arc<Asset>,
    taken: Taken,
    first_mesh: u32,
    first_animation: u32,
    /// For each copy, the number of the node that is the file's node 0.
    copies: Vec<u32>,
    /// The first node that this file was added with.
    added_as: Option<NodeId>,
}

/// A description of a node.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeInfo<'a> {
    /// Its number.
    pub id: NodeId,
    /// Its name in the file; may be empty.
    pub name: &'a str,
    /// Its parent node.
    pub parent: Option<NodeId>,
    /// Its transform relative to the parent; all parts are set.
    pub transform: Transform,
    /// The mesh that it shows.
    pub mesh: Option<MeshId>,
    /// The light that it carries.
    pub light: Option<PunctualLight>,
}

impl<'a> NodeInfo<'a> {
    fn of(id: NodeId, node: &'a Node) -> Self {
        let Trs { translation, rotation, scale } = node.parent_from_node;
        Self {
            id,
            name: &node.name,
            parent: node.parent,
            transform: Transform {
                translation: Some(translation.as_vec3()),
                rotation: Some(rotation),
                scale: Some(scale),
            },
            mesh: node.mesh,
            light: node.light,
        }
    }
}

/// An animation and its state.
#[derive(Clone, Debug, PartialEq)]
pub struct AnimationInfo<'a> {
    /// Its number.
    pub id: AnimationId,
    /// Its name in the file; may be empty.
    pub name: &'a str,
    /// Duration in seconds.
    pub duration: f64,
    /// Whether it runs.
    pub playing: bool,
    /// Its current time, 0 to its duration, seconds.
    pub time: f64,
    /// Rate of playback; negative runs backwards.
    pub speed: f64,
}

/// A camera at its place.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedCamera<'a> {
    /// The node that carries it.
    pub node: NodeId,
    /// The node's name; may be empty.
    pub node_name: &'a str,
    /// Its name and projection.
    pub camera: &'a Camera,
    /// Its transform; it looks along −Z with +Y up.
    pub world_from_camera: Affine3A,
}

impl PlacedCamera<'_> {
    /// The view through the camera.
    pub fn view(&self) -> View {
        View { world_from_camera: self.world_from_camera, projection: self.camera.projection }
    }
}

impl Scene {
    /// Short name made from the file's: lower-case letters, digits, `-`, `_` and `.`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Name of the scene's glTF file within its folder.
    pub fn root_file(&self) -> &str {
        &self.models[0].name
    }

    /// Scene time, seconds since it was loaded.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Version of the scene, incremented by every change that can change light.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Oddities found while loading, such as ignored extensions and repaired faults.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Whether the scene has no light: no lamp shines, no surface emits, and the environment is
    /// black.
    pub fn is_dark(&self) -> bool {
        let shines = |mesh: MeshId| {
            let primitives = &self.meshes[mesh.0 as usize].primitives;
            primitives.iter().any(|primitive| {
                let material = &self.materials[primitive.material.0 as usize];
                material.unlit || material.emissive != Vec3::ZERO
            })
        };
        !self.environment.shines()
            && self.lights().iter().all(|placed| !placed.light.shines())
            && !self.drawn_nodes().filter_map(|node| node.mesh).any(shines)
    }

    /// The volumes that the scene asks for; empty where it leaves the choice to others.
    pub fn volumes(&self) -> Vec<VolumeSpec> {
        self.volumes.clone()
    }

    /// How densely lumels lie on the scene's surfaces; absent where the scene leaves that to others.
    pub fn lightmap(&self) -> Option<LightmapSpec> {
        self.lightmap
    }

    /// The files that clients need to draw the scene, including those that edits have added.
    pub fn files(&self) -> Vec<SceneFile> {
        let mut files: Vec<SceneFile> =
            self.models.iter().flat_map(|m| m.asset.files.iter().cloned()).collect();
        files.extend(self.environment_file());
        let mut seen = std::collections::BTreeSet::new();
        files.retain(|file| seen.insert(file.name.clone()));
        files
    }

    /// The file of the environment's picture, where it has one.
    pub fn environment_file(&self) -> Option<SceneFile> {
        let Environment::Image { uri, .. } = &self.environment else { return None };
        let (name, path) = self.folder.as_ref()?.resolve(uri).ok()?;
        Some(SceneFile { name, contents: FileContents::Path(path) })
    }

    /// World bounds of everything that is drawn. For an empty scene they are a point at the origin.
    pub fn bounds(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        let mut add = |world: &Affine3A, positions: &[Vec3]| {
            positions.iter().for_each(|p| bounds.grow(world.transform_point3(*p)));
        };
        for instance in self.instances(&mut self.deformations.clone()) {
            for primitive in 0..instance.mesh.primitives.len() {
                add(&instance.world_from_object, &instance.vertices(primitive).positions);
            }
        }
        if bounds.is_empty() {
            return Aabb { min: Vec3::ZERO, max: Vec3::ZERO };
        }
        let origin = self.nodes.origin();
        Aabb { min: bounds.min + origin, max: bounds.max + origin }
    }

    /// All nodes, also those that are not drawn.
    pub fn nodes(&self) -> impl Iterator<Item = NodeInfo<'_>> {
        self.nodes.iter().map(|(id, node)| NodeInfo::of(id, node))
    }

    /// The nodes of the file's scene that are not hidden, in ascending order of numbers.
    pub fn drawn_nodes(&self) -> impl Iterator<Item = NodeInfo<'_>> {
        let mut drawn = self.nodes.shown();
        drawn.sort_by_key(|(id, _, _)| *id);
        drawn.into_iter().map(|(id, node, _)| NodeInfo::of(id, node))
    }

    /// The cameras, in the order of the scene's tree.
    pub fn cameras(&self) -> Vec<PlacedCamera<'_>> {
        let placed = self.nodes.placed().into_iter();
        let world = DAffine3::from_translation(self.nodes.origin().as_dvec3());
        let camera = placed.filter_map(|(node, n, place)| {
            let world_from_camera = (world * place).as_affine3a();
            let (model, camera) = n.camera?;
            let camera = self.models.get(model)?.asset.cameras.get(camera as usize)?;
            Some(PlacedCamera { node, node_name: &n.name, camera, world_from_camera })
        });
        camera.collect()
    }

    /// Views of the scene: those of its cameras, in order, then one of the whole scene.
    pub fn views(&self) -> Vec<NamedView> {
        let of_camera = |(number, placed): (usize, PlacedCamera<'_>)| {
            let names = [placed.camera.name.as_str(), placed.node_name];
            let name = names.into_iter().find(|name| !name.is_empty());
            NamedView {
                name: name.map_or_else(|| format!("camera {number}"), str::to_owned),
                node_name: placed.node_name.to_owned(),
                view: placed.view(),
            }
        };
        let mut views: Vec<_> = self.cameras().into_iter().enumerate().map(of_camera).collect();
        let view = View::overview(&self.bounds());
        views.push(NamedView { name: "overview".into(), node_name: String::new(), view });
        views
    }

    /// The animations and their state.
    pub fn animations(&self) -> impl Iterator<Item = AnimationInfo<'_>> {
        let animations = self.models.iter().flat_map(|m| &m.asset.animations);
        (0..).zip(animations.zip(&self.clocks)).map(|(id, (animation, clock))| AnimationInfo {
            id: AnimationId(id),
            name: &animation.name,
            duration: animation.duration,
            playing: clock.playing,
            time: f64::from(clock.position(self.time, animation.duration)),
            speed: clock.speed,
        })
    }

    /// The materials, by number.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The meshes, by number.
    pub fn meshes(&self) -> &[Arc<Mesh>] {
        &self.meshes
    }

    /// The environment.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Lets `seconds` pass and moves what is animated. Returns whether something has moved. A time
    /// that is negative or not finite has no effect.
    pub fn advance(&mut self, seconds: f64) -> bool {
        if seconds.is_finite() && seconds > 0.0 {
            self.time += seconds;
        }
        let moved = self.play();
        if moved {
            self.changed();
        }
        moved
    }

    fn changed(&mut self) {
        self.version += 1;
        self.snapshot = None;
    }

    /// Moves nodes as the running animations have them. Where two move the same node, the later
    /// number wins.
    fn play(&mut self) -> bool {
        let mut moved = false;
        for index in 0..self.clocks.len() {
            if self.clocks[index].playing {
                moved |= self.pose(index);
            }
        }
        moved
    }

    /// Moves nodes as one animation has them now; returns whether any has moved.
    fn pose(&mut self, index: usize) -> bool {
        let model = self.models.partition_point(|m| m.first_animation as usize <= index) - 1;
        let copies = self.models[model].copies.clone();
        self.pose_copies(model, index, &copies)
    }

    /// Moves the nodes of a new copy of a file as the file's animations have them, including paused
    /// ones.
    fn pose_new_copy(&mut self, model: usize, first_node: u32) {
        let first = self.models[model].first_animation as usize;
        let mut order: Vec<_> =
            (first..first + self.models[model].asset.animations.len()).collect();
        order.sort_by_key(|index| self.clocks[*index].set_by);
        for index in order {
            self.pose_copies(model, index, &[first_node]);
        }
        self.play();
    }

    fn pose_copies(&mut self, model: usize, index: usize, copies: &[u32]) -> bool {
        let Model { asset, first_animation, .. } = &self.models[model];
        let Some(animation) = asset.animations.get(index - *first_animation as usize) else {
            return false;
        };
        let time = self.clocks[index].position(self.time, animation.duration);
        let mut moved = false;
        for channel in &animation.channels {
            let value = channel.curve.sample(time);
            for first in copies {
                let id = NodeId(first.saturating_add(channel.node));
                let Some(node) = self.nodes.get_mut(id) else { continue };
                let trs = &mut node.parent_from_node;
                moved |= match channel.curve.property {
                    Property::Translation => {
                        set(&mut trs.translation, Vec3::from_slice(&value).as_dvec3())
                    }
                    Property::Scale => set(&mut trs.scale, Vec3::from_slice(&value)),
                    Property::Rotation => set(&mut trs.rotation, Quat::from_slice(&value)),
                    Property::Weights => set(&mut node.weights, value.clone()),
                };
            }
        }
        moved
    }
}

/// Sets a value; returns whether it changed.
fn set<T: PartialEq>(place: &mut T, value: T) -> bool {
    let is_new = *place != value;
    *place = value;
    is_new
}
