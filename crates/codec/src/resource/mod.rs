//! Resources: bytes that are named by what they are (docs/wire.md, "Resources").

mod charts;
mod hash;
mod layout;

pub use charts::read_charts;
pub use hash::ResourceHash;
pub use layout::{LayoutResource, PlacedSurface, layout_resources};

use crate::bytes::Reader;
use crate::{DecodeError, limits};

/// Bytes with their name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Resource {
    hash: ResourceHash,
    bytes: Vec<u8>,
}

impl Resource {
    /// Names bytes.
    pub fn new(bytes: Vec<u8>) -> Self {
        Self { hash: ResourceHash::of(&bytes), bytes }
    }

    /// Its name.
    pub fn hash(&self) -> ResourceHash {
        self.hash
    }

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Its bytes, to keep them.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

/// Reads a resource after its version.
fn reader(bytes: &[u8], known: u64) -> Result<Reader<'_>, DecodeError> {
    DecodeError::limit("bytes of a resource", bytes.len(), limits::RESOURCE_BYTES)?;
    let mut reader = Reader(bytes);
    match reader.varint()? {
        found if found != known => Err(DecodeError::Version { found, known }),
        _ => Ok(reader),
    }
}

/// Refuses bytes that are left over.
fn at_end(reader: &Reader<'_>) -> Result<(), DecodeError> {
    if reader.0.is_empty() { Ok(()) } else { Err(DecodeError::Malformed("bytes after the end")) }
}
