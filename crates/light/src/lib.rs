//! Light fields: what a server computes and a client shades with.
//!
//! A light field holds *indirect* light only: light of punctual lights after at least one surface,
//! and light of emissive surfaces and of the environment. Probes store the spherical-harmonic
//! coefficients of arriving radiance (cd/m²) in world axes.

mod scale;
pub mod sh;
mod volume;

pub use scale::ScaleRule;
pub use sh::Order;
pub use volume::{Grid, ProbeVolume, VolumeId};
