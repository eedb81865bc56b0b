//! WGSL modules that import each other, shaders made of them, and the memory layouts that they share
//! with Rust.
//!
//! Modules lie in folders by what they are for: `common` (mathematics and light that every stage
//! shares), `surface` (materials, and what they do with light), `field` (probe volumes) and `shade` (the
//! renderer). A module names those that it needs in lines such as `#import common/math`; [`assemble`]
//! puts them before a source of one's own.
//!
//! Functions stand apart from bindings. Modules named `bindings` or `…_bindings` declare what a group
//! binds, one module for each lifetime: group 0 the pass (its view, instances, and which of them it
//! draws), 1 the frame (punctual lights, shadow maps, environment), 2 the fields, 3 the material.
//! Deforming and what is done with a picture have groups of their own. All of `common`, and what else
//! imports no bindings, is for fragment and compute shaders alike. So is `field/light`, wherever group 2
//! is the fields. What takes derivatives, as textures with mips do, only fragment shaders import.
//!
//! Tests validate every shader without a GPU, and compare every struct of [`layout`] with what the
//! compiler makes of its namesake.
//!
//! ```
//! use lumencast_shaders::{Shading, assemble, forward};
//!
//! let shader = forward(Shading::Samples);
//! assert!(shader.contains("fn solid_fragment"));
//!
//! let own = assemble("#import common/math\nconst HALF_PI: f32 = 0.5 * PI;\n")?;
//! assert!(own.contains("const PI"));
//! # Ok::<(), lumencast_shaders::ImportError>(())
//! ```

#![forbid(unsafe_code)]

mod assemble;
pub mod layout;

pub use assemble::ImportError;
use assemble::Modules;

macro_rules! modules {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../wgsl/", $name, ".wgsl")))),*]
    };
}

/// The names and texts of all modules. `shade/sampling`, which `shade/forward` imports, is one of
/// `shade/by_pixels` and `shade/by_samples`: see [`forward`].
pub const MODULES: [(&str, &str); 39] = modules![
    "common/environment",
    "common/harmonics",
    "common/math",
    "common/punctual",
    "common/tone",
    "common/triangle",
    "field/bindings",
    "field/light",
    "field/volume",
    "shade/ambient",
    "shade/background",
    "shade/by_pixels",
    "shade/by_samples",
    "shade/depth",
    "shade/direct",
    "shade/forward",
    "shade/frame",
    "shade/frame_bindings",
    "shade/indirect",
    "shade/look",
    "shade/lumels",
    "shade/meter",
    "shade/meter_bindings",
    "shade/occlusion",
    "shade/occlusion_bindings",
    "shade/pages",
    "shade/pass_bindings",
    "shade/screen",
    "shade/screen_bindings",
    "shade/shadows",
    "shade/sight",
    "shade/view",
    "surface/bindings",
    "surface/bsdf",
    "surface/deform",
    "surface/deform_bindings",
    "surface/material",
    "surface/site",
    "surface/textures",
];

/// How often a multisampled surface is shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Shading {
    /// Once a pixel; its samples differ in what covers them alone.
    #[default]
    Pixels,
    /// Once a sample, which smooths highlights and textures too and costs as many times as much.
    Samples,
}

/// A source after the modules that it imports.
///
/// # Errors
/// Where it imports what is no module.
pub fn assemble(source: &str) -> Result<String, ImportError> {
    Modules(MODULES.to_vec()).assemble(source)
}

/// The shader whose entry points a module has.
fn shader(module: &str) -> String {
    shader_of(Modules(MODULES.to_vec()), module)
}

fn shader_of(modules: Modules<'_>, module: &str) -> String {
    let shader = modules.assemble(&format!("#import {module}\n"));
    shader.expect("our modules import modules, and no circles: a test assembles each")
}

/// Draws surfaces: `forward_vertex`; `solid_fragment` for those that cover all, `holed_fragment` for the
/// others.
pub fn forward(shading: Shading) -> String {
    let sampling = match shading {
        Shading::Pixels => "shade/by_pixels",
        Shading::Samples => "shade/by_samples",
    };
    let chosen = MODULES.into_iter().find(|(name, _)| *name == sampling);
    let sampling = chosen.map(|(_, text)| ("shade/sampling", text));
    shader_of(Modules(MODULES.into_iter().chain(sampling).collect()), "shade/forward")
}

/// Draws the depth that a light or a camera sees: `depth_vertex` alone for opaque surfaces (where there is
/// a picture, with `depth_fragment`); `masked_depth_vertex` and `masked_depth_fragment` for those with
/// holes. Depths of `depth_vertex` are those of `forward_vertex`, to the bit.
pub fn depth() -> String {
    shader("shade/depth")
}

/// Draws the environment where there is no surface: `background_vertex`, `background_fragment`.
pub fn background() -> String {
    shader("shade/background")
}

/// Draws pages of lumels before a picture: `pages_vertex`, `pages_fragment`.
pub fn pages() -> String {
    shader("shade/pages")
}

/// Deforms the vertices of a primitive: `deform_vertices`.
pub fn deform() -> String {
    shader("surface/deform")
}

/// Ambient occlusion in screen space: `occlusion_vertex`, `occlusion_fragment`, and `blur_fragment`.
pub fn occlusion() -> String {
    shader("shade/occlusion")
}

/// Shows a picture as display codes: `screen_vertex`, `screen_fragment`.
pub fn screen() -> String {
    shader("shade/screen")
}

/// Counts how bright the pixels of a picture are: `meter`.
pub fn meter() -> String {
    shader("shade/meter")
}
