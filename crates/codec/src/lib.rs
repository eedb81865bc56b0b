//! Light, scene state and catalogs as bytes: the frames of docs/wire.md.
//!
//! Sans-I/O: bytes in, values or a [`DecodeError`] out; nothing here opens a socket, reads a clock
//! or starts a thread. Decoders are total: no bytes make them panic or allocate more than
//! [`limits`] allow.

#![forbid(unsafe_code)]

mod bytes;
mod catalog;
mod epoch;
mod error;
mod field_encoder;
mod field_info;
mod file;
pub mod limits;
mod probe;
mod range_coder;
mod state;
pub mod tracks;
mod volume_shape;
mod volumes;

pub use catalog::{Catalog, SceneInfo};
pub use epoch::Epoch;
pub use error::DecodeError;
pub use field_encoder::FieldEncoder;
pub use field_info::{FieldInfo, Shape, UnknownField, Use};
pub use file::{LightFile, SavedFile, SavedFrame};
pub use probe::{
    EncodedRegion, ProbeDecoder, ProbeEncoder, ProbeHeader, Region, RegionLight, UpdateInfo,
    regions,
};
pub use state::{AcceptedEdit, ClientEdit, RefusedEdit, SceneState, StateFrame};
pub use tracks::LightTrack;
pub use volume_shape::{Basis, VolumeShape};
pub use volumes::{VolumesError, check_volumes};

/// The version of the wire format and of files, `lumencast` in a catalog.
pub const VERSION: u64 = 1;
