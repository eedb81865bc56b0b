//! The server: an embedded relay on one port, QUIC on UDP and HTTP with WebSocket on TCP.

use std::net::{Ipv6Addr, SocketAddr, UdpSocket};
use std::sync::{Arc, RwLock};
use std::time::Duration;

use axum::Router;
use moq_net::origin;
use moq_relay::{auth, cache, cluster, shutdown, web};
use moq_tokio::tls::Certificates;
use tokio::task::JoinHandle;
use web_transport_moq::noq;

use crate::access::{self, Access, Sessions};
use crate::origin_check::OriginCheck;
use crate::quic::{self, Backend};
use crate::tls::{self, Fingerprint, Identified, Tls};
use crate::{Announcements, Broadcast, Error, Result, http};

/// Bytes of past groups kept for late readers, over all tracks; above it, the oldest go first.
const CACHE: &str = "512MiB";

/// Attempts to find a port that is free for both protocols, where the caller leaves the choice.
const PORT_ATTEMPTS: usize = 16;

/// How a server is set up.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct ServerConfig {
    /// The address for UDP and TCP alike; with port 0 a port is chosen that is free for both.
    pub listen: SocketAddr,
    /// The certificate.
    pub tls: Tls,
    /// Who may read and edit.
    pub access: Access,
    /// Names, without port, under which the server is reached, besides `localhost` and addresses.
    pub allowed_hosts: Vec<String>,
    /// Origins (`scheme://host[:port]`) of pages that may connect, besides the server's own.
    pub allowed_origins: Vec<String>,
    /// Sessions open at once, at most; a further one is refused with status 503.
    pub max_sessions: usize,
}

impl ServerConfig {
    /// A server at this address with a development certificate, for this machine only, for at most
    /// 256 sessions.
    pub fn new(listen: SocketAddr) -> Self {
        Self {
            listen,
            tls: Tls::default(),
            access: Access::default(),
            allowed_hosts: Vec::new(),
            allowed_origins: Vec::new(),
            max_sessions: 256,
        }
    }
}

/// A running server. Dropping it stops it at once; [`Server::shutdown`] lets sessions end.
pub struct Server {
    address: SocketAddr,
    origin: origin::Producer,
    sessions: Sessions,
    shutdown: shutdown::Trigger,
    endpoints: Vec<noq::Endpoint>,
    tasks: Vec<JoinHandle<()>>,
}

impl Server {
    /// Starts a server. `application` answers HTTP requests on the same TCP port, after the check
    /// of hosts and origins; WebSocket upgrades and `/certificate.sha256` do not reach it.
    ///
    /// # Errors
    /// A port in use, an unusable certificate, or [`Access::Loopback`] on another address.
    pub async fn bind(config: ServerConfig, application: Router) -> Result<Self> {
        tls::install_provider();
        if matches!(config.access, Access::Loopback) && !config.listen.ip().is_loopback() {
            let reason = "it is not a loopback address: give a key for tokens, or open it to all";
            return Err(Error::Setup(format!("{}: {reason}", config.listen)));
        }
        // No time to leave: a client has nothing to finish before it looks for the next server.
        let (shutdown, observer) = shutdown::Observer::new(Duration::ZERO);
        let (auth, admissions) = auth::Auth::embedded("lumencast");
        let cluster = cluster().map_err(setup_error)?;
        let identified = config.tls.for_quic()?;
        let fingerprint: Fingerprint = Arc::new(RwLock::new(identified.fingerprint.clone()));

        let (udp, web) = bind(config.listen, |listen| {
            let listen = config.tls.for_http(listen);
            let web = web::Web::new(auth.clone(), cluster.clone(), no_certificates()?, listen);
            Ok(web.with_shutdown(observer.clone()).bind()?)
        })?;
        let address = udp.local_addr().map_err(setup_error)?;
        let quic_config = tls::quic_config(&identified)?;
        let mut endpoints = vec![endpoint(udp, &quic_config).map_err(setup_error)?];
        if let Some(udp) = other_loopback(address) {
            endpoints.push(endpoint(udp, &quic_config).map_err(setup_error)?);
        }

        let sessions = Sessions::new(config.max_sessions);
        let check = OriginCheck::new(address, &config.allowed_hosts, &config.allowed_origins);
        let check = Arc::new(check);
        let front = http::router(
            check.clone(),
            sessions.clone(),
            fingerprint.clone(),
            web.routes(),
            application,
        );
        let backend = Backend {
            auth,
            cluster: cluster.clone(),
            check,
            sessions: sessions.clone(),
            shutdown: observer,
        };
        let mut tasks = vec![
            tokio::spawn(access::decide(admissions, config.access, sessions.clone())),
            tokio::spawn(async move {
                if let Err(err) = web.serve(front).await {
                    tracing::error!(%err, "the HTTP server stopped");
                }
            }),
            tokio::spawn(renew(config.tls, identified, endpoints.clone(), fingerprint)),
        ];
        for endpoint in &endpoints {
            tasks.push(tokio::spawn(quic::serve(endpoint.clone(), backend.clone())));
        }
        Ok(Self { address, origin: cluster.origin, sessions, shutdown, endpoints, tasks })
    }

    /// The address, with the port that was chosen.
    pub fn local_addr(&self) -> SocketAddr {
        self.address
    }

    /// How many sessions are open.
    pub fn sessions(&self) -> usize {
        self.sessions.count()
    }

    /// Makes a broadcast under this path, the name of a scene. It is known to readers once it is
    /// [announced](Broadcast::announce).
    pub fn publish(&self, path: &str) -> Result<Broadcast> {
        Broadcast::new(&self.origin, path)
    }

    /// The broadcasts under this path, such as `sponza/edits`: the clients' own, as they come and go.
    pub fn announced(&self, prefix: &str) -> Result<Announcements> {
        Announcements::new(&self.origin.consume(), prefix)
    }

    /// Closes every session, so that clients know at once, and stops; takes at most `grace`. After
    /// that the port is free again.
    pub async fn shutdown(self, grace: Duration) {
        let address = self.address;
        let closed = async {
            self.shutdown.start();
            while self.sessions.count() > 0 {
                tokio::time::sleep(POLL).await;
            }
            for endpoint in &self.endpoints {
                endpoint.close(noq::VarInt::from_u32(0), b"server shutdown");
                endpoint.wait_idle().await;
            }
            drop(self);
            // The endpoint's own task lets go of the socket when it next runs.
            while UdpSocket::bind(address).is_err() {
                tokio::time::sleep(POLL).await;
            }
        };
        if tokio::time::timeout(grace, closed).await.is_err() {
            tracing::warn!(%address, "not every connection closed in time");
        }
    }
}

/// How often a shutdown looks whether it is done.
const POLL: Duration = Duration::from_millis(5);

impl Drop for Server {
    fn drop(&mut self) {
        self.shutdown.start();
        for endpoint in &self.endpoints {
            endpoint.close(noq::VarInt::from_u32(0), b"server stopped");
        }
        for task in &self.tasks {
            task.abort();
        }
    }
}

fn cluster() -> Result<cluster::Cluster, Failure> {
    let mut cache = cache::Config::default();
    cache.capacity = Some(CACHE.into());
    let options = cluster::Options::new(cluster::Config::default()).with_cache(cache.init()?);
    Ok(cluster::Cluster::new(options)?)
}

/// The relay's routes want to serve a fingerprint; ours serve it instead, and a set of none cannot
/// be made from outside.
fn no_certificates() -> Result<Certificates, moq_tokio::tls::Error> {
    Certificates::from_pem(b"-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
}

/// Binds UDP, and TCP by `bind_tcp`, to the same port.
fn bind(
    listen: SocketAddr,
    bind_tcp: impl Fn(SocketAddr) -> Result<web::Web, Failure>,
) -> Result<(UdpSocket, web::Web)> {
    let attempts = if listen.port() == 0 { PORT_ATTEMPTS } else { 1 };
    let mut attempt = 0;
    loop {
        attempt += 1;
        let udp = moq_tokio::bind::udp(moq_tokio::bind::Udp::new(listen))
            .map_err(|err| listen_error(listen, "UDP", err))?;
        let address = udp.local_addr().map_err(setup_error)?;
        match bind_tcp(address) {
            Ok(web) => return Ok((udp, web)),
            Err(err) => {
                let Some(source) = io_error(&*err) else {
                    return Err(Error::Tls(err.to_string()));
                };
                if attempt == attempts {
                    let source = std::io::Error::new(source.kind(), source.to_string());
                    return Err(listen_error(address, "TCP", source));
                }
            }
        }
    }
}

/// The system's error at the root of another.
fn io_error<'a>(err: &'a (dyn std::error::Error + 'static)) -> Option<&'a std::io::Error> {
    std::iter::successors(Some(err), |err| err.source()).find_map(|err| err.downcast_ref())
}

fn listen_error(address: SocketAddr, protocol: &'static str, source: std::io::Error) -> Error {
    let port = address.port();
    let advice = match source.kind() {
        std::io::ErrorKind::AddrInUse => {
            format!("another program uses port {port}: stop it, or choose another port")
        }
        std::io::ErrorKind::PermissionDenied => {
            format!("port {port} needs more rights: choose one above 1023")
        }
        _ => "choose an address of this machine".to_owned(),
    };
    Error::Listen { address, protocol, source, advice }
}

fn endpoint(udp: UdpSocket, config: &noq::ServerConfig) -> Result<noq::Endpoint, Failure> {
    let runtime = noq::default_runtime().ok_or("no Tokio runtime")?;
    Ok(noq::Endpoint::new(noq::EndpointConfig::default(), Some(config.clone()), udp, runtime)?)
}

/// `localhost` is `::1` before it is `127.0.0.1`. Over TCP clients try both, but browsers dial QUIC
/// to the first only; so a server on IPv4 that `localhost` means listens there too, if it can.
fn other_loopback(address: SocketAddr) -> Option<UdpSocket> {
    let ip = address.ip();
    if !ip.is_ipv4() || !(ip.is_loopback() || ip.is_unspecified()) {
        return None;
    }
    let other = SocketAddr::from((Ipv6Addr::LOCALHOST, address.port()));
    match moq_tokio::bind::udp(moq_tokio::bind::Udp::new(other)) {
        Ok(udp) => Some(udp),
        Err(err) => {
            tracing::debug!(%other, %err, "not reachable over IPv6 loopback");
            None
        }
    }
}

/// Replaces a development certificate before it expires; files are watched by `identified`.
async fn renew(
    tls: Tls,
    mut identified: Identified,
    endpoints: Vec<noq::Endpoint>,
    fingerprint: Fingerprint,
) {
    while identified.fingerprint.is_some() {
        tokio::time::sleep(tls::RENEWAL).await;
        let renewed = tls.for_quic().and_then(|new| Ok((tls::quic_config(&new)?, new)));
        match renewed {
            Ok((config, new)) => {
                for endpoint in &endpoints {
                    endpoint.set_server_config(Some(config.clone()));
                }
                if let Ok(mut served) = fingerprint.write() {
                    served.clone_from(&new.fingerprint);
                }
                identified = new;
            }
            Err(err) => tracing::error!(%err, "the development certificate was not renewed"),
        }
    }
    std::future::pending::<()>().await;
}

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn setup_error(err: impl std::fmt::Display) -> Error {
    Error::Setup(format!("{err:#}"))
}
