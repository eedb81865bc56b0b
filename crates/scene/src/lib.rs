//! Scenes as data: glTF and built-in scenes, their animation, and edits.
//!
//! A [`Scene`] is loaded once and changed by [`Edit`]s and by time. It gives [`Snapshot`]s: single
//! moments, flattened to placed instances and lights. A gatherer sees nothing else.
//!
//! Space is glTF's: right-handed, +Y up, metres. Colours are linear Rec. 709. Lights have the units
//! of KHR_lights_punctual (candela, lux); emission is a radiance in cd/m².
//!
//! The back face of a single-sided material blocks light, reflects none and emits none, wherever
//! light is computed. The winding after all transforms, mirroring ones included, tells which side
//! is the front.
//!
//! ```
//! use lumencast_scene::{Edit, NodeId, Scene, Transform};
//!
//! let mut scene = Scene::open("cornell")?;
//! let box_node = scene.nodes().find(|n| n.name == "tall box").map_or(NodeId(0), |n| n.id);
//! let transform = Transform { translation: Some([0.3, 0.0, -0.4].into()), ..Transform::default() };
//! scene.apply(&Edit::MoveNode { node: box_node, transform })?;
//! scene.advance(0.04);
//! let snapshot = scene.snapshot();
//! assert_eq!(snapshot.version, 2); // one edit, one step of the animation
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Loading is total: any bytes give a scene or an error that says where the fault lies. Sizes are
//! checked against limits before memory is allocated.

mod aabb;
mod animation;
mod asset;
mod builtin;
mod deform;
mod edit;
mod environment;
mod error;
mod gltf;
mod hdr;
mod light;
mod lightmap;
mod limits;
mod material;
mod mesh;
mod origin;
mod scene;
mod script;
mod settings;
mod snapshot;
#[cfg(test)]
mod tests;
mod trs;
mod view;
mod volume;

pub use aabb::Aabb;
pub use asset::{Camera, FileContents, Projection, SceneFile};
pub use builtin::NAMES as BUILTINS;
pub use deform::{Deformation, Pose};
pub use edit::{Edit, InstanceSource, LightSpec, MaterialChange, NodeName, Playback, Transform};
pub use environment::{Environment, HdrImage};
pub use error::{Fault, SceneError};
pub use gltf::source::file_name;
pub use light::{LightKind, PlacedLight, PunctualLight};
pub use lightmap::LightmapSpec;
pub use material::{AlphaMode, Filter, Image, Material, TextureRef, Wrap};
pub use mesh::{Mesh, MorphTarget, Primitive, Vertices};
pub use scene::{AnimationInfo, EditError, FileRead, FileToRead, NodeInfo, PlacedCamera, Scene};
pub use script::{Script, ScriptError};
pub use snapshot::{Instance, Snapshot};
pub use view::{NamedView, Rays, View};
pub use volume::VolumeSpec;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub u32);

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

id! {
    /// A node: its index in the glTF file, or the next free number where an edit added it. Numbers
    /// are never reused, so every replica of the scene agrees on them.
    NodeId
}
id! {
    /// A material: its index in the glTF file; materials of assets added later follow.
    MaterialId
}
id! {
    /// A mesh: its index in the glTF file; meshes of assets added later follow.
    MeshId
}
id! {
    /// An animation: its index in the glTF file; animations of assets added later follow.
    AnimationId
}
