//! The client: a connection to a server, restored for as long as the client lives.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use moq_net::{bandwidth, origin};
use tokio::sync::{oneshot, watch};
use tokio::task::JoinHandle;
use url::Url;

use crate::{Announcements, Broadcast, Error, ReadOptions, Result, TrackReader, tls};

/// Shortest and longest wait between two attempts to connect.
const BACKOFF: (Duration, Duration) = (Duration::from_millis(250), Duration::from_secs(2));

/// The transport that a client uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Transport {
    /// QUIC, or WebSocket where QUIC does not get through.
    #[default]
    Auto,
    /// QUIC only.
    Quic,
    /// WebSocket only.
    WebSocket,
}

/// Options for connecting.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct ConnectOptions {
    /// The token that allows to publish, or also to read.
    pub token: Option<String>,
    /// The transport to use.
    pub transport: Transport,
    /// Fingerprint (SHA-256, hexadecimal) of the server's certificate, to trust it without its
    /// chain. With an `http://` address it is fetched from the server.
    pub fingerprint: Option<String>,
    /// Longest time until the first connection, over all attempts.
    pub timeout: Duration,
}

impl Default for ConnectOptions {
    /// No token, any transport, and 10 seconds.
    fn default() -> Self {
        Self {
            token: None,
            transport: Transport::Auto,
            fingerprint: None,
            timeout: Duration::from_secs(10),
        }
    }
}

/// Whether a client is connected.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ConnectionState {
    /// The client is connected.
    Connected,
    /// The client is not connected and keeps trying.
    Lost {
        /// Why it is not connected, for display.
        reason: String,
    },
}

/// A connection to a server, which is restored whenever it is lost. Dropping the client ends it.
pub struct Client {
    scene: String,
    /// Broadcasts of the server.
    remote: origin::Producer,
    /// Broadcasts of this client.
    local: origin::Producer,
    state: watch::Receiver<ConnectionState>,
    bandwidth: Bandwidth,
    task: JoinHandle<()>,
}

/// The bandwidth estimate of the current connection.
type Bandwidth = Arc<Mutex<Option<bandwidth::Consumer>>>;

impl Client {
    /// Connects to `https://host[:port]/scene`; `http` means a server with a development
    /// certificate. A reverse proxy may have the server under a path: `https://host/base/scene`.
    ///
    /// # Errors
    /// The address is unusable, the server refuses, or there is no connection within the options'
    /// time.
    pub async fn connect(url: &str, options: ConnectOptions) -> Result<Self> {
        tls::install_provider();
        let address = Address::parse(url, &options)?;
        let remote = moq_tokio::origin::spawn();
        let local = moq_tokio::origin::spawn();
        let dialler = dialler(&options)
            .map_err(|err| Error::Connect { url: address.shown(), reason: err.to_string() })?
            .with_subscriber(remote.clone())
            .with_publisher(&local);

        let lost = ConnectionState::Lost { reason: "not yet connected".into() };
        let (sender, state) = watch::channel(lost);
        let (first, connected) = oneshot::channel();
        let bandwidth = Bandwidth::default();
        let task = tokio::spawn(keep_connected(
            dialler,
            address.dialled.clone(),
            sender,
            bandwidth.clone(),
            first,
        ));
        let client = Self { scene: address.scene.clone(), remote, local, state, bandwidth, task };
        let connect = |reason| Error::Connect { url: address.shown(), reason };
        match tokio::time::timeout(options.timeout, connected).await {
            Ok(Ok(Ok(()))) => Ok(client),
            Ok(Ok(Err(refused))) => Err(connect(refused)),
            Ok(Err(_)) => Err(connect("stopped".into())),
            Err(_) => Err(connect(match client.state() {
                ConnectionState::Lost { reason } => reason,
                ConnectionState::Connected => "timed out".into(),
            })),
        }
    }

    /// The last part of the address's path: the name of the scene and of its broadcast. It may be
    /// empty.
    pub fn scene(&self) -> &str {
        &self.scene
    }

    /// A reader of a broadcast's track that survives interruptions: see [`TrackReader::next`].
    pub fn subscribe(&self, path: &str, track: &str, options: ReadOptions) -> TrackReader {
        TrackReader::follow(self.remote.consume(), path, track, options)
    }

    /// Publishes a broadcast, now and after each interruption. A server accepts only paths below
    /// `<scene>/edits/`; others see no other broadcast of a client.
    ///
    /// # Errors
    /// [`Error::Publish`].
    pub fn publish(&self, path: &str) -> Result<Broadcast> {
        Broadcast::new(&self.local, path)
    }

    /// The broadcasts under `prefix` that the server announces to this client, as they appear and
    /// go.
    pub fn announced(&self, prefix: &str) -> Result<Announcements> {
        Announcements::of_server(&self.remote.consume(), prefix)
    }

    /// Whether the client is connected now.
    pub fn state(&self) -> ConnectionState {
        self.state.borrow().clone()
    }

    /// A receiver of the state, to wait for changes.
    pub fn watch_state(&self) -> watch::Receiver<ConnectionState> {
        self.state.clone()
    }

    /// Bandwidth of the link from the server, bits per second; `None` where it is unknown.
    pub fn recv_bandwidth(&self) -> Option<u64> {
        let bandwidth = self.bandwidth.lock().unwrap_or_else(PoisonError::into_inner);
        bandwidth.as_ref().and_then(|estimate| estimate.peek()).map(|rate| rate.as_bps())
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// A server's address, split into its parts.
struct Address {
    /// The URL to dial: the server's root, or its path behind a proxy.
    dialled: Url,
    scene: String,
}

impl Address {
    fn parse(text: &str, options: &ConnectOptions) -> Result<Self> {
        let refuse = |reason: &str| Error::Address { url: text.to_owned(), reason: reason.into() };
        let mut url = Url::parse(text).map_err(|err| refuse(&err.to_string()))?;
        if !matches!(url.scheme(), "http" | "https") {
            return Err(refuse("it must begin with http:// or https://"));
        }
        if url.host_str().is_none_or(str::is_empty) {
            return Err(refuse("it names no host"));
        }
        let scene = take_scene(&mut url);
        url.set_fragment(None);
        if let Some(token) = &options.token {
            url.query_pairs_mut().append_pair("jwt", token);
        }
        if options.transport == Transport::WebSocket {
            let scheme = if url.scheme() == "https" { "wss" } else { "ws" };
            url.set_scheme(scheme).map_err(|()| refuse("it has no WebSocket form"))?;
        }
        Ok(Self { dialled: url, scene })
    }

    /// The address for messages, without the token in its query.
    fn shown(&self) -> String {
        let mut url = self.dialled.clone();
        url.set_query(None);
        if let Ok(mut parts) = url.path_segments_mut() {
            parts.pop_if_empty().push(&self.scene);
        }
        url.to_string()
    }
}

/// Removes the scene from an address `…/base/scene` and returns it; `…/base/` remains. A scene's
/// name is a single part of the path and may be empty.
pub fn take_scene(url: &mut Url) -> String {
    let path = url.path().trim_end_matches('/').to_owned();
    let (base, scene) = path.rsplit_once('/').unwrap_or_default();
    url.set_path(&format!("{base}/"));
    scene.to_owned()
}

/// Longest time for one attempt.
const ATTEMPT: Duration = Duration::from_secs(5);

fn dialler(options: &ConnectOptions) -> moq_tokio::Result<moq_tokio::Client> {
    let mut connect = moq_tokio::connect::Config::default();
    connect.timeout = ATTEMPT;
    connect.tls.fingerprint.extend(options.fingerprint.clone());
    connect.websocket.enabled = Some(options.transport != Transport::Quic);
    let mut quic = moq_tokio::quic::Config::default();
    quic.idle_timeout = crate::IDLE_TIMEOUT;
    quic.keep_alive = crate::KEEP_ALIVE;
    // The dialler connects once. The loop below reconnects, so that it can report the state.
    Ok(connect.init(quic)?.with_reconnect(false))
}

/// Keeps connecting; reports the first success, or a refusal before it, to `first`.
async fn keep_connected(
    dialler: moq_tokio::Client,
    url: Url,
    state: watch::Sender<ConnectionState>,
    bandwidth: Bandwidth,
    first: oneshot::Sender<Result<(), String>>,
) {
    let mut first = Some(first);
    let mut wait = BACKOFF.0;
    let estimate = |estimate: Option<bandwidth::Consumer>| {
        *bandwidth.lock().unwrap_or_else(PoisonError::into_inner) = estimate;
    };
    loop {
        let reason = match dialler.connect(url.clone()).established().await {
            Ok(connection) => {
                wait = BACKOFF.0;
                estimate(Some(connection.recv_bandwidth()));
                state.send_replace(ConnectionState::Connected);
                if let Some(first) = first.take() {
                    // Nobody waits for it if the client was dropped.
                    let _ = first.send(Ok(()));
                }
                let ended = connection.closed().await;
                estimate(None);
                ended.err().map_or_else(|| "closed".to_owned(), |err| said_once(&err))
            }
            Err(err) => {
                if let Some(first) = first.take_if(|_| err.is_auth()) {
                    let _ = first.send(Err(said_once(&err)));
                    return;
                }
                said_once(&err)
            }
        };
        tracing::debug!(%reason, "not connected");
        state.send_replace(ConnectionState::Lost { reason });
        tokio::time::sleep(wait).await;
        wait = (wait * 2).min(BACKOFF.1);
    }
}

/// Text of an error in which consecutive parts that repeat each other occur once.
fn said_once(error: &impl std::fmt::Display) -> String {
    let error = error.to_string();
    let mut parts: Vec<&str> = error.split(": ").collect();
    parts.dedup();
    parts.join(": ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn causes_are_said_once() {
        assert_eq!(said_once(&"no way: IO error: refused: refused"), "no way: IO error: refused");
        assert_eq!(said_once(&"a: b: a"), "a: b: a");
    }

    #[test]
    fn the_root_is_dialled_and_the_path_names_the_scene() {
        let options = ConnectOptions { token: Some("a.b".into()), ..Default::default() };
        let address = Address::parse("https://light.example:4443/sponza", &options).expect("valid");
        assert_eq!(address.dialled.as_str(), "https://light.example:4443/?jwt=a.b");
        assert_eq!(address.scene, "sponza");
        assert_eq!(address.shown(), "https://light.example:4443/sponza");
    }

    #[test]
    fn a_proxy_may_have_it_under_a_path() {
        for text in ["https://light.example/a/b/sponza?x=1#y", "https://light.example/a/b/sponza//"]
        {
            let address = Address::parse(text, &ConnectOptions::default()).expect("valid");
            assert_eq!(address.dialled.path(), "/a/b/");
            assert_eq!(address.scene, "sponza");
            assert_eq!(address.shown(), "https://light.example/a/b/sponza");
        }
    }

    #[test]
    fn websocket_has_its_own_scheme() {
        let options = ConnectOptions { transport: Transport::WebSocket, ..Default::default() };
        let address = Address::parse("http://localhost:4443/sponza", &options).expect("valid");
        assert_eq!(address.dialled.as_str(), "ws://localhost:4443/");
    }

    #[test]
    fn other_addresses_are_refused() {
        for text in ["", "sponza", "ftp://host/x", "http://", "file:///etc/passwd"] {
            let parsed = Address::parse(text, &ConnectOptions::default());
            assert!(matches!(parsed, Err(Error::Address { .. })), "{text}");
        }
    }
}
