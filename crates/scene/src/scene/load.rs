//! Loads scenes from files.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;

use glam::Affine3A;

use super::capture::Deformations;
use super::nodes::{Node, Nodes, PlacedSkin};
use super::playback::Clock;
use super::shelf::{FoundModel, Shelf};
use super::{Model, Scene};
use crate::asset::{Asset, AssetNode};
use crate::builtin;
use crate::error::Fault;
use crate::gltf::{self, source::Folder};
use crate::limits::{Budget, Taken};
use crate::origin::{self, Lump};
use crate::settings::{self, Settings};
use crate::trs::{Trs, is_in_world};
use crate::{Environment, MaterialId, MeshId, NodeId, SceneError};

impl Scene {
    /// Opens a .gltf or .glb file or, where there is no file of that name, a built-in scene.
    ///
    /// # Errors
    /// Those of [`Scene::load`], and a name that is neither.
    pub fn open(name: &str) -> Result<Self, SceneError> {
        let path = Path::new(name);
        // A folder does not hide the built-in scene of the same name.
        if !path.is_file()
            && let Some(scene) = Self::builtin(name)
        {
            return Ok(scene);
        }
        if path.exists() {
            return Self::load(path);
        }
        Err(Fault::Unknown { builtins: builtin::NAMES.join(", ") }.of(path))
    }

    /// Loads a .gltf or .glb file. Files that it refers to, and those that edits add later, must be
    /// in its folder.
    ///
    /// # Errors
    /// The file cannot be read, is not valid glTF, requires an unknown extension, exceeds the
    /// limits, or has no triangles in its scene. The message says where, and what to do.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let budget = Budget::default();
        let read = || {
            let folder = Folder::of(path).map_err(Fault::Read)?;
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let asset = gltf::read_file(path, &name, &folder, &budget)?;
            Ok((name, folder, asset))
        };
        let (file, folder, asset) = read().map_err(|fault: Fault| fault.of(path))?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let taken = budget.taken();
        let mut scene = Self::of(short_name(&stem), file, (asset, taken), Some(folder));
        scene.check().map_err(|fault| fault.of(path))?;
        if let Some((settings_path, settings)) = settings::beside(path)? {
            scene.settle(settings).map_err(|fault| fault.of(settings_path))?;
        }
        let environment = scene.environment.clone();
        scene.light_by(environment).map_err(|fault| fault.of(path))?;
        Ok(scene)
    }

    /// Loads a scene from a .glb in memory that refers to no files.
    ///
    /// # Errors
    /// Those of [`Scene::load`].
    pub fn from_glb(name: &str, bytes: impl Into<Arc<[u8]>>) -> Result<Self, SceneError> {
        let file = format!("{name}.glb");
        let budget = Budget::default();
        let read = || {
            let asset = gltf::read_bytes(&file, bytes.into(), &budget)?;
            let taken = budget.taken();
            let mut scene = Self::of(short_name(name), file.clone(), (asset, taken), None);
            scene.check()?;
            let environment = scene.environment.clone();
            scene.light_by(environment)?;
            Ok(scene)
        };
        read().map_err(|fault: Fault| fault.of(&file))
    }

    /// A built-in scene, one of [`BUILTINS`](crate::BUILTINS).
    pub fn builtin(name: &str) -> Option<Self> {
        match Self::from_glb(name, builtin::glb(name)?) {
            Ok(scene) => Some(scene),
            Err(error) => {
                // Tests load all of them.
                tracing::error!(%error, "a built-in scene is broken");
                None
            }
        }
    }

    fn of(
        name: String,
        file: String,
        (asset, taken): (Asset, Taken),
        folder: Option<Folder>,
    ) -> Self {
        let asset = Arc::new(asset);
        let mut scene = Self::empty(name, folder);
        let mut said = BTreeSet::new();
        let warnings = asset.warnings.iter().filter(|warning| said.insert(*warning));
        scene.warnings = warnings.cloned().collect();
        scene.register(file, FoundModel { asset: asset.clone(), taken }, None);
        scene.place(0, 0);
        for root in &asset.roots {
            scene.nodes.add_root(NodeId(*root));
        }
        let Settings { environment, volumes, lightmap } = asset.settings.clone();
        scene.environment = environment.unwrap_or_default();
        scene.volumes = volumes;
        scene.lightmap = lightmap;
        scene.play();
        scene.choose_origin();
        scene
    }

    /// Makes transforms relative to the scene's own middle, and warns of the precision that is
    /// still lost.
    fn choose_origin(&mut self) {
        let mut boxes = HashMap::new();
        let mut lumps = Vec::new();
        for (_, node, place) in self.nodes.shown() {
            let Some(id) = node.mesh else { continue };
            let mesh = &self.meshes[id.0 as usize];
            let bounds = boxes.entry(id).or_insert_with(|| mesh.bounds());
            let lump = |place| match &node.skin {
                None => Lump::placed(bounds, &place),
                Some(skin) => self.lump_of_joints(skin),
            };
            let triangles = mesh.triangle_count();
            let placed = node.places(&place).map(|(_, place)| Lump { triangles, ..lump(place) });
            lumps.extend(placed.filter(|lump| lump.min.is_finite() && lump.max.is_finite()));
        }
        let origin = origin::of_scene(&lumps);
        self.nodes.set_origin(origin);
        self.warnings.extend(origin::warnings(&lumps, origin));
    }

    /// The box around a skin's joints, which place the mesh.
    fn lump_of_joints(&self, PlacedSkin { skin, first_node }: &PlacedSkin) -> Lump {
        let joints = skin.joints.iter().map(|(joint, _)| NodeId(first_node + joint));
        Lump::around(joints.map(|joint| self.nodes.place_of(joint).translation))
    }

    fn empty(name: String, folder: Option<Folder>) -> Self {
        Self {
            name,
            folder,
            volumes: Vec::new(),
            lightmap: None,
            warnings: Vec::new(),
            models: Vec::new(),
            library: BTreeMap::new(),
            pictures: BTreeMap::new(),
            shelf: Shelf::default(),
            nodes: Nodes::default(),
            meshes: Vec::new(),
            materials: Vec::new(),
            clocks: Vec::new(),
            environment: Environment::BLACK,
            environment_replaced: false,
            time: 0.0,
            version: 0,
            deformations: Deformations::default(),
            shared_materials: None,
            snapshot: None,
        }
    }

    fn check(&self) -> Result<(), Fault> {
        let drawn =
            |node: &Node| node.mesh.map_or(0, |m| self.meshes[m.0 as usize].triangle_count());
        let triangles: usize = self.nodes.shown().iter().map(|(_, node, _)| drawn(node)).sum();
        if triangles == 0 { Err(Fault::NoTriangles) } else { Ok(()) }
    }

    /// Applies the settings of the file beside the scene.
    fn settle(&mut self, settings: Settings) -> Result<(), Fault> {
        let Settings { environment, volumes, lightmap } = settings;
        if let Some(environment) = environment {
            self.light_by(environment)?;
            self.environment_replaced = true;
        }
        if !volumes.is_empty() {
            self.volumes = volumes;
        }
        self.lightmap = lightmap.or(self.lightmap);
        Ok(())
    }

    /// Sets an environment that the scene's files name; its picture is read first.
    fn light_by(&mut self, environment: Environment) -> Result<(), Fault> {
        self.read_now(self.picture_to_read(&environment));
        self.environment = self.with_picture(environment)?;
        Ok(())
    }

    /// Adds a file to the scene's models; it then counts as part of the scene.
    pub(super) fn take_model(
        &mut self,
        name: String,
        mut found: FoundModel,
        added_as: NodeId,
    ) -> usize {
        for warning in &found.asset.warnings {
            tracing::warn!("{name}: {warning}");
        }
        let first = self.materials.len() as u32;
        if found.asset.first_material != first {
            Arc::make_mut(&mut found.asset).number_materials(first);
        }
        self.register(name, found, Some(added_as))
    }

    /// Gives a file's meshes, materials and animations their numbers.
    fn register(
        &mut self,
        name: String,
        FoundModel { asset, taken }: FoundModel,
        added_as: Option<NodeId>,
    ) -> usize {
        let (first_mesh, first_animation) = (self.meshes.len() as u32, self.clocks.len() as u32);
        self.meshes.extend_from_slice(&asset.meshes);
        self.materials.extend_from_slice(&asset.materials);
        self.shared_materials = None;
        let clocks = std::iter::repeat_n(Clock::starting(self.time), asset.animations.len());
        self.clocks.extend(clocks);
        let copies = Vec::new();
        self.models.push(Model {
            name,
            asset,
            taken,
            first_mesh,
            first_animation,
            copies,
            added_as,
        });
        self.models.len() - 1
    }

    /// Inserts the nodes of a file, numbered from `first` on.
    pub(super) fn place(&mut self, model: usize, first: u32) {
        self.models[model].copies.push(first);
        let Model { asset, first_mesh, .. } = &self.models[model];
        let channels = asset.animations.iter().flat_map(|animation| &animation.channels);
        let animated: BTreeSet<u32> = channels.map(|channel| channel.node).collect();
        for (index, json) in (0..).zip(&asset.nodes) {
            let skin = json.skin.map(|skin| asset.skins[skin as usize].clone());
            let node = Node {
                name: json.name.clone(),
                parent: json.parent.map(|p| NodeId(first + p)),
                children: json.children.iter().map(|c| NodeId(first + c)).collect(),
                parent_from_node: json.parent_from_node,
                mesh: json.mesh.map(|m| MeshId(first_mesh + m)),
                instances: json.instances.clone(),
                skin: skin
                    .filter(|_| is_skinned(asset, json))
                    .map(|skin| PlacedSkin { skin, first_node: first }),
                light: json.light,
                camera: json.camera.map(|camera| (model, camera)),
                hidden: json.hidden,
                animated: animated.contains(&index),
                weights: weights(asset, json),
            };
            self.nodes.insert(NodeId(first + index), node);
        }
    }

    /// Inserts a copy of a file: a new node with `trs`, and below it the file's nodes. Numbers are
    /// consecutive.
    pub(super) fn place_below(
        &mut self,
        model: usize,
        id: NodeId,
        parent: Option<NodeId>,
        trs: Trs,
    ) {
        let first = id.0 + 1;
        let asset = self.models[model].asset.clone();
        let children: Vec<_> = asset.roots.iter().map(|root| NodeId(first + root)).collect();
        let name = self.models[model].name.clone();
        self.place(model, first);
        for child in &children {
            if let Some(node) = self.nodes.get_mut(*child) {
                node.parent = Some(id);
            }
        }
        let wrapper = Node { name, parent, children, parent_from_node: trs, ..Node::default() };
        self.nodes.attach(id, wrapper);
    }

    /// The scene as in its file, `time` seconds after its beginning, without reading anything
    /// again.
    #[must_use]
    pub fn pristine(&self, time: f64) -> Self {
        let main = &self.models[0];
        let mut scene = Self::empty(self.name.clone(), self.folder.clone());
        let known = |model: &Model| (model.name.clone(), (model.asset.clone(), model.taken));
        scene.library = self.models[1..].iter().map(known).collect();
        scene.pictures.clone_from(&self.pictures);
        let found = FoundModel { asset: main.asset.clone(), taken: main.taken };
        scene.register(main.name.clone(), found, None);
        scene.place(0, 0);
        main.asset.roots.iter().for_each(|root| scene.nodes.add_root(NodeId(*root)));
        let environment = main.asset.settings.environment.clone().unwrap_or_default();
        // The picture was loaded with the scene. Where another has replaced it, nobody asks for
        // this one.
        scene.environment = scene.with_picture(environment.clone()).unwrap_or(environment);
        scene.volumes.clone_from(&self.volumes);
        scene.lightmap = self.lightmap;
        scene.nodes.set_origin(self.nodes.origin());
        scene.time = time;
        scene.play();
        scene
    }
}

fn is_skinned(asset: &Asset, node: &AssetNode) -> bool {
    let mesh = node.mesh.map(|m| &asset.meshes[m as usize]);
    mesh.is_some_and(|mesh| mesh.primitives.iter().any(|p| !p.joints.is_empty()))
}

fn weights(asset: &Asset, node: &AssetNode) -> Vec<f32> {
    match node.mesh {
        Some(mesh) if node.weights.is_empty() => asset.meshes[mesh as usize].morph_weights.clone(),
        _ => node.weights.clone(),
    }
}

impl Asset {
    /// Number of nodes and instances.
    pub(super) fn size(&self) -> usize {
        let instances = self.nodes.iter().filter_map(|node| node.instances.as_ref());
        self.nodes.len() + instances.map(|instances| instances.len()).sum::<usize>()
    }

    /// Whether the transforms of all nodes are within the world when the roots have this transform.
    pub(super) fn fits(&self, world_from_roots: Affine3A) -> bool {
        let mut open: Vec<_> = self.roots.iter().map(|r| (*r, world_from_roots)).collect();
        while let Some((index, world_from_parent)) = open.pop() {
            let node = &self.nodes[index as usize];
            let world = world_from_parent * node.parent_from_node.affine();
            if !is_in_world(&world) {
                return false;
            }
            open.extend(node.children.iter().map(|child| (*child, world)));
        }
        true
    }

    /// Renumbers the materials of the meshes for a scene whose next number is `first`.
    fn number_materials(&mut self, first: u32) {
        for mesh in &mut self.meshes {
            for primitive in &mut Arc::make_mut(mesh).primitives {
                primitive.material = MaterialId(primitive.material.0 - self.first_material + first);
            }
        }
        self.first_material = first;
    }
}

/// A scene's name as part of an address, made from the file's stem.
fn short_name(stem: &str) -> String {
    let keep = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    let name: String = stem.to_ascii_lowercase().chars().map(keep).take(64).collect();
    if name.trim_matches(['.', '-']).is_empty() { "scene".into() } else { name }
}
