//! The TCP side of the server: HTTP, with TLS where there are certificate files.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use hyper::service::service_fn;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio_rustls::TlsAcceptor;

use crate::access::Ticket;
use crate::http::Front;
use crate::session::{Failure, HANDSHAKE};
#[cfg(target_os = "linux")]
use crate::unsent;

/// How long to wait after a connection could not be accepted, which is usually for want of file
/// descriptors.
const PAUSE: Duration = Duration::from_millis(50);

/// Who is at the other end of a TCP connection.
#[derive(Clone)]
pub(crate) struct Peer {
    pub(crate) remote: SocketAddr,
    /// What the kernel knows of the connection, for the estimate of its bandwidth.
    pub(crate) stats: Option<qmux::SharedSocketStats>,
}

/// Accepts connections until it is dropped.
pub(crate) async fn serve(listener: TcpListener, tls: Option<TlsAcceptor>, front: Front) {
    loop {
        match listener.accept().await {
            Ok((stream, remote)) => {
                let (tls, front) = (tls.clone(), front.clone());
                tokio::spawn(async move {
                    let _counted = Ticket::of(&front.connections);
                    if let Err(err) = connection(stream, remote, tls, front).await {
                        tracing::debug!(%remote, %err, "TCP connection ended");
                    }
                });
            }
            Err(err) => {
                tracing::warn!(%err, "cannot accept a TCP connection");
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
    // Else the end of each frame waits until the client has acknowledged its beginning.
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
    let service = service_fn(move |request: hyper::Request<hyper::body::Incoming>| {
        let (front, peer) = (front.clone(), peer.clone());
        async move {
            Ok::<_, std::convert::Infallible>(front.answer(request.map(Body::new), peer).await)
        }
    });
    let mut builder = auto::Builder::new(TokioExecutor::new());
    builder.http1().timer(TokioTimer::new()).header_read_timeout(HANDSHAKE);
    let connection = builder.serve_connection_with_upgrades(TokioIo::new(stream), service);
    let mut connection = std::pin::pin!(connection);
    tokio::select! {
        ended = connection.as_mut() => ended,
        () = shutdown.started() => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    }
}

#[cfg(unix)]
fn stats(stream: &TcpStream) -> Option<qmux::SharedSocketStats> {
    qmux::TcpStats::new(stream).ok().map(|stats| Arc::new(stats) as _)
}

#[cfg(not(unix))]
fn stats(_: &TcpStream) -> Option<qmux::SharedSocketStats> {
    None
}
