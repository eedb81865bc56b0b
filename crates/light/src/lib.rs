//! Light: what a server computes and a client shades with.
//!
//! [`Light`] is all that is known of a scene's *indirect* light: light of punctual lights after at
//! least one surface, and light of emissive surfaces and of the environment. It consists of fields,
//! each of a kind ([`Field`]). Probes store the spherical-harmonic coefficients of arriving radiance
//! (cd/m²) in world axes. See [`Light`] for the main use.

#![forbid(unsafe_code)]

mod field;
mod field_id;
mod light;
mod lightmap;
mod luminance;
mod place;
mod scale;
pub mod sh;
mod volume;
pub mod zh;

pub use field::Field;
pub use field_id::FieldId;
pub use light::Light;
pub use lightmap::{
    ChartVertex, Charts, Layout, Lightmap, LumelAges, Rectangle, STEEPEST, Surface, SurfaceId,
    TILT, Told, slope, slope_by, tilted,
};
pub use luminance::luminance;
pub use place::{OnTriangle, Place};
pub use scale::ScaleRule;
pub use sh::{Order, Sh};
pub use volume::{Atlas, Corners, Grid, Offset, ProbeVolume, atlas_size, texels};
