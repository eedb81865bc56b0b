//! What keeps a server from running.

use std::path::PathBuf;

use thiserror::Error;

/// What keeps a server from running.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServerError {
    /// A volume of probes that the wire format cannot carry.
    #[error("volume {volume}: {reason}")]
    Volume {
        /// Its number among the scene's volumes.
        volume: u32,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// More fields than a catalog holds.
    #[error(
        "{0} fields; a catalog holds at most {max}: give fewer volumes, or fewer cells along z, of \
         which 34 make a field",
        max = lumencast_codec::limits::FIELDS
    )]
    TooManyFields(usize),
    /// A source that does not fit a catalog.
    #[error(
        "source {0:?}: at most {max} bytes of text, no control characters",
        max = lumencast_codec::limits::SOURCE_BYTES
    )]
    Source(String),
    /// Light that was being computed is not coming.
    #[error("the gatherer gave up a job; its log says why")]
    Gather,
    /// The folder of the page cannot be read.
    #[error("cannot read the page in {folder}: {error}")]
    Page {
        /// The folder.
        folder: PathBuf,
        /// Why not.
        error: std::io::Error,
    },
    /// The network does not allow what was asked for.
    #[error(transparent)]
    Network(#[from] lumencast_transport::Error),
    /// The thread of the tick cannot be started, or has died.
    #[error("the tick has stopped: {0}")]
    Stopped(String),
}
