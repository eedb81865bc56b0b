//! What can go wrong between two ends of a connection.

use std::net::SocketAddr;

/// Why a connection did not become a session, or how its session ended.
pub(crate) type Failure = Box<dyn std::error::Error + Send + Sync>;

/// An error of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The server's address is taken or may not be used.
    #[error("cannot listen on {address} ({protocol}): {error}; {advice}")]
    Listen {
        /// The address asked for.
        address: SocketAddr,
        /// `UDP` or `TCP`.
        protocol: &'static str,
        /// What the system said.
        error: std::io::Error,
        /// What to do about it.
        advice: String,
    },
    /// The certificate or its key cannot be used.
    #[error("TLS: {0}")]
    Tls(String),
    /// The QUIC endpoint or the relay in it cannot be set up.
    #[error("cannot set up the server: {0}")]
    Setup(String),
    /// The address of a server is no `http(s)://host[:port]/name` URL.
    #[error("{url:?} is not the address of a server: {reason}")]
    Address {
        /// What was given.
        url: String,
        /// What is wrong with it.
        reason: String,
    },
    /// No connection within the time given.
    #[error("cannot connect to {url}: {reason}")]
    Connect {
        /// The server's address, without its token.
        url: String,
        /// Why the last attempt failed.
        reason: String,
    },
    /// The connection, server or broadcast has been closed for good.
    #[error("closed")]
    Closed,
    /// A path that this end may not publish, or that is taken.
    #[error("cannot publish {path:?}: {reason}")]
    Publish {
        /// The broadcast's path.
        path: String,
        /// Why not.
        reason: String,
    },
    /// A track that cannot be written to.
    #[error("track {track:?}: {reason}")]
    Track {
        /// The track's name.
        track: String,
        /// Why not.
        reason: String,
    },
    /// A frame above the size that the reader accepts; the rest of its group is skipped.
    #[error("track {track:?}: a frame of {size} bytes, over the limit of {limit}")]
    FrameTooLarge {
        /// The track's name.
        track: String,
        /// The frame's size in bytes.
        size: usize,
        /// The limit in bytes.
        limit: usize,
    },
    /// A file that cannot be fetched.
    #[error("cannot load {url}: {reason}")]
    Fetch {
        /// Its address.
        url: String,
        /// Why not.
        reason: String,
    },
    /// A signing key or token that cannot be made or read.
    #[error("access key: {0}")]
    Key(String),
}

/// The result of this crate's functions.
pub type Result<T, E = Error> = std::result::Result<T, E>;
