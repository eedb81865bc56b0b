//! The UDP side of the server: WebTransport sessions.
//!
//! The relay's own listener answers a CONNECT before anyone can check its `Origin`, and does not
//! pass on its headers. So this accept loop replaces it: it checks host, origin and access before
//! it answers.

use std::net::SocketAddr;
use std::time::Duration;

use axum::http::StatusCode;
use web_transport_moq::{Request, noq, proto};

use crate::error::Failure;
use crate::session::{Admitted, Ask, Backend, HANDSHAKE};

/// Longest time that a refused client may take to receive the answer.
const ANSWER: Duration = Duration::from_secs(1);

/// Accepts connections until the endpoint is closed.
pub(crate) async fn serve(endpoint: noq::Endpoint, backend: Backend) {
    while let Some(incoming) = endpoint.accept().await {
        let backend = backend.clone();
        tokio::spawn(async move {
            let remote = incoming.remote_address();
            if let Err(err) = connection(incoming, backend).await {
                tracing::debug!(%remote, %err, "QUIC connection ended");
            }
        });
    }
}

/// Serves one connection, from its first packet to its end.
async fn connection(incoming: noq::Incoming, backend: Backend) -> Result<(), Failure> {
    let remote = incoming.remote_address();
    let request = tokio::time::timeout(HANDSHAKE, async {
        let connection = incoming.accept()?.await?;
        Ok::<_, Failure>(Request::accept(connection).await?)
    });
    let request = request.await??;
    let admitted = match admit(&request, remote, &backend).await {
        Ok(admitted) => admitted,
        Err((status, reason)) => {
            tracing::info!(%remote, %status, %reason, "WebTransport session refused");
            let connection = request.conn().clone();
            request.reject(status).await?;
            // Dropping the connection at once would overtake the answer.
            let _ = tokio::time::timeout(ANSWER, connection.closed()).await;
            return Ok(());
        }
    };
    let alpns = moq_net::Versions::all().alpns();
    let mut response = proto::ConnectResponse::OK;
    if let Some(protocol) = request.protocols.iter().find(|name| alpns.contains(&name.as_str())) {
        response = response.with_protocol(protocol);
    }
    let transport = request.respond(response).await?;
    backend.serve(transport, admitted).await
}

/// Checks a session's request; a refusal has a status and a reason.
async fn admit(
    request: &Request,
    remote: SocketAddr,
    backend: &Backend,
) -> Result<Admitted, (StatusCode, String)> {
    let origins: Vec<_> = request.headers.get_all("origin").iter().collect();
    let origin = match origins[..] {
        [] => None,
        [origin] => Some(origin.to_str().unwrap_or("unreadable")),
        _ => Some("several"),
    };
    let host = Some(request.url.authority()).filter(|host| !host.is_empty());
    backend.check.check(host, origin).map_err(|refusal| {
        backend.refuse(refusal.kind(), remote, &refusal.to_string());
        (StatusCode::FORBIDDEN, refusal.to_string())
    })?;
    let transport = moq_auth::Transport::Quic;
    let (path, query) = (request.url.path(), request.url.query());
    backend.admit(Ask { transport, path, query, remote }).await
}
