//! Light fields, scene state and catalogs as bytes: the frames of docs/wire.md.
//!
//! Sans-I/O: bytes in, values or a [`DecodeError`] out; nothing here opens a socket, reads a clock
//! or starts a thread. Decoders are total: no bytes make them panic or allocate more than
//! [`limits`] allow.

#![forbid(unsafe_code)]

mod bytes;
mod error;
pub mod limits;
mod probe;
mod range_coder;

pub use error::DecodeError;
pub use probe::{
    EncodedRegion, ProbeDecoder, ProbeEncoder, ProbeHeader, Region, RegionLight, UpdateInfo,
    regions,
};

/// The version of the wire format and of files, `lumencast` in a catalog.
pub const VERSION: u64 = 1;
