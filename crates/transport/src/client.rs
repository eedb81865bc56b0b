//! The client: one connection, made anew for as long as the client lives.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use moq_net::{bandwidth, origin};
use tokio::sync::{oneshot, watch};
use tokio::task::JoinHandle;
use url::Url;

use crate::{Announcements, Broadcast, Error, ReadOptions, Result, TrackReader, tls};

/// The shortest and the longest wait between two attempts to connect again.
const BACKOFF: (Duration, Duration) = (Duration::from_millis(250), Duration::from_secs(2));

/// Which transport a client uses.
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

/// How a client connects.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct ConnectOptions {
    /// The token to publish, or read, with.
    pub token: Option<String>,
    /// The transport.
    pub transport: Transport,
    /// The fingerprint (SHA-256, hexadecimal) of the server's certificate, where that is not to be
    /// trusted by its chain. With an `http://` address it is fetched from the server.
    pub fingerprint: Option<String>,
    /// How long the first connection may take, over all attempts.
    pub timeout: Duration,
}

impl Default for ConnectOptions {
    /// Without token, by any transport, within 10 seconds.
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
    /// It is.
    Connected,
    /// It is not, and tries to be.
    Lost {
        /// Why not, for people to read.
        reason: String,
    },
}

/// A connection to a server, which is made anew whenever it is lost. Dropping it ends it.
pub struct Client {
    scene: String,
    /// What the server publishes.
    remote: origin::Producer,
    /// What this client publishes.
    local: origin::Producer,
    state: watch::Receiver<ConnectionState>,
    bandwidth: Bandwidth,
    task: JoinHandle<()>,
}

/// The estimate of the connection that is there now.
type Bandwidth = Arc<Mutex<Option<bandwidth::Consumer>>>;

impl Client {
    /// Connects to `https://host[:port]/scene`, or with `http` to a server with a development
    /// certificate. A reverse proxy may have the server under a path: `https://host/base/scene`.
    ///
    /// # Errors
    /// An unusable address, a refusal, or no connection within the options' time.
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

    /// The name after the host in the address that was connected to: that of the scene, and of its
    /// broadcast. May be empty.
    pub fn scene(&self) -> &str {
        &self.scene
    }

    /// Reads a track of a broadcast, through interruptions: see [`TrackReader::next`].
    pub fn subscribe(&self, path: &str, track: &str, options: ReadOptions) -> TrackReader {
        TrackReader::follow(self.remote.consume(), path, track, options)
    }

    /// Publishes a broadcast, now and after each interruption. A server takes only those below
    /// `<scene>/edits/`, and others see none of the rest.
    pub fn publish(&self, path: &str) -> Result<Broadcast> {
        Broadcast::new(&self.local, path)
    }

    /// The broadcasts that the server shows this client, as they come and go.
    pub fn announced(&self, prefix: &str) -> Result<Announcements> {
        Announcements::of_server(&self.remote.consume(), prefix)
    }

    /// Whether the client is connected now.
    pub fn state(&self) -> ConnectionState {
        self.state.borrow().clone()
    }

    /// A watch on the state, to wait for its changes.
    pub fn watch_state(&self) -> watch::Receiver<ConnectionState> {
        self.state.clone()
    }

    /// The rate at which the link from the server delivers, in bits a second, where it is known.
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

/// A server's address, taken apart.
struct Address {
    /// What is dialled: the root, or where a proxy has it.
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

    /// The address for messages: without the token in its query.
    fn shown(&self) -> String {
        let mut url = self.dialled.clone();
        url.set_query(None);
        if let Ok(mut parts) = url.path_segments_mut() {
            parts.pop_if_empty().push(&self.scene);
        }
        url.to_string()
    }
}

/// Takes the scene off an address `…/base/scene`, so that `…/base/` is left; names of scenes have one
/// part. It may be empty.
pub fn take_scene(url: &mut Url) -> String {
    let path = url.path().trim_end_matches('/').to_owned();
    let (base, scene) = path.rsplit_once('/').unwrap_or_default();
    url.set_path(&format!("{base}/"));
    scene.to_owned()
}

/// How long one attempt may take.
const ATTEMPT: Duration = Duration::from_secs(5);

fn dialler(options: &ConnectOptions) -> moq_tokio::Result<moq_tokio::Client> {
    let mut connect = moq_tokio::connect::Config::default();
    connect.timeout = ATTEMPT;
    connect.tls.fingerprint.extend(options.fingerprint.clone());
    connect.websocket.enabled = Some(options.transport != Transport::Quic);
    let mut quic = moq_tokio::quic::Config::default();
    quic.idle_timeout = crate::IDLE_TIMEOUT;
    quic.keep_alive = crate::KEEP_ALIVE;
    // It connects once; the loop below does the rest, so that it can tell what goes on.
    Ok(connect.init(quic)?.with_reconnect(false))
}

/// Connects again and again; tells `first` of the first success, or of a refusal before it.
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
                    // Nobody waits for it any more if the client was dropped.
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

/// An error's text without causes that its parts repeat one after the other.
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
