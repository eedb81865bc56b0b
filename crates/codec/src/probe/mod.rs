//! Probe frames: one region of one field at one update (docs/wire.md, "Probe frames").

mod decoder;
mod encoder;
mod header;
mod model;
mod quantise;
mod regions;

pub use decoder::{ProbeDecoder, RegionLight};
pub use encoder::ProbeEncoder;
pub use header::ProbeHeader;
pub use regions::{Region, regions};
