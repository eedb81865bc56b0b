//! What one glTF file holds, read and checked, before it is placed into a scene.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{Affine3A, DAffine3};

use crate::animation::Curve;
use crate::settings::Settings;
use crate::trs::Trs;
use crate::{Material, Mesh, PunctualLight};

/// A glTF file's contents. Indices (of nodes, meshes, …) are the file's own and lie in range.
#[derive(Clone, Debug, Default)]
pub(crate) struct Asset {
    pub(crate) nodes: Vec<AssetNode>,
    /// Nodes at the top of the file's scene.
    pub(crate) roots: Vec<u32>,
    pub(crate) meshes: Vec<Arc<Mesh>>,
    /// The file's materials, and the default material as the last.
    pub(crate) materials: Vec<Material>,
    /// What meshes add to these indices when they name materials: 0 in the file, and the number of
    /// the first of them in a scene.
    pub(crate) first_material: u32,
    pub(crate) skins: Vec<Arc<Skin>>,
    pub(crate) animations: Vec<Animation>,
    pub(crate) cameras: Vec<Camera>,
    /// From the scene's extras.
    pub(crate) settings: Settings,
    pub(crate) warnings: Vec<String>,
    /// The glTF file, and after it the buffers and images that it refers to.
    pub(crate) files: Vec<SceneFile>,
}

/// A node of a file.
#[derive(Clone, Debug, Default)]
pub(crate) struct AssetNode {
    pub(crate) name: String,
    pub(crate) parent: Option<u32>,
    pub(crate) children: Vec<u32>,
    pub(crate) parent_from_node: Trs,
    pub(crate) mesh: Option<u32>,
    /// Where the mesh is shown, relative to the node; once, at the node, where absent.
    pub(crate) instances: Option<Arc<[DAffine3]>>,
    pub(crate) skin: Option<u32>,
    pub(crate) camera: Option<u32>,
    pub(crate) light: Option<PunctualLight>,
    /// It and all below it are neither drawn nor give light.
    pub(crate) hidden: bool,
    /// Morph weights; the mesh's own where empty.
    pub(crate) weights: Vec<f32>,
}

/// Joints that deform a mesh.
#[derive(Debug)]
pub(crate) struct Skin {
    /// Nodes of the file, and what brings the mesh at rest into the space of each.
    pub(crate) joints: Vec<(u32, Affine3A)>,
}

/// Curves that move nodes.
#[derive(Clone, Debug)]
pub(crate) struct Animation {
    pub(crate) name: String,
    /// Seconds; time of the last key.
    pub(crate) duration: f64,
    pub(crate) channels: Vec<Channel>,
}

/// A curve and what it moves.
#[derive(Clone, Debug)]
pub(crate) struct Channel {
    pub(crate) node: u32,
    pub(crate) curve: Curve,
}

/// A camera of the file, looking along its node's −Z with +Y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name in the file.
    pub name: String,
    /// How it draws.
    pub projection: Projection,
}

/// A camera's projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Things far away are small.
    Perspective {
        /// Vertical field of view, radians, between 0 and π.
        yfov: f32,
        /// Width by height; the picture's own when absent.
        aspect_ratio: Option<f32>,
        /// Distance of the near plane, metres.
        near: f32,
        /// Distance of the far plane, metres; infinite when absent.
        far: Option<f32>,
    },
    /// Things far away are as large as near ones.
    Orthographic {
        /// Half the width of the view, metres.
        half_width: f32,
        /// Half its height, metres.
        half_height: f32,
        /// Distance of the near plane, metres.
        near: f32,
        /// Distance of the far plane, metres.
        far: f32,
    },
}

/// A file that clients need to draw the scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneFile {
    /// Path relative to the scene's folder, `/` between its parts, not percent-encoded.
    pub name: String,
    /// What is in it.
    pub contents: FileContents,
}

/// Contents of a [`SceneFile`].
#[derive(Clone, PartialEq, Eq)]
pub enum FileContents {
    /// A file on disk.
    Path(PathBuf),
    /// Bytes in memory (built-in scenes).
    Bytes(Arc<[u8]>),
}

impl std::fmt::Debug for FileContents {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Path(path) => f.debug_tuple("Path").field(path).finish(),
            Self::Bytes(bytes) => write!(f, "Bytes({} bytes)", bytes.len()),
        }
    }
}
