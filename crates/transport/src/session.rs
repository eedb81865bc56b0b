//! Admission and service of sessions, for both WebTransport and WebSocket.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::http::StatusCode;
use moq_net::web_transport_trait;
use moq_relay::{auth, cluster, shutdown};

use crate::access::Sessions;
use crate::error::Failure;
use crate::guests::{Guest, Guests};
use crate::names::Names;
use crate::origin_check::OriginCheck;
use crate::rarely::Rarely;
use crate::refusals::RefusalKind;

/// Longest time for each step from a client's first packet to its session.
pub(crate) const HANDSHAKE: Duration = Duration::from_secs(10);

/// Greatest number of streams of each kind that a client may have open. Every subscription holds
/// one, and every group being sent another.
pub(crate) const MAX_STREAMS: u32 = 1024;

/// The services that sessions are checked by and served from.
#[derive(Clone)]
pub(crate) struct Backend {
    pub(crate) auth: auth::Auth,
    pub(crate) cluster: cluster::Cluster,
    pub(crate) check: Arc<OriginCheck>,
    pub(crate) sessions: Sessions,
    /// Open sessions by address.
    pub(crate) visitors: Arc<Guests>,
    pub(crate) names: Names,
    pub(crate) shutdown: shutdown::Observer,
    pub(crate) told: Arc<Mutex<Rarely>>,
}

/// A client's request for a session.
pub(crate) struct Ask<'a> {
    pub(crate) transport: moq_auth::Transport,
    pub(crate) path: &'a str,
    pub(crate) query: Option<&'a str>,
    pub(crate) remote: SocketAddr,
}

/// An admitted session.
pub(crate) struct Admitted {
    lease: auth::Lease,
    remote: SocketAddr,
    _visitor: Guest,
}

impl Backend {
    /// Counts a refusal and logs it, though not too often.
    pub(crate) fn refuse(&self, kind: RefusalKind, remote: SocketAddr, reason: &str) {
        self.sessions.refusals.count(kind);
        let told = self.told.lock().unwrap_or_else(PoisonError::into_inner).now();
        if let Some(times) = told {
            tracing::warn!(%remote, times, "refused: {reason}");
        }
    }

    /// Admits a session; a refusal has a status and a reason.
    pub(crate) async fn admit(&self, ask: Ask<'_>) -> Result<Admitted, (StatusCode, String)> {
        let full = |reason: &str| {
            self.sessions.refusals.count(RefusalKind::Sessions);
            (StatusCode::SERVICE_UNAVAILABLE, reason.to_owned())
        };
        if self.sessions.full() {
            return Err(full("too many sessions are open; try again later"));
        }
        let Some(visitor) = self.visitors.enter(ask.remote.ip()) else {
            return Err(full("too many sessions of this address are open; close some"));
        };
        let mut request = self.auth.request(ask.transport, ask.path);
        request.query = ask.query.map(str::to_owned);
        request.remote = Some(ask.remote);
        let lease = self.auth.admit(request).await.map_err(|err| match err {
            auth::Error::Unavailable(_) => (StatusCode::SERVICE_UNAVAILABLE, err.to_string()),
            _ => (StatusCode::UNAUTHORIZED, "the token is missing, wrong or expired".into()),
        })?;
        Ok(Admitted { lease, remote: ask.remote, _visitor: visitor })
    }

    /// Serves an admitted session until it ends.
    pub(crate) async fn serve<S>(self, transport: S, admitted: Admitted) -> Result<(), Failure>
    where
        S: web_transport_trait::Session,
    {
        let Admitted { lease, remote, _visitor } = admitted;
        let token = lease.token();
        // The server publishes what the client may subscribe to, and subscribes to what the client
        // publishes.
        let mut server = moq_net::Server::new();
        if let Some(readable) = self.cluster.subscriber(token) {
            server = server.with_publisher(&readable);
        }
        let published = self.names.of_session(token);
        if let Some(published) = &published {
            server = server.with_subscriber(published.clone());
        }
        let transport = moq_tokio::transport::Session::new(transport);
        let accept = server.accept(std::time::Instant::now(), transport);
        let (session, driver) = tokio::time::timeout(HANDSHAKE, accept).await??;
        tokio::spawn(moq_net::time::run(driver));
        tracing::debug!(version = %session.version(), "session");
        let too_much = async {
            match &published {
                Some(published) => self.names.watch(published).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            ended = moq_relay::supervise(session.clone(), lease, self.shutdown.clone(), None) => {
                Ok(ended?)
            }
            reason = too_much => {
                session.abort(moq_net::Error::Unauthorized);
                let told = format!("a session is closed: {reason}");
                self.refuse(RefusalKind::Names, remote, &told);
                Err(reason)
            }
        }
    }
}
