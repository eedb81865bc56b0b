//! What can go wrong.

use std::path::PathBuf;

use thiserror::Error;

/// Why there is no session or no scene.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ClientError {
    /// No connection, or none that is allowed.
    #[error(transparent)]
    Transport(#[from] lumencast_transport::Error),
    /// Connected, but nothing that this client understands came.
    #[error("{url}: connected, but {what}")]
    NoScene {
        /// The address.
        url: String,
        /// What was missing.
        what: String,
    },
    /// A file of the scene cannot be had.
    #[error("cannot load {url}: {reason}")]
    Download {
        /// The file's address.
        url: String,
        /// Why not.
        reason: String,
    },
    /// A file of the scene cannot be kept.
    #[error("cannot write {}: {error}", path.display())]
    Write {
        /// Where.
        path: PathBuf,
        /// Why not.
        error: std::io::Error,
    },
    /// The scene is none.
    #[error(transparent)]
    Scene(#[from] lumencast_scene::SceneError),
}
