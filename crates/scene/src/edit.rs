//! Edits: changes of a scene as plain data. Scripts, the wire and programs use the same ones.

use glam::{Quat, Vec3, Vec4};
use serde::{Deserialize, Serialize};

use crate::{AnimationId, Environment, MaterialId, MeshId, NodeId, PunctualLight};

/// A change of the scene. The server applies edits in its order, each wholly, or refuses it with a
/// reason.
///
/// In JSON an edit is an object whose `edit` names it:
/// `{"edit":"move_node","node":3,"translation":[0,1,0]}`. Absent fields stay unchanged. Where an
/// edit creates a node, the client leaves `node` out. The server fills it in before it passes the
/// edit on, so that all replicas agree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "edit", rename_all = "snake_case")]
pub enum Edit {
    /// Sets parts of a node's transform relative to its parent.
    MoveNode {
        /// The node.
        node: NodeId,
        /// The new values; absent ones stay unchanged.
        #[serde(flatten)]
        transform: Transform,
    },
    /// Adds a node that shows a mesh of this scene or another glTF file.
    AddInstance {
        /// Filled in by the server: the first node added. A file's nodes take consecutive numbers.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        node: Option<NodeId>,
        /// Name of the node, by which programs find it again.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<NodeName>,
        /// The mesh or file to show.
        source: InstanceSource,
        /// Parent node; the scene's root when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parent: Option<NodeId>,
        /// Transform relative to the parent.
        #[serde(default)]
        transform: Transform,
    },
    /// Removes a node and all nodes below it.
    RemoveNode {
        /// The node.
        node: NodeId,
    },
    /// Adds a node that carries a light.
    AddLight {
        /// Filled in by the server.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        node: Option<NodeId>,
        /// Name of the node, by which programs find it again.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<NodeName>,
        /// The light.
        light: PunctualLight,
        /// Parent node; the scene's root when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parent: Option<NodeId>,
        /// Transform relative to the parent.
        #[serde(default)]
        transform: Transform,
    },
    /// Changes the light of a node.
    SetLight {
        /// The node that carries it.
        node: NodeId,
        /// The new values; absent ones stay unchanged.
        #[serde(flatten)]
        light: LightSpec,
    },
    /// Removes the light of a node; the node stays.
    RemoveLight {
        /// The node that carries it.
        node: NodeId,
    },
    /// Changes factors of a material.
    SetMaterial {
        /// The material.
        material: MaterialId,
        /// The new values; absent ones stay unchanged.
        #[serde(flatten)]
        change: MaterialChange,
    },
    /// Plays, pauses or seeks an animation.
    SetAnimation {
        /// The animation.
        animation: AnimationId,
        /// The new values; absent ones stay unchanged.
        #[serde(flatten)]
        playback: Playback,
    },
    /// Replaces the environment.
    SetEnvironment {
        /// The new environment.
        environment: Environment,
    },
}

impl Edit {
    /// The URI of the file that the edit names, as written in the edit.
    pub fn file(&self) -> Option<&str> {
        match self {
            Self::AddInstance { source: InstanceSource::File(uri), .. }
            | Self::SetEnvironment { environment: Environment::Image { uri, .. } } => Some(uri),
            _ => None,
        }
    }
}

/// Name of a node that an edit adds: 1 to 64 bytes of text without control characters.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct NodeName(String);

impl NodeName {
    /// A name; `None` where the text cannot be one.
    pub fn new(text: impl Into<String>) -> Option<Self> {
        let text = text.into();
        let is_sound = (1..=64).contains(&text.len()) && !text.chars().any(char::is_control);
        is_sound.then_some(Self(text))
    }

    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for NodeName {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        Self::new(text).ok_or("a name has 1 to 64 bytes and no control characters")
    }
}

impl From<NodeName> for String {
    fn from(name: NodeName) -> Self {
        name.0
    }
}

/// Parts of a local transform: parent_from_node = translation · rotation · scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transform {
    /// Metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translation: Option<Vec3>,
    /// Quaternion x, y, z, w; normalised when applied, refused when its length is near zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<Quat>,
    /// Factors along the node's axes, none of which may be zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<Vec3>,
}

/// Source of an added instance's mesh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InstanceSource {
    /// A mesh of the scene.
    Mesh(MeshId),
    /// A glTF file, relative to the scene's folder, that the server may read.
    File(String),
}

/// Parts of a light; see [`PunctualLight`] for units and ranges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LightSpec {
    /// Linear colour.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<Vec3>,
    /// Candela, or lux for directional lights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intensity: Option<f32>,
    /// Distance in metres at which the light ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<f32>,
    /// Spot lights only: half-angle where falloff begins, radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inner: Option<f32>,
    /// Spot lights only: half-angle where the light ends, radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outer: Option<f32>,
    /// Point and spot lights only: radius of the luminous sphere, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f32>,
    /// Directional lights only: angular diameter of the luminous disc, radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<f32>,
}

/// Factors of a material; see [`crate::Material`] for units and ranges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MaterialChange {
    /// Linear base colour and opacity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_color: Option<Vec4>,
    /// 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metallic: Option<f32>,
    /// 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness: Option<f32>,
    /// Emitted radiance, cd/m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub emissive: Option<Vec3>,
    /// 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transmission: Option<f32>,
    /// Index of refraction, 1 or more; 0 means infinite.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ior: Option<f32>,
    /// 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specular: Option<f32>,
    /// Linear, each channel 0 to 10⁹.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specular_color: Option<Vec3>,
    /// Finite; a negative value flips the normal map's x and y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_scale: Option<f32>,
    /// Masked materials only: 0 or more; above 1 the whole surface is a hole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha_cutoff: Option<f32>,
}

/// Playback of an animation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Playback {
    /// Whether the animation runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub playing: Option<bool>,
    /// Seconds of the animation to jump to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// Rate of playback, 1 unless set; negative runs backwards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
}
