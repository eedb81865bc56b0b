//! The server: an embedded relay on one port, with QUIC on UDP, and HTTP and WebSocket on TCP.

use std::net::{SocketAddr, UdpSocket};
use std::sync::{Arc, PoisonError, RwLock};
use std::time::Duration;

use axum::Router;
use moq_net::origin;
use moq_relay::{auth, cache, cluster, shutdown};
use moq_tokio::tls::ReloadingServerConfig;
use tokio::task::JoinHandle;
use web_transport_moq::noq;

use crate::access::{self, Access, Sessions};
use crate::error::Failure;
use crate::guests::Guests;
use crate::http::Front;
use crate::names::Names;
use crate::origin_check::OriginCheck;
use crate::progress::Patience;
use crate::refusals::Refusals;
use crate::session::Backend;
use crate::tls::{self, Fingerprint, Identified, Tls};
use crate::{Announcements, Broadcast, Error, Result, descriptors, listen, quic, tcp};

/// Size of past groups kept for late readers, over all tracks; the oldest are dropped first.
const CACHE: &str = "512MiB";

/// Configuration of a server.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct ServerConfig {
    /// Address for UDP and TCP; with port 0 the server chooses a port that is free for both.
    pub listen: SocketAddr,
    /// The certificate.
    pub tls: Tls,
    /// Who may read and who may edit.
    pub access: Access,
    /// Host names, without port, under which the server is reached. `localhost` and address
    /// literals are always allowed.
    pub allowed_hosts: Vec<String>,
    /// Origins (`scheme://host[:port]`) of pages that may connect, besides the server's own.
    pub allowed_origins: Vec<String>,
    /// Greatest number of open sessions. An address outside this machine may have half of them, and
    /// at least eight. Further sessions are refused with status 503.
    pub max_sessions: usize,
    /// Greatest number of names that one session may publish edits under at a time; a session with
    /// more is closed. A page needs one, a relay one for each of its editors.
    pub max_names: usize,
    /// Greatest number of TCP connections open for HTTP. One address may have half of them. Further
    /// ones are closed. There are fewer where the system allows fewer descriptors.
    pub max_connections: usize,
    /// Greatest number of HTTP requests answered at once. One address may have half of them.
    /// Further ones are refused with status 503.
    pub max_requests: usize,
    /// Times that a TCP connection may stand still.
    pub patience: Patience,
}

impl ServerConfig {
    /// A server at this address with a development certificate, for clients on this machine only,
    /// and at most 256 sessions.
    pub fn new(listen: SocketAddr) -> Self {
        Self {
            listen,
            tls: Tls::default(),
            access: Access::default(),
            allowed_hosts: Vec::new(),
            allowed_origins: Vec::new(),
            max_sessions: 256,
            max_names: 4,
            max_connections: 1024,
            max_requests: 256,
            patience: Patience::default(),
        }
    }
}

/// A running server. Dropping it stops it at once; [`Server::shutdown`] also waits until it has
/// stopped.
pub struct Server {
    address: SocketAddr,
    origin: origin::Producer,
    names: Names,
    sessions: Sessions,
    /// Open TCP connections for HTTP.
    connections: Arc<Guests>,
    shutdown: shutdown::Trigger,
    endpoints: Vec<noq::Endpoint>,
    tasks: Vec<JoinHandle<()>>,
    /// Watches the files of the HTTPS certificate.
    _watching: Option<ReloadingServerConfig>,
}

impl Server {
    /// Starts a server. `application` answers HTTP requests on the same TCP port that pass the
    /// check of hosts and origins. WebSocket upgrades and `/certificate.sha256` do not reach it.
    ///
    /// # Errors
    /// The port is in use, the certificate is unusable, or [`Access::Loopback`] is used on another
    /// address.
    pub async fn bind(config: ServerConfig, application: Router) -> Result<Self> {
        tls::install_provider();
        if matches!(config.access, Access::Loopback) && !config.listen.ip().is_loopback() {
            let reason = "it is not a loopback address: give a key for tokens, or open it to all";
            return Err(Error::Setup(format!("{}: {reason}", config.listen)));
        }
        // Clients get no time to leave: they have nothing to finish before they look for the next
        // server.
        let (shutdown, observer) = shutdown::Observer::new(Duration::ZERO);
        let (auth, admissions) = auth::Auth::embedded("lumencast");
        let cluster = cluster().map_err(setup_error)?;
        let identified = config.tls.for_quic()?;
        let fingerprint: Fingerprint = Arc::new(RwLock::new(identified.fingerprint.clone()));
        let https = config.tls.for_http()?;

        let sockets = listen::listen(config.listen)?;
        let address = sockets.address;
        let quic_config = tls::quic_config(&identified)?;
        let endpoints = sockets.udp.into_iter().map(|udp| endpoint(udp, &quic_config));
        let endpoints: Vec<_> = endpoints.collect::<Result<_, _>>().map_err(setup_error)?;

        let sessions = Sessions::new(config.max_sessions);
        let check = OriginCheck::new(address, &config.allowed_hosts, &config.allowed_origins);
        let origin = cluster.origin.clone();
        let names = Names::beside(&origin, config.max_names);
        let backend = Backend {
            auth,
            cluster,
            check: Arc::new(check),
            sessions: sessions.clone(),
            visitors: Guests::with_proxies(config.max_sessions),
            names: names.clone(),
            shutdown: observer,
            told: Arc::default(),
        };
        let connections = Guests::new(descriptors::connections(&config));
        let front = Front {
            backend: backend.clone(),
            fingerprint: fingerprint.clone(),
            application,
            connections: connections.clone(),
            requests: Guests::new(config.max_requests),
            patience: config.patience,
        };

        let mut tasks = vec![
            tokio::spawn(access::decide(admissions, config.access, sessions.clone())),
            tokio::spawn(renew(config.tls, identified, endpoints.clone(), fingerprint)),
        ];
        let (acceptor, watching) = https.unzip();
        for listener in sockets.tcp {
            tasks.push(tokio::spawn(tcp::serve(listener, acceptor.clone(), front.clone())));
        }
        for endpoint in &endpoints {
            tasks.push(tokio::spawn(quic::serve(endpoint.clone(), backend.clone())));
        }
        Ok(Self {
            address,
            origin,
            names,
            sessions,
            connections,
            shutdown,
            endpoints,
            tasks,
            _watching: watching,
        })
    }

    /// The address with the port that was chosen.
    pub fn local_addr(&self) -> SocketAddr {
        self.address
    }

    /// Number of open sessions.
    pub fn sessions(&self) -> usize {
        self.sessions.count()
    }

    /// Number of TCP connections open for HTTP, without those of WebSocket sessions.
    pub fn connections(&self) -> usize {
        self.connections.count()
    }

    /// Numbers of refusals since the start.
    pub fn refusals(&self) -> Refusals {
        self.sessions.refusals.clone()
    }

    /// Creates a broadcast under this path, the name of a scene. Readers see it once it is
    /// [announced](Broadcast::announce).
    ///
    /// # Errors
    /// [`Error::Publish`].
    pub fn publish(&self, path: &str) -> Result<Broadcast> {
        let mut scenes = self.sessions.scenes.lock().unwrap_or_else(PoisonError::into_inner);
        scenes.insert(path.to_owned());
        Broadcast::new(&self.origin, path)
    }

    /// The broadcasts of sessions under this path, such as `sponza/edits`, as they appear and go.
    /// Two sessions may publish the same path;
    /// [`RemoteBroadcast::session`](crate::RemoteBroadcast::session) tells them apart.
    pub fn announced(&self, prefix: &str) -> Result<Announcements> {
        Announcements::of_sessions(&self.names.consume(), prefix)
    }

    /// Closes every session, so that clients know at once, and stops the server. HTTP answers that
    /// have begun are sent to their end. It takes at most `grace`. After that the port is free
    /// again.
    pub async fn shutdown(self, grace: Duration) {
        let address = self.address;
        let closed = async {
            self.shutdown.start();
            while self.sessions.count() > 0 || self.connections.count() > 0 {
                tokio::time::sleep(POLL).await;
            }
            for endpoint in &self.endpoints {
                endpoint.close(noq::VarInt::from_u32(0), b"server shutdown");
                endpoint.wait_idle().await;
            }
            drop(self);
            // The endpoint's own task releases the socket when it next runs.
            while UdpSocket::bind(address).is_err() {
                tokio::time::sleep(POLL).await;
            }
        };
        if tokio::time::timeout(grace, closed).await.is_err() {
            tracing::warn!(%address, "not every connection closed in time");
        }
    }
}

/// Interval at which a shutdown checks whether it is done.
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

fn endpoint(udp: UdpSocket, config: &noq::ServerConfig) -> Result<noq::Endpoint, Failure> {
    let runtime = noq::default_runtime().ok_or("no Tokio runtime")?;
    Ok(noq::Endpoint::new(noq::EndpointConfig::default(), Some(config.clone()), udp, runtime)?)
}

/// Replaces a development certificate before it expires. Certificate files are watched by
/// `identified`.
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

fn setup_error(err: impl std::fmt::Display) -> Error {
    Error::Setup(format!("{err:#}"))
}
