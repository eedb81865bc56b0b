//! The TCP side of the server: HTTP, or HTTPS where there are certificate files.

use std::net::SocketAddr;
use std::time::Duration;

use axum::body::Body;
use hyper::service::service_fn;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio_rustls::TlsAcceptor;

use crate::error::Failure;
use crate::http::Front;
use crate::peer::{Peer, stats};
use crate::progress::Progress;
use crate::rarely::Rarely;
use crate::refusals::RefusalKind;
use crate::session::HANDSHAKE;
#[cfg(target_os = "linux")]
use crate::unsent;

/// Wait after a connection could not be accepted, usually for lack of file descriptors.
const PAUSE: Duration = Duration::from_millis(50);

/// Greatest number of bytes that a connection buffers for its client.
const HTTP1_BUFFER: usize = 128 << 10;
/// The same for each HTTP/2 stream, and the greatest number of streams.
const HTTP2_BUFFER: usize = 64 << 10;
const HTTP2_STREAMS: u32 = 32;

/// Accepts connections until the future is dropped.
pub(crate) async fn serve(listener: TcpListener, tls: Option<TlsAcceptor>, front: Front) {
    let (mut failed, mut full) = (Rarely::default(), Rarely::default());
    loop {
        match listener.accept().await {
            Ok((stream, remote)) => {
                let Some(guest) = front.connections.enter(remote.ip()) else {
                    front.backend.sessions.refusals.count(RefusalKind::Connections);
                    if let Some(times) = full.now() {
                        tracing::warn!(%remote, times, "connection refused: too many are open");
                    }
                    continue;
                };
                let (tls, front) = (tls.clone(), front.clone());
                tokio::spawn(async move {
                    let _guest = guest;
                    if let Err(err) = connection(stream, remote, tls, front).await {
                        tracing::debug!(%remote, %err, "TCP connection ended");
                    }
                });
            }
            Err(err) => {
                if let Some(times) = failed.now() {
                    tracing::warn!(%err, times, "cannot accept TCP connections");
                }
                tokio::time::sleep(PAUSE).await;
            }
        }
    }
}

async fn connection(
    stream: TcpStream,
    remote: SocketAddr,
    tls: Option<TlsAcceptor>,
    front: Front,
) -> Result<(), Failure> {
    // Otherwise the end of each frame would wait until the client has acknowledged its beginning.
    stream.set_nodelay(true)?;
    let peer = Peer { remote, stats: stats(&stream) };
    #[cfg(target_os = "linux")]
    let stream = unsent::Limited::new(stream)?;
    match tls {
        Some(tls) => {
            let stream = tokio::time::timeout(HANDSHAKE, tls.accept(stream)).await??;
            http(stream, peer, front).await
        }
        None => http(stream, peer, front).await,
    }
}

async fn http<S>(stream: S, peer: Peer, front: Front) -> Result<(), Failure>
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let mut shutdown = front.backend.shutdown.clone();
    let progress = Progress::new(front.patience);
    let asked = progress.clone();
    let service = service_fn(move |request: hyper::Request<hyper::body::Incoming>| {
        let (front, peer, progress) = (front.clone(), peer.clone(), asked.clone());
        async move {
            let answer = front.answer(request.map(Body::new), peer, &progress).await;
            Ok::<_, std::convert::Infallible>(answer)
        }
    });
    let mut builder = auto::Builder::new(TokioExecutor::new());
    builder
        .http1()
        .timer(TokioTimer::new())
        .header_read_timeout(HANDSHAKE)
        .max_buf_size(HTTP1_BUFFER);
    builder.http2().max_concurrent_streams(HTTP2_STREAMS).max_send_buf_size(HTTP2_BUFFER);
    let connection = builder.serve_connection_with_upgrades(TokioIo::new(stream), service);
    let mut connection = std::pin::pin!(connection);
    let served = async {
        tokio::select! {
            ended = connection.as_mut() => ended,
            () = shutdown.started() => {
                connection.as_mut().graceful_shutdown();
                connection.await
            }
        }
    };
    tokio::select! {
        ended = served => ended,
        () = progress.stalled() => Err("it stands still".into()),
    }
}
