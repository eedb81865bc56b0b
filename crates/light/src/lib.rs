//! Light fields: what a server computes and a client shades with.
//!
//! A light field holds *indirect* light only: light of punctual lights after at least one surface,
//! and light of emissive surfaces and of the environment. Probes store the spherical-harmonic
//! coefficients of arriving radiance (cd/m²) in world axes; see [`LightField`] for the main use.

#![forbid(unsafe_code)]

mod atlas;
mod field;
mod sample;
mod scale;
pub mod sh;
mod volume;
pub mod zh;

pub use atlas::{Atlas, atlas_size, texels};
pub use field::LightField;
pub use sample::{Corners, Offset};
pub use scale::ScaleRule;
pub use sh::{Order, Sh};
pub use volume::{Grid, ProbeVolume, VolumeId};
