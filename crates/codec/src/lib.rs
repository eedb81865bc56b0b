//! Light, scene state and catalogs as bytes: the frames of docs/wire.md.
//!
//! Sans-I/O: bytes in, values or a [`DecodeError`] out; nothing here opens a socket, reads a clock
//! or starts a thread. Decoders are total: no bytes make them panic or allocate more than
//! [`limits`] allow.

#![forbid(unsafe_code)]

mod bytes;
mod catalog;
mod encoded_region;
mod epoch;
mod error;
mod field_encoder;
mod field_info;
mod file;
mod frame_head;
mod lightmap_shape;
pub mod limits;
mod lumel;
mod probe;
mod range_coder;
mod resource;
mod state;
pub mod tracks;
mod update_info;
mod volume_shape;
mod volumes;

pub use catalog::{Catalog, SceneInfo};
pub use encoded_region::EncodedRegion;
pub use epoch::Epoch;
pub use error::DecodeError;
pub use field_encoder::FieldEncoder;
pub use field_info::{FieldInfo, Shape, UnknownField, Use};
pub use file::{LightFile, SavedFile, SavedFrame};
pub use frame_head::FrameHead;
pub use lightmap_shape::LightmapShape;
pub use lumel::{Coding, LumelCoding, LumelDecoder, LumelEncoder, LumelHeader, Tile, TileLight};
pub use lumencast_video::{Qp, VideoError};
pub use probe::{ProbeDecoder, ProbeEncoder, ProbeHeader, Region, RegionLight, regions};
pub use resource::{
    LayoutResource, PlacedSurface, Resource, ResourceHash, layout_resources, read_charts,
};
pub use state::{AcceptedEdit, ClientEdit, RefusedEdit, SceneState, StateFrame};
pub use tracks::LightTrack;
pub use update_info::UpdateInfo;
pub use volume_shape::{Basis, VolumeShape};
pub use volumes::{VolumesError, check_volumes};

/// The version of the wire format and of files, `lumencast` in a catalog.
pub const VERSION: u64 = 1;
