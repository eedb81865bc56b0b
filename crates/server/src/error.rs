//! What keeps a server from running.

use std::path::PathBuf;

use lumencast_codec::{VideoError, VolumesError};
use lumencast_solve::SolveError;
use thiserror::Error;

/// What keeps a server from running.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServerError {
    /// Volumes of probes that the wire format cannot carry.
    #[error(transparent)]
    Volumes(#[from] VolumesError),
    /// A source that does not fit a catalog.
    #[error(
        "source {0:?}: at most {max} bytes of text, no control characters",
        max = lumencast_codec::limits::SOURCE_BYTES
    )]
    Source(String),
    /// Lumels that cannot be coded as asked for.
    #[error("{0}; code lumels as halves, or on smaller pages")]
    Coding(#[from] VideoError),
    /// Light that cannot be computed.
    #[error(transparent)]
    Solve(#[from] SolveError),
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
