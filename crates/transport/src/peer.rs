//! Peers of TCP connections.

use std::net::SocketAddr;
use std::sync::Arc;

use tokio::net::TcpStream;

/// The peer of a TCP connection.
#[derive(Clone)]
pub(crate) struct Peer {
    pub(crate) remote: SocketAddr,
    /// The kernel's statistics of the connection, from which its bandwidth is estimated.
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
