//! WGSL modules, put together into shaders, and the memory layouts that they share with Rust.
//!
//! A shader is the text of its modules one after the other ([`forward`], [`depth`], [`background`],
//! [`occlusion`]; before them [`deform`], and for what is done with a picture [`screen`], [`meter`]);
//! what they need of each other is told by their order here, since WGSL has no imports. Tests validate
//! every shader without a GPU, and compare every struct of [`layout`] with what the compiler makes of
//! its namesake.
//!
//! Bindings are grouped by lifetime: 0 the pass (its view, instances, and which of them it draws), 1
//! the frame's light (punctual lights, shadow maps, environment), 2 the fields, 3 the material.
//! Deforming and what is done with a picture have a group of their own.
//!
//! ```
//! use lumencast_shaders::{Shading, forward};
//!
//! let shader = forward(Shading::Samples);
//! assert!(shader.contains("fn solid_fragment"));
//! ```

#![forbid(unsafe_code)]

pub mod layout;

const COMMON: &str = include_str!("../wgsl/common.wgsl");
const VIEW: &str = include_str!("../wgsl/view.wgsl");
const ENVIRONMENT: &str = include_str!("../wgsl/environment.wgsl");
const LIGHT: &str = include_str!("../wgsl/light.wgsl");
const HARMONICS: &str = include_str!("../wgsl/harmonics.wgsl");
const FIELD: &str = include_str!("../wgsl/field.wgsl");
const BSDF: &str = include_str!("../wgsl/bsdf.wgsl");
const MATERIAL: &str = include_str!("../wgsl/material.wgsl");
const FORWARD: &str = include_str!("../wgsl/forward.wgsl");
const DEPTH: &str = include_str!("../wgsl/depth.wgsl");
const BACKGROUND: &str = include_str!("../wgsl/background.wgsl");
const OCCLUSION: &str = include_str!("../wgsl/occlusion.wgsl");
const TONE: &str = include_str!("../wgsl/tone.wgsl");
const SCREEN: &str = include_str!("../wgsl/screen.wgsl");
const METER: &str = include_str!("../wgsl/meter.wgsl");
const DEFORM: &str = include_str!("../wgsl/deform.wgsl");

/// How often a multisampled surface is shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Shading {
    /// Once a pixel; its samples differ in what covers them alone.
    #[default]
    Pixels,
    /// Once a sample, which smooths highlights and textures too and costs as many times as much.
    Samples,
}

/// Draws surfaces: `forward_vertex`; `solid_fragment` for those that cover all, `holed_fragment` for the
/// others.
pub fn forward(shading: Shading) -> String {
    let modules = [COMMON, VIEW, ENVIRONMENT, LIGHT, HARMONICS, FIELD, BSDF, MATERIAL].concat();
    let own = match shading {
        Shading::Pixels => FORWARD.to_owned(),
        Shading::Samples => FORWARD
            .replace("@interpolate(perspective, center)", "@interpolate(perspective, sample)")
            .replace("/*SAMPLE*/", "@builtin(sample_index) sample: u32,")
            // The samples of a pixel take turns of a pattern that together fill the circle.
            .replace("/*ITS TURN*/", " + 0.618034 * f32(sample)"),
    };
    modules + &own
}

/// Draws the depth that a light or a camera sees: `depth_vertex` alone for opaque surfaces (where there is
/// a picture, with `depth_fragment`); `masked_depth_vertex` and `masked_depth_fragment` for those with
/// holes. Depths of `depth_vertex` are those of `forward_vertex`, to the bit.
pub fn depth() -> String {
    // `Bsdf` for what `material.wgsl` returns.
    [COMMON, VIEW, BSDF, MATERIAL, DEPTH].concat()
}

/// Draws the environment where there is no surface: `background_vertex`, `background_fragment`.
pub fn background() -> String {
    [COMMON, VIEW, ENVIRONMENT, LIGHT, BACKGROUND].concat()
}

/// Deforms the vertices of a primitive: `deform_vertices`.
pub fn deform() -> String {
    [COMMON, DEFORM].concat()
}

/// Spherical harmonics alone, for those who compare them with their own.
pub fn harmonics() -> String {
    [COMMON, HARMONICS].concat()
}

/// Ambient occlusion in screen space: `occlusion_vertex`, `occlusion_fragment`, and `blur_fragment`.
pub fn occlusion() -> String {
    [COMMON, VIEW, OCCLUSION].concat()
}

/// Shows a picture as display codes: `screen_vertex`, `screen_fragment`.
pub fn screen() -> String {
    [COMMON, TONE, SCREEN].concat()
}

/// Counts how bright the pixels of a picture are: `meter`.
pub fn meter() -> String {
    [TONE, METER].concat()
}
