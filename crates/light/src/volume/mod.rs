//! Probe volumes: spherical-harmonic probes at the cell centres of an oriented box.

mod atlas;
mod grid;
mod offset;
mod probes;
mod sample;

pub use atlas::{Atlas, atlas_size, texels};
pub use grid::Grid;
pub use offset::Offset;
pub use probes::ProbeVolume;
pub use sample::Corners;
