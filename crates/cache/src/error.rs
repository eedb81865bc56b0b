//! Why a frame was not taken in.

use lumencast_codec::{DecodeError, ResourceHash};
use thiserror::Error;

/// Why a frame was not taken in. The cache is then as it was.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CacheError {
    /// Its bytes are wrong, or a delta's base is missing.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// It came before the catalog.
    #[error("no catalog has come yet")]
    NoCatalog,
    /// The catalog has no such field, or it is of a kind that this program does not know.
    #[error("the catalog has no field {0}")]
    UnknownField(u32),
    /// The field has no such region.
    #[error("field {field} has no region {region}")]
    UnknownRegion {
        /// The field.
        field: u32,
        /// The region.
        region: u32,
    },
    /// A frame came on the track of another layer than its number belongs to.
    #[error("update {update} does not belong to layer {layer}")]
    WrongLayer {
        /// Number of the update.
        update: u64,
        /// The layer of the track.
        layer: u8,
    },
    /// Nothing that is known wants these bytes: the catalog that named them has gone, they have come
    /// already, or they are not what was asked for.
    #[error("nothing names a resource {0}")]
    UnknownResource(ResourceHash),
    /// A saved field was given when a server's catalog had come already.
    #[error("a server is connected; its light is newer than a file's")]
    Connected,
    /// Too many edits wait for the server.
    #[error("{0} edits wait for the server already")]
    TooManyPending(usize),
}
