//! Sockets: UDP and TCP on the same port.

use std::io;
use std::net::{Ipv6Addr, SocketAddr, UdpSocket};

use tokio::net::TcpListener;

use crate::{Error, Result, descriptors};

/// Number of attempts to find a port that is free for both protocols, where the caller leaves the
/// choice.
const PORT_ATTEMPTS: usize = 16;

/// The sockets of a server.
pub(crate) struct Sockets {
    pub(crate) udp: Vec<UdpSocket>,
    pub(crate) tcp: Vec<TcpListener>,
    /// The requested address with the port that was chosen.
    pub(crate) address: SocketAddr,
}

/// Listens at an address; with port 0, at any port that is free for UDP and TCP.
pub(crate) fn listen(address: SocketAddr) -> Result<Sockets> {
    let mut attempts = if address.port() == 0 { PORT_ATTEMPTS } else { 1 };
    let (udp, tcp) = loop {
        attempts -= 1;
        match bind(address) {
            Err(_) if attempts > 0 => {}
            bound => break bound?,
        }
    };
    let address = udp.local_addr().map_err(|err| listen_error(address, "UDP", err))?;
    let mut sockets = Sockets { udp: vec![udp], tcp: vec![tcp], address };
    if let Some(other) = other_loopback(address) {
        match bind(other) {
            Ok((udp, tcp)) => {
                sockets.udp.push(udp);
                sockets.tcp.push(tcp);
            }
            Err(err) => tracing::debug!(%err, "not reachable over IPv6 loopback"),
        }
    }
    Ok(sockets)
}

/// Binds both protocols to one port.
fn bind(address: SocketAddr) -> Result<(UdpSocket, TcpListener)> {
    let udp = moq_tokio::bind::udp(moq_tokio::bind::Udp::new(address));
    let udp = udp.map_err(|err| listen_error(address, "UDP", err))?;
    let address = udp.local_addr().map_err(|err| listen_error(address, "UDP", err))?;
    let tcp = moq_tokio::bind::tcp(address).and_then(TcpListener::from_std);
    Ok((udp, tcp.map_err(|err| listen_error(address, "TCP", err))?))
}

/// The IPv6 loopback address for a server that `localhost` means on IPv4. `localhost` resolves to
/// `::1` first. Over TCP clients try both addresses, but browsers dial QUIC to the first only. So
/// the server listens there too, if it can.
fn other_loopback(address: SocketAddr) -> Option<SocketAddr> {
    let ip = address.ip();
    let local = ip.is_ipv4() && (ip.is_loopback() || ip.is_unspecified());
    local.then(|| SocketAddr::from((Ipv6Addr::LOCALHOST, address.port())))
}

fn listen_error(address: SocketAddr, protocol: &'static str, error: io::Error) -> Error {
    let port = address.port();
    let advice = match error.kind() {
        _ if descriptors::are_used_up(&error) => descriptors::ADVICE.to_owned(),
        io::ErrorKind::AddrInUse => {
            format!("another program uses port {port}: stop it, or choose another port")
        }
        io::ErrorKind::PermissionDenied => {
            format!("port {port} needs more rights: choose one above 1023")
        }
        _ => "choose an address of this machine".to_owned(),
    };
    Error::Listen { address, protocol, error, advice }
}
