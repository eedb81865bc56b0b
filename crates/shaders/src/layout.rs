//! Structs as the shaders have them in memory: names, order and offsets are those of their namesakes
//! in WGSL (`crates/shaders/wgsl`), where the fields are explained. A test compares them.

#![expect(missing_docs, reason = "fields are explained where the shaders declare them")]

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Mat4, Vec2, Vec3, Vec4};

/// A row-major affine transform.
pub type Rows = [Vec4; 3];

/// The rows of a transform.
pub fn rows(transform: &Affine3A) -> Rows {
    let linear = transform.matrix3.transpose();
    let t = transform.translation;
    [linear.x_axis.extend(t.x), linear.y_axis.extend(t.y), linear.z_axis.extend(t.z)]
}

/// From where a pass looks. Group 0, binding 0, by dynamic offset.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct View {
    pub clip_from_world: Mat4,
    pub world_from_clip: Mat4,
    pub view_from_clip: Mat4,
    pub eye: Vec3,
    pub perspective: f32,
    pub forward: Vec3,
    pub turn: f32,
}

/// A placed mesh. Group 0, binding 1.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Instance {
    pub world_from_object: Rows,
    pub normal_from_object: Rows,
    pub mirrors: u32,
    pub lumels: u32,
    pub still: u32,
    pub _pad0: u32,
}

/// A rectangle of lumels. Group 0, binding 3.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Rectangle {
    pub corner: Vec2,
    pub layer: u32,
    pub share: f32,
    pub slopes: u32,
    pub _pad0: u32,
}

/// What holds for all of a frame's passes. Group 1, binding 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Frame {
    pub light_count: u32,
    pub parts: u32,
    pub filter_samples: u32,
    pub search_samples: u32,
    pub pre_exposure: f32,
    pub sample_count: u32,
    pub filter_radius: f32,
    pub frame: u32,
    pub occlusion_radius: f32,
    pub still: f32,
    pub moving: f32,
    pub look: u32,
}

/// Light from afar. Group 1, binding 1.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Environment {
    pub zenith: Vec3,
    pub kind: u32,
    pub ground: Vec3,
    pub turn: f32,
    pub horizon: Vec3,
    pub _pad: u32,
}

/// A punctual light. Group 1, binding 3.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PunctualLight {
    pub position: Vec3,
    pub kind: u32,
    pub direction: Vec3,
    pub size: f32,
    pub intensity: Vec3,
    pub window: f32,
    pub cone_scale: f32,
    pub cone_offset: f32,
    pub first_shadow: u32,
    pub shadow_count: u32,
}

/// A layer of the shadow maps. Group 1, binding 4.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ShadowView {
    pub clip_from_world: Mat4,
    pub texel: f32,
    pub near: f32,
    pub depth_range: f32,
    pub search: f32,
    pub reach: Vec2,
    pub _pad0: f32,
    pub _pad1: f32,
}

/// How many volumes there are, and how pages of lumels are stored. Group 2, binding 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Fields {
    pub count: u32,
    pub lumel_scale: f32,
    pub age_side: u32,
    pub age_columns: u32,
}

/// `NO_LUMELS` of the shaders.
pub const NO_LUMELS: u32 = u32::MAX;

/// A probe volume in the atlas. Group 2, binding 1.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Volume {
    pub cell_from_world: Rows,
    pub spacing: Vec3,
    pub scale: f32,
    pub resolution: Vec3,
    pub texels: u32,
    pub origin: Vec3,
    pub _pad0: f32,
    pub offset: Vec3,
    pub _pad1: f32,
}

/// How a texture is looked up.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Map {
    pub row0: Vec4,
    pub row1: Vec4,
}

/// A material. Group 3, binding 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Material {
    pub base_color: Vec4,
    pub emissive: Vec3,
    pub metallic: f32,
    pub specular_color: Vec3,
    pub roughness: f32,
    pub transmission: f32,
    pub ior: f32,
    pub specular: f32,
    pub normal_scale: f32,
    pub occlusion_strength: f32,
    pub cutoff: f32,
    pub flags: u32,
    pub _pad: u32,
    pub base_color_map: Map,
    pub metallic_roughness_map: Map,
    pub normal_map: Map,
    pub emissive_map: Map,
    pub specular_map: Map,
    pub specular_color_map: Map,
    pub transmission_map: Map,
    pub occlusion_map: Map,
}

/// How a primitive is deformed. Group 0, binding 0 of [`crate::deform`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Deform {
    pub vertices: u32,
    pub morphs: u32,
    pub joints: u32,
    pub influences: u32,
    pub flags: u32,
}

/// Four of the joints that a vertex hangs on. Group 0, binding 2 of [`crate::deform`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Influence {
    pub weights: Vec4,
    pub joints: [u32; 2],
    pub _pad: [u32; 2],
}

/// A morph target that displaces. Group 0, binding 4 of [`crate::deform`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Morph {
    pub number: u32,
    pub weight: f32,
}

/// Bits of [`Deform::flags`].
pub mod deform {
    /// By joints.
    pub const SKINNED: u32 = 1;
    /// Each triangle has its own normal.
    pub const FLAT: u32 = 2;
}

/// Ambient occlusion. Group 1, binding 0 of [`crate::occlusion`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Occlusion {
    pub radius: f32,
    pub directions: u32,
    pub steps: u32,
    pub _pad: u32,
}

/// How a picture is shown. Group 0, binding 0 of [`crate::screen`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Screen {
    pub factor: f32,
    pub tone_map: u32,
    pub step: f32,
    pub _pad: u32,
}

/// Numbers of [`Screen::tone_map`].
pub mod tone {
    /// `TONE_GAMMA` of the shader, and so on.
    pub const GAMMA: u32 = 0;
    /// `TONE_SRGB`.
    pub const SRGB: u32 = 1;
    /// `TONE_REINHARD`.
    pub const REINHARD: u32 = 2;
    /// `TONE_FILMIC`.
    pub const FILMIC: u32 = 3;
    /// `TONE_NEUTRAL`.
    pub const NEUTRAL: u32 = 4;
}

/// The bins of [`crate::meter`].
pub mod meter {
    /// How many.
    pub const BINS: usize = 512;
    /// Bin 1 begins at 2 to the power of this; bin 0 holds what is darker.
    pub const LEAST: f32 = -24.0;
    /// Bins that double the luminance.
    pub const BINS_A_STOP: f32 = 12.0;
}

/// Bits of [`Frame::parts`].
pub mod parts {
    /// Emission and environment, as the camera sees them.
    pub const EMISSION: u32 = 1;
    /// Light of punctual lights scattered once.
    pub const DIRECT: u32 = 2;
    /// Light of the field.
    pub const INDIRECT: u32 = 4;
}

/// Numbers of [`Frame::look`].
pub mod look {
    /// `LOOK_LIGHT` of the shader, and so on.
    pub const LIGHT: u32 = 0;
    /// `LOOK_LUMELS`.
    pub const LUMELS: u32 = 1;
    /// `LOOK_AGE`.
    pub const AGE: u32 = 2;
}

/// Values of [`PunctualLight::kind`].
pub mod light {
    /// Shines in all directions.
    pub const POINT: u32 = 0;
    /// Shines within a cone.
    pub const SPOT: u32 = 1;
    /// Shines from afar.
    pub const DIRECTIONAL: u32 = 2;
}

/// Bits of [`Material::flags`].
pub mod material {
    /// Both sides scatter.
    pub const DOUBLE_SIDED: u32 = 1;
    /// Base colour is shown as it is.
    pub const UNLIT: u32 = 2;
    /// Covers by its opacity.
    pub const BLEND: u32 = 4;
    /// Opaque, two-sided, Lambert, emitting from the front only.
    pub const LAMBERT: u32 = 8;
}
