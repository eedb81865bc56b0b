//! Who is at the other end of a TCP connection.

use std::net::SocketAddr;
use std::sync::Arc;

use tokio::net::TcpStream;

/// Who is at the other end of a TCP connection.
#[derive(Clone)]
pub(crate) struct Peer {
    pub(crate) remote: SocketAddr,
    /// What the kernel knows of the connection, for the estimate of its bandwidth.
    pub(crate) stats: Option<qmux::SharedSocketStats>,
}

#[cfg(unix)]
pub(crate) fn stats(stream: &TcpStream) -> Option<qmux::SharedSocketStats> {
    qmux::TcpStats::new(stream).ok().map(|stats| Arc::new(stats) as _)
}

#[cfg(not(unix))]
pub(crate) fn stats(_: &TcpStream) -> Option<qmux::SharedSocketStats> {
    None
}
