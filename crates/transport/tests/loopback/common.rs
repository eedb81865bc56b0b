//! What the tests of a running server share.

use std::future::Future;
use std::time::Duration;

use axum::Router;
use axum::routing::get;
use base64::Engine as _;
use bytes::Bytes;
use lumencast_transport::{
    Client, ConnectOptions, Frame, Server, ServerConfig, TrackReader, Transport,
};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

/// A step that takes longer has failed.
pub(crate) const STEP: Duration = Duration::from_secs(120);

/// Runs a step of a test within its time.
pub(crate) async fn step<T>(name: &str, work: impl Future<Output = T>) -> T {
    tokio::time::timeout(STEP, work).await.unwrap_or_else(|_| panic!("{name}: out of time"))
}

pub(crate) fn loopback() -> ServerConfig {
    ServerConfig::new("127.0.0.1:0".parse().expect("an address"))
}

pub(crate) async fn serve(config: ServerConfig) -> Server {
    let page = Router::new().route("/page", get(|| async { "the page" }));
    step("bind", Server::bind(config, page)).await.expect("a server")
}

pub(crate) fn address(server: &Server, scheme: &str) -> String {
    format!("{scheme}://{}/scene", server.local_addr())
}

pub(crate) fn over(transport: Transport) -> ConnectOptions {
    let mut options = ConnectOptions::default();
    options.transport = transport;
    options
}

pub(crate) fn with_token(token: &str) -> ConnectOptions {
    let mut options = over(Transport::Quic);
    options.token = Some(token.to_owned());
    options
}

pub(crate) async fn connect(server: &Server, options: ConnectOptions) -> Client {
    let address = address(server, "http");
    step("connect", Client::connect(&address, options)).await.expect("a connection")
}

/// The next frame of a track that has one.
pub(crate) async fn read(reader: &mut TrackReader) -> Frame {
    let frame = step("read", reader.next()).await.expect("no error");
    frame.expect("the track goes on")
}

pub(crate) fn text(text: &str) -> Bytes {
    Bytes::copy_from_slice(text.as_bytes())
}

/// Sends a request as it stands and returns the first line of the answer.
pub(crate) async fn status(server: &Server, request: &str) -> String {
    let exchange = async {
        let mut stream = TcpStream::connect(server.local_addr()).await.expect("a connection");
        stream.write_all(request.as_bytes()).await.expect("sent");
        let mut answer = vec![0; 4096];
        let length = stream.read(&mut answer).await.unwrap_or(0);
        let answer = String::from_utf8_lossy(&answer[..length]).into_owned();
        answer.lines().next().unwrap_or_default().to_owned()
    };
    step("HTTP", exchange).await
}

pub(crate) fn pem(label: &str, der: &[u8]) -> String {
    let base64 = base64::engine::general_purpose::STANDARD.encode(der);
    format!("-----BEGIN {label}-----\n{base64}\n-----END {label}-----\n")
}
