//! The checked contents of a glTF file, before they are placed into a scene.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{Affine3A, DAffine3};

use crate::animation::Curve;
use crate::settings::Settings;
use crate::trs::Trs;
use crate::{Material, Mesh, PunctualLight};

/// A glTF file's contents. Indices (of nodes, meshes, …) are the file's own and are in range.
#[derive(Clone, Debug, Default)]
pub(crate) struct Asset {
    pub(crate) nodes: Vec<AssetNode>,
    /// Root nodes of the file's scene.
    pub(crate) roots: Vec<u32>,
    pub(crate) meshes: Vec<Arc<Mesh>>,
    /// The file's materials, followed by the default material.
    pub(crate) materials: Vec<Material>,
    /// Added to the file's material indices in `meshes`. It is 0 in the file, and the number of the
    /// file's first material in a scene.
    pub(crate) first_material: u32,
    pub(crate) skins: Vec<Arc<Skin>>,
    pub(crate) animations: Vec<Animation>,
    pub(crate) cameras: Vec<Camera>,
    /// Settings from the scene's extras.
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
    /// Transforms at which the mesh is shown, relative to the node. Where absent, it is shown once,
    /// at the node.
    pub(crate) instances: Option<Arc<[DAffine3]>>,
    pub(crate) skin: Option<u32>,
    pub(crate) camera: Option<u32>,
    pub(crate) light: Option<PunctualLight>,
    /// Whether the node and all below it are hidden: neither drawn nor giving light.
    pub(crate) hidden: bool,
    /// Morph weights; the mesh's own where empty.
    pub(crate) weights: Vec<f32>,
}

/// Joints that deform a mesh.
#[derive(Debug)]
pub(crate) struct Skin {
    /// Each joint's node in the file, and the transform from the mesh at rest to the joint's space.
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

/// A curve and the node that it moves.
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
    /// Its projection.
    pub projection: Projection,
}

/// A camera's projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Perspective: things far away look small.
    Perspective {
        /// Vertical field of view, radians, between 0 and π.
        yfov: f32,
        /// Width by height; `None` takes the picture's own.
        aspect_ratio: Option<f32>,
        /// Distance of the near plane, metres.
        near: f32,
        /// Distance of the far plane, metres; infinite when absent.
        far: Option<f32>,
    },
    /// Orthographic: things far away look as large as near ones.
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
    /// Path relative to the scene's folder, with `/` between its parts and without
    /// percent-encoding.
    pub name: String,
    /// The file's contents.
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
