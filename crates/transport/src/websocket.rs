//! WebSocket sessions: the same streams as over QUIC, multiplexed over one TCP connection.

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use hyper::upgrade::OnUpgrade;
use hyper_util::rt::TokioIo;
use qmux::ws::tokio_tungstenite::WebSocketStream;
use qmux::ws::tungstenite::handshake;
use qmux::ws::tungstenite::protocol::{Role, WebSocketConfig};

use crate::error::Failure;
use crate::in_order;
use crate::peer::Peer;
use crate::session::{Admitted, Ask, Backend, MAX_STREAMS};

/// Largest message, bytes: a record or frame of 16 KiB with its header.
const MESSAGE: usize = 17 << 10;
/// Size of each session's read buffer, bytes.
const READ_BUFFER: usize = 16 << 10;

/// Whether a request asks for a WebSocket.
pub(crate) fn is_upgrade(headers: &HeaderMap) -> bool {
    let upgrade = headers.get(header::UPGRADE).and_then(|value| value.to_str().ok());
    upgrade.is_some_and(|value| value.eq_ignore_ascii_case("websocket"))
}

/// Answers a request for a WebSocket and serves its session. The request must have passed the check
/// of hosts and origins.
pub(crate) async fn upgrade(mut request: Request, peer: Peer, backend: Backend) -> Response {
    let Some(protocol) = protocol(request.headers()) else {
        return refuse(StatusCode::BAD_REQUEST, "no protocol in common");
    };
    let on_upgrade = hyper::upgrade::on(&mut request);
    let (parts, _) = request.into_parts();
    let path_and_query = parts.uri.clone();
    let response = handshake::server::create_response(&Request::from_parts(parts, ()));
    let Ok(mut response) = response else {
        return refuse(StatusCode::BAD_REQUEST, "not a WebSocket handshake");
    };
    let ask = Ask {
        transport: moq_auth::Transport::WebSocket,
        path: path_and_query.path(),
        query: path_and_query.query(),
        remote: peer.remote,
    };
    let admitted = match backend.admit(ask).await {
        Ok(admitted) => admitted,
        Err((status, reason)) => {
            tracing::info!(remote = %peer.remote, %status, %reason, "WebSocket session refused");
            return refuse(status, &reason);
        }
    };
    let Ok(value) = HeaderValue::from_str(&protocol) else {
        return refuse(StatusCode::INTERNAL_SERVER_ERROR, "unspeakable protocol");
    };
    response.headers_mut().insert(header::SEC_WEBSOCKET_PROTOCOL, value);
    tokio::spawn(async move {
        let remote = peer.remote;
        if let Err(err) = session(on_upgrade, protocol, peer, backend, admitted).await {
            tracing::debug!(%remote, %err, "WebSocket session ended");
        }
    });
    response.map(|()| Body::empty())
}

async fn session(
    on_upgrade: OnUpgrade,
    protocol: String,
    peer: Peer,
    backend: Backend,
    admitted: Admitted,
) -> Result<(), Failure> {
    let (io, taken) = in_order::Socket::new(TokioIo::new(on_upgrade.await?));
    let limits = WebSocketConfig::default()
        .read_buffer_size(READ_BUFFER)
        .max_message_size(Some(MESSAGE))
        .max_frame_size(Some(MESSAGE));
    let socket = WebSocketStream::from_raw_socket(io, Role::Server, Some(limits)).await;
    let mut config = qmux::Config::default();
    config.max_streams_bidi = MAX_STREAMS.into();
    config.max_streams_uni = MAX_STREAMS.into();
    let mut upgraded = qmux::ws::Upgraded::new(socket)
        .with_alpn(&protocol)
        .with_session_config(config)
        // A peer that vanishes sends no end. QUIC has an idle timeout for this; here keep-alives
        // detect it.
        .with_keep_alive(qmux::ws::KeepAlive::default());
    if let Some(stats) = peer.stats {
        upgraded = upgraded.with_socket_stats(stats);
    }
    backend.serve(in_order::Session::new(upgraded.accept(), taken), admitted).await
}

/// The first of the server's protocols that the client offers: a MoQ version with a framing.
/// Versions other than moq-lite use the newer framing only.
fn protocol(headers: &HeaderMap) -> Option<String> {
    let offers = headers.get_all(header::SEC_WEBSOCKET_PROTOCOL).iter();
    let offers: Vec<&str> = offers
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(',').map(str::trim))
        .collect();
    let versions = moq_net::Versions::all().alpns();
    let ours = versions.iter().flat_map(|version| {
        let framings = [qmux::Version::QMux01, qmux::Version::QMux00];
        let allowed = if version.starts_with("moq-lite") { 2 } else { 1 };
        framings
            .into_iter()
            .take(allowed)
            .map(move |framing| format!("{}{version}", framing.prefix()))
    });
    ours.into_iter().find(|name| offers.contains(&name.as_str()))
}

fn refuse(status: StatusCode, reason: &str) -> Response {
    (status, format!("{reason}\n")).into_response()
}
