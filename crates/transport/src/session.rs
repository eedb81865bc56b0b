//! What WebTransport and WebSocket sessions share: how one is let in and how it is served.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::http::StatusCode;
use moq_net::web_transport_trait;
use moq_relay::{auth, cluster, shutdown};

use crate::access::Sessions;
use crate::origin_check::OriginCheck;
use crate::rarely::Rarely;

/// How long a client may take for each step from its first packet to its session.
pub(crate) const HANDSHAKE: Duration = Duration::from_secs(10);

/// Streams that a client may have open at once, of each kind: every subscription holds one, and
/// every group on its way another.
pub(crate) const MAX_STREAMS: u32 = 1024;

/// Why a connection did not become a session, or how its session ended.
pub(crate) type Failure = Box<dyn std::error::Error + Send + Sync>;

/// What sessions are checked by and served from.
#[derive(Clone)]
pub(crate) struct Backend {
    pub(crate) auth: auth::Auth,
    pub(crate) cluster: cluster::Cluster,
    pub(crate) check: Arc<OriginCheck>,
    pub(crate) sessions: Sessions,
    pub(crate) shutdown: shutdown::Observer,
    pub(crate) told: Arc<Mutex<Rarely>>,
}

/// What a client asks for.
pub(crate) struct Ask<'a> {
    pub(crate) transport: moq_auth::Transport,
    pub(crate) path: &'a str,
    pub(crate) query: Option<&'a str>,
    pub(crate) remote: SocketAddr,
}

impl Backend {
    /// Counts and tells that a host or an origin is refused.
    pub(crate) fn refuse(&self, remote: SocketAddr, reason: &str) {
        self.sessions.refused();
        let told = self.told.lock().unwrap_or_else(PoisonError::into_inner).now();
        if let Some(times) = told {
            tracing::warn!(%remote, times, "refused: {reason}");
        }
    }

    /// Lets a session in; a refusal comes with its status and reason.
    pub(crate) async fn admit(&self, ask: Ask<'_>) -> Result<auth::Lease, (StatusCode, String)> {
        if self.sessions.full() {
            self.sessions.refused();
            let reason = "too many sessions are open; try again later";
            return Err((StatusCode::SERVICE_UNAVAILABLE, reason.into()));
        }
        let mut request = self.auth.request(ask.transport, ask.path);
        request.query = ask.query.map(str::to_owned);
        request.remote = Some(ask.remote);
        self.auth.admit(request).await.map_err(|err| match err {
            auth::Error::Unavailable(_) => (StatusCode::SERVICE_UNAVAILABLE, err.to_string()),
            _ => (StatusCode::UNAUTHORIZED, "the token is missing, wrong or expired".into()),
        })
    }

    /// Serves a session that has been let in, until it ends.
    pub(crate) async fn serve<S>(self, transport: S, lease: auth::Lease) -> Result<(), Failure>
    where
        S: web_transport_trait::Session,
    {
        let token = lease.token();
        // What the client may subscribe to is what we publish to it, and the other way round.
        let mut server = moq_net::Server::new();
        if let Some(readable) = self.cluster.subscriber(token) {
            server = server.with_publisher(&readable);
        }
        if let Some(writable) = self.cluster.publisher(token) {
            server = server.with_subscriber(writable);
        }
        let transport = moq_tokio::transport::Session::new(transport);
        let accept = server.accept(std::time::Instant::now(), transport);
        let (session, driver) = tokio::time::timeout(HANDSHAKE, accept).await??;
        tokio::spawn(moq_net::time::run(driver));
        tracing::debug!(version = %session.version(), "session");
        Ok(moq_relay::supervise(session, lease, self.shutdown, None).await?)
    }
}
