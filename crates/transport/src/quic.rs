//! The QUIC side of the server: WebTransport sessions.
//!
//! The relay's own listener answers a CONNECT before anyone can see its `Origin`, and hands none of
//! its headers on. So this is the one part of the relay that is our own: it accepts the connection,
//! checks host, origin and access, and only then answers; the rest is the relay's again.

use std::sync::Arc;
use std::time::Duration;

use moq_relay::{auth, cluster, shutdown};
use web_transport_moq::http::StatusCode;
use web_transport_moq::{Request, noq, proto};

use crate::access::Sessions;
use crate::origin_check::OriginCheck;

/// How long a client may take from its first packet to its session.
const HANDSHAKE: Duration = Duration::from_secs(10);

/// How long a refused client may take to hear so.
const ANSWER: Duration = Duration::from_secs(1);

/// What a session is served from.
#[derive(Clone)]
pub(crate) struct Backend {
    pub(crate) auth: auth::Auth,
    pub(crate) cluster: cluster::Cluster,
    pub(crate) check: Arc<OriginCheck>,
    pub(crate) sessions: Sessions,
    pub(crate) shutdown: shutdown::Observer,
}

/// Why a connection did not become a session, or how its session ended.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Accepts connections until the endpoint is closed.
pub(crate) async fn serve(endpoint: noq::Endpoint, backend: Backend) {
    while let Some(incoming) = endpoint.accept().await {
        let backend = backend.clone();
        tokio::spawn(async move {
            let remote = incoming.remote_address();
            if let Err(err) = connection(incoming, backend).await {
                tracing::debug!(%remote, %err, "connection ended");
            }
        });
    }
}

/// One connection, from its first packet to its end.
async fn connection(incoming: noq::Incoming, backend: Backend) -> Result<(), Failure> {
    let remote = incoming.remote_address();
    let request = tokio::time::timeout(HANDSHAKE, async {
        let connection = incoming.accept()?.await?;
        Ok::<_, Failure>(Request::accept(connection).await?)
    });
    let request = request.await??;

    let lease = match admit(&request, remote, &backend).await {
        Ok(lease) => lease,
        Err((status, reason)) => {
            tracing::info!(%remote, %status, %reason, "WebTransport session refused");
            let connection = request.conn().clone();
            request.reject(status).await?;
            // Dropping the connection at once would overtake the answer.
            let _ = tokio::time::timeout(ANSWER, connection.closed()).await;
            return Ok(());
        }
    };
    let token = lease.token();
    let publish = backend.cluster.publisher(token);
    let subscribe = backend.cluster.subscriber(token);

    let versions = moq_net::Versions::all();
    let alpns = versions.alpns();
    let mut response = proto::ConnectResponse::OK;
    if let Some(protocol) = request.protocols.iter().find(|name| alpns.contains(&name.as_str())) {
        response = response.with_protocol(protocol);
    }
    let transport = request.respond(response).await?;

    // What the client may subscribe to is what we publish to it, and the other way round.
    let mut server = moq_net::Server::new().with_versions(versions);
    if let Some(subscribe) = &subscribe {
        server = server.with_publisher(subscribe);
    }
    if let Some(publish) = publish {
        server = server.with_subscriber(publish);
    }
    let transport = moq_tokio::transport::Session::new(transport);
    let accept = server.accept(std::time::Instant::now(), transport);
    let (session, driver) = tokio::time::timeout(HANDSHAKE, accept).await??;
    tokio::spawn(moq_net::time::run(driver));
    tracing::debug!(%remote, version = %session.version(), "WebTransport session");
    Ok(moq_relay::supervise(session, lease, backend.shutdown, None).await?)
}

/// Checks who asks and for what; a refusal comes with its status and reason.
async fn admit(
    request: &Request,
    remote: std::net::SocketAddr,
    backend: &Backend,
) -> Result<auth::Lease, (StatusCode, String)> {
    let authority = request.url.authority();
    let origins: Vec<_> = request.headers.get_all("origin").iter().collect();
    let origin = match origins[..] {
        [] => None,
        [origin] => Some(origin.to_str().unwrap_or("unreadable")),
        _ => Some("several"),
    };
    let host = Some(authority).filter(|host| !host.is_empty());
    backend
        .check
        .check(host, origin)
        .map_err(|refusal| (StatusCode::FORBIDDEN, refusal.to_string()))?;
    if backend.sessions.full() {
        return Err((StatusCode::SERVICE_UNAVAILABLE, "too many sessions are open".into()));
    }
    let mut ask = backend.auth.request(moq_auth::Transport::Quic, request.url.path());
    ask.query = request.url.query().map(str::to_owned);
    ask.remote = Some(remote);
    backend.auth.admit(ask).await.map_err(|err| {
        let status = match err {
            auth::Error::Unavailable(_) => StatusCode::SERVICE_UNAVAILABLE,
            _ => StatusCode::UNAUTHORIZED,
        };
        (status, err.to_string())
    })
}
