//! Edits: changes of a scene as plain data, the same in scripts, on the wire and in programs.

use glam::{Quat, Vec3, Vec4};
use serde::{Deserialize, Serialize};

use crate::{AnimationId, Environment, MaterialId, MeshId, NodeId, PunctualLight};

/// A change of the scene. Edits are applied whole or refused with a reason, in the server's order.
///
/// In JSON an edit is an object whose `edit` names it: `{"edit":"move_node","node":3,"translation":[0,1,0]}`.
/// Fields left out stay as they are. Where an edit creates a node, the client leaves `node` out; the
/// server fills it in before it passes the edit on, so that all replicas agree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "edit", rename_all = "snake_case")]
pub enum Edit {
    /// Sets parts of a node's transform relative to its parent.
    MoveNode {
        /// The node.
        node: NodeId,
        /// What to set.
        #[serde(flatten)]
        transform: Transform,
    },
    /// Adds a node that shows a mesh of this scene or another glTF file.
    AddInstance {
        /// Filled in by the server: the first node added (a file's nodes take consecutive numbers).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        node: Option<NodeId>,
        /// Its name, by which programs find it again.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<NodeName>,
        /// What to show.
        source: InstanceSource,
        /// Under which node; the scene's root when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parent: Option<NodeId>,
        /// Where, relative to the parent.
        #[serde(default)]
        transform: Transform,
    },
    /// Removes a node with all below it.
    RemoveNode {
        /// The node.
        node: NodeId,
    },
    /// Adds a node that carries a light.
    AddLight {
        /// Filled in by the server.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        node: Option<NodeId>,
        /// Its name, by which programs find it again.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<NodeName>,
        /// The light.
        light: PunctualLight,
        /// Under which node; the scene's root when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parent: Option<NodeId>,
        /// Where, relative to the parent.
        #[serde(default)]
        transform: Transform,
    },
    /// Changes the light of a node.
    SetLight {
        /// The node that carries it.
        node: NodeId,
        /// What to set.
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
        /// What to set.
        #[serde(flatten)]
        change: MaterialChange,
    },
    /// Plays, pauses or seeks an animation.
    SetAnimation {
        /// The animation.
        animation: AnimationId,
        /// What to set.
        #[serde(flatten)]
        playback: Playback,
    },
    /// Replaces the environment.
    SetEnvironment {
        /// The new one.
        environment: Environment,
    },
}

impl Edit {
    /// The file that it names, as it writes it.
    pub fn file(&self) -> Option<&str> {
        match self {
            Self::AddInstance { source: InstanceSource::File(uri), .. }
            | Self::SetEnvironment { environment: Environment::Image { uri, .. } } => Some(uri),
            _ => None,
        }
    }
}

/// The name of a node that an edit adds: 1 to 64 bytes of text without control characters.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct NodeName(String);

impl NodeName {
    /// A name, if the text can be one.
    pub fn new(text: impl Into<String>) -> Option<Self> {
        let text = text.into();
        let is_sound = (1..=64).contains(&text.len()) && !text.chars().any(char::is_control);
        is_sound.then_some(Self(text))
    }

    /// As text.
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
    /// Factors along the node's axes, none of them zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<Vec3>,
}

/// Where an added instance's mesh comes from.
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
    /// Candela or lux.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intensity: Option<f32>,
    /// Metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<f32>,
    /// Spot lights only: half-angle where falloff begins, radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inner: Option<f32>,
    /// Spot lights only: half-angle where the light ends, radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outer: Option<f32>,
    /// Point and spot lights only: of the sphere that shines, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f32>,
    /// Directional lights only: angle that the shining disc spans, radians.
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
    /// Finite; below 0 turns the normal map's x and y around.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_scale: Option<f32>,
    /// Masked materials only: 0 or more; above 1 nothing is covered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha_cutoff: Option<f32>,
}

/// Playback of an animation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Playback {
    /// Runs or stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub playing: Option<bool>,
    /// Jumps to this time of the animation, seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// Rate, 1 unless set; negative runs backwards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
}
