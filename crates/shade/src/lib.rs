//! The reference client: a forward renderer that draws direct light itself and takes indirect light
//! from fields (chapter 4.2 of the second paper). It is what one copies from to bring
//! Lumencast to another engine, and the instrument that measures its quality.
//!
//! A [`Renderer`] is given a scene's [`Snapshot`](lumencast_scene::Snapshot) and a
//! [`Light`](lumencast_light::Light) and draws [`View`](lumencast_scene::View)s of them, on
//! any adapter that wgpu knows, also without a window. Radiance is cd/m² throughout; before it is
//! stored in half floats it is multiplied by one pre-exposure.
//!
//! Direct light has the materials of the path tracer (the shaders are twins of `gather::bsdf`),
//! shadows come from shadow maps. Indirect light is the field's, trilinearly filtered: diffuse by
//! convolution with its lobe, specular by the split sum with a lobe round about its mean direction
//! (`environment_brdf`), where the second paper's appendix A has a fitted one about the mirrored
//! direction; what probes are too sparse for, [`Occlusion`] of short range can take away from it. The
//! shaders are in `lumencast-shaders`.

#![forbid(unsafe_code)]

mod ages;
mod camera;
mod charted;
mod deform;
mod draw;
mod drawn;
mod environment_brdf;
mod error;
mod field;
mod frame;
mod geometry;
mod lights;
mod lumels;
mod materials;
mod meter;
mod occlusion;
mod pages;
mod part;
mod passes;
mod pipelines;
mod renderer;
mod scene;
mod screen;
mod settings;
mod shadows;
mod target;
mod textures;
mod timing;

pub use drawn::Drawn;
pub use environment_brdf::{Reflected, environment_brdf, reflected};
pub use error::ShadeError;
pub use lumencast_gpu::{Abilities, Gpu, GpuError};
pub use renderer::Renderer;
pub use screen::{Measured, Screen, Show};
pub use settings::{
    Lighting, LumelLook, Materials, Occlusion, Settings, Shading, Shadows, Strengths, Transparency,
};
pub use timing::PassTimes;
pub use wgpu;
