//! Errors between the two ends of a connection.

use std::net::SocketAddr;

/// Why a connection did not become a session, or how its session ended.
pub(crate) type Failure = Box<dyn std::error::Error + Send + Sync>;

/// An error of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The server cannot listen on its address.
    #[error("cannot listen on {address} ({protocol}): {error}; {advice}")]
    Listen {
        /// The requested address.
        address: SocketAddr,
        /// `UDP` or `TCP`.
        protocol: &'static str,
        /// The system's error.
        error: std::io::Error,
        /// What the user can do about it.
        advice: String,
    },
    /// The certificate or its key cannot be used.
    #[error("TLS: {0}")]
    Tls(String),
    /// The QUIC endpoint or the relay in it cannot be set up.
    #[error("cannot set up the server: {0}")]
    Setup(String),
    /// The address of a server is not an `http(s)://host[:port]/name` URL.
    #[error("{url:?} is not the address of a server: {reason}")]
    Address {
        /// The address given.
        url: String,
        /// What is wrong with it.
        reason: String,
    },
    /// There was no connection within the time given.
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
    /// This end may not publish a path, or the path is taken.
    #[error("cannot publish {path:?}: {reason}")]
    Publish {
        /// The broadcast's path.
        path: String,
        /// Why it cannot be published.
        reason: String,
    },
    /// A track cannot be written to.
    #[error("track {track:?}: {reason}")]
    Track {
        /// The track's name.
        track: String,
        /// Why it cannot be written to.
        reason: String,
    },
    /// A frame is larger than the reader accepts; the rest of its group is skipped.
    #[error("track {track:?}: a frame of {size} bytes, over the limit of {limit}")]
    FrameTooLarge {
        /// The track's name.
        track: String,
        /// The frame's size in bytes.
        size: usize,
        /// The limit in bytes.
        limit: usize,
    },
    /// A file cannot be fetched.
    #[error("cannot load {url}: {reason}")]
    Fetch {
        /// Address of the file.
        url: String,
        /// Why it cannot be fetched.
        reason: String,
    },
    /// A signing key or token cannot be made or read.
    #[error("access key: {0}")]
    Key(String),
}

/// The result of this crate's functions.
pub type Result<T, E = Error> = std::result::Result<T, E>;
