//! Clients that hold on to what they do not use. Nothing is timed: the server's patience is short, and
//! whoever waits for it to end waits for long.

use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::Request;
use axum::response::IntoResponse;
use axum::routing::get;
use bytes::Bytes;
use hyper_util::rt::{TokioExecutor, TokioIo};
use lumencast_transport::{Patience, Server, ServerConfig, Transport};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::common::{connect, loopback, over, status, step};

const SHORT: Duration = Duration::from_millis(200);
const LONG: Duration = Duration::from_secs(600);
/// More than sockets and buffers hold.
const LARGE: usize = 64 << 20;

fn patience(first_request: Duration, idle: Duration, stalled: Duration) -> Patience {
    let mut patience = Patience::default();
    (patience.first_request, patience.idle, patience.stalled) = (first_request, idle, stalled);
    patience
}

async fn serve(config: ServerConfig) -> Server {
    let large = || async { Bytes::from(vec![0; LARGE]).into_response() };
    let application =
        Router::new().route("/page", get(|| async { "the page" })).route("/large", get(large));
    step("bind", Server::bind(config, application)).await.expect("a server")
}

fn ask(server: &Server, path: &str) -> String {
    format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", server.local_addr())
}

async fn open(server: &Server) -> TcpStream {
    TcpStream::connect(server.local_addr()).await.expect("a connection")
}

/// Waits until so many connections are open.
async fn until_open(server: &Server, connections: usize) {
    let counted = async {
        while server.connections() != connections {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    step(&format!("{connections} connections"), counted).await;
}

async fn is_served(server: &Server) {
    assert_eq!(status(server, &ask(server, "/page")).await, "HTTP/1.1 200 OK");
}

#[tokio::test]
async fn silent_connections_end_before_and_after_a_request() {
    for says in [String::new(), "GET /pa".into(), "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".into()] {
        let mut config = loopback();
        config.patience = patience(SHORT, LONG, LONG);
        let server = serve(config).await;
        let mut stream = open(&server).await;
        stream.write_all(says.as_bytes()).await.expect("sent");
        let mut answer = Vec::new();
        let _ = step("closed", stream.read_to_end(&mut answer)).await;
        until_open(&server, 0).await;
    }
    let mut config = loopback();
    config.patience = patience(LONG, SHORT, LONG);
    let server = serve(config).await;
    let mut stream = open(&server).await;
    stream.write_all(ask(&server, "/page").as_bytes()).await.expect("sent");
    let mut answer = Vec::new();
    step("closed", stream.read_to_end(&mut answer)).await.expect("an end");
    assert!(answer.ends_with(b"the page"));
}

#[tokio::test]
async fn a_reader_that_does_not_read_is_dropped() {
    let mut config = loopback();
    config.patience = patience(LONG, LONG, SHORT);
    let server = serve(config).await;
    let mut lazy = open(&server).await;
    lazy.write_all(ask(&server, "/large").as_bytes()).await.expect("sent");
    until_open(&server, 1).await;
    until_open(&server, 0).await;

    // One that asks for more and more over HTTP/2, and takes nothing.
    let stream = TokioIo::new(open(&server).await);
    let (mut sender, connection) = hyper::client::conn::http2::Builder::new(TokioExecutor::new())
        .initial_stream_window_size(1 << 16)
        .handshake::<_, Body>(stream)
        .await
        .expect("HTTP/2");
    let client = tokio::spawn(connection);
    let uri = format!("http://{}/large", server.local_addr());
    let mut answers = Vec::new();
    for _ in 0..8 {
        let request = Request::get(&uri).body(Body::empty()).expect("a request");
        let answer = step("answer", sender.send_request(request)).await.expect("an answer");
        assert_eq!(answer.status(), 200);
        answers.push(answer);
    }
    until_open(&server, 0).await;
    let _ = step("ended", client).await;
}

#[tokio::test]
async fn one_address_takes_half_of_the_connections_and_requests() {
    let mut config = loopback();
    config.max_connections = 8;
    config.patience = patience(LONG, LONG, LONG);
    let server = serve(config).await;
    let mut held = Vec::new();
    for count in 1..=4 {
        held.push(open(&server).await);
        until_open(&server, count).await;
    }
    let mut fifth = open(&server).await;
    let read = step("refused", fifth.read(&mut [0; 16])).await;
    assert!(matches!(read, Ok(0) | Err(_)), "closed without a word");
    let mut stream = held.pop().expect("one of four");
    stream.write_all(ask(&server, "/page").as_bytes()).await.expect("sent");
    let mut answer = [0; 12];
    step("answered", stream.read_exact(&mut answer)).await.expect("an answer");
    assert_eq!(&answer, b"HTTP/1.1 200");
    drop((held, stream));
    until_open(&server, 0).await;
    is_served(&server).await;

    let mut config = loopback();
    config.max_requests = 4;
    config.patience = patience(LONG, LONG, LONG);
    let server = serve(config).await;
    let mut lazy = Vec::new();
    for _ in 0..2 {
        let mut stream = open(&server).await;
        stream.write_all(ask(&server, "/large").as_bytes()).await.expect("sent");
        step("begun", stream.read_exact(&mut [0; 16])).await.expect("an answer");
        lazy.push(stream);
    }
    assert_eq!(status(&server, &ask(&server, "/page")).await, "HTTP/1.1 503 Service Unavailable");
    drop(lazy);
    // The server learns of it when it writes next.
    let served = async {
        while status(&server, &ask(&server, "/page")).await != "HTTP/1.1 200 OK" {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    step("served again", served).await;
}

/// A message of which more is announced than the protocol needs.
#[tokio::test]
async fn a_websocket_message_that_is_too_long_ends_its_session() {
    let server = serve(loopback()).await;
    let upgrade = format!(
        "GET / HTTP/1.1\r\nHost: {}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
         Sec-WebSocket-Protocol: qmux-01.moq-lite-05\r\n\r\n",
        server.local_addr()
    );
    // One frame that is too long, and a message of many that are not.
    let frame = |first: u8, length: u32| {
        let mut frame = vec![first, 0x80 | 127];
        frame.extend(u64::from(length).to_be_bytes());
        frame.extend([0; 4]);
        frame
    };
    let one = frame(0x82, 1 << 24);
    let parts = (0..5).flat_map(|part| {
        let mut bytes = frame(if part == 0 { 0x02 } else { 0x00 }, 1 << 12);
        bytes.extend([0; 1 << 12]);
        bytes
    });
    for message in [one, parts.collect()] {
        let mut stream = open(&server).await;
        stream.write_all(upgrade.as_bytes()).await.expect("sent");
        step("switched", stream.read_exact(&mut [0; 64])).await.expect("an answer");
        // It may end while it is being written.
        let _ = stream.write_all(&message).await;
        let _ = step("closed", stream.read_to_end(&mut Vec::new())).await;
    }
    connect(&server, over(Transport::WebSocket)).await;
}
