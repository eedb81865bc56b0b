//! A server that goes and comes back.

use crate::common::{connect, loopback, over, read, serve, step, text};
use lumencast_transport::{
    Broadcast, ConnectionState, ReadOptions, Server, ServerConfig, TrackWriter, Transport,
};
use std::time::Duration;

use axum::Router;
use axum::routing::get;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

async fn start(config: ServerConfig) -> (Server, Broadcast, TrackWriter) {
    let server = serve(config).await;
    let broadcast = server.publish("scene").expect("published");
    let track = broadcast.track("light", 0).expect("a track");
    broadcast.announce().expect("announced");
    (server, broadcast, track)
}

async fn a_reader_recovers(transport: Transport) {
    let (server, broadcast, mut track) = start(loopback()).await;
    let listen = server.local_addr();
    let client = connect(&server, over(transport)).await;
    let mut reader = client.subscribe("scene", "light", ReadOptions::default());
    track.write(text("before"), true).expect("written");
    let before = read(&mut reader).await;

    step("shutdown", server.shutdown(Duration::from_secs(2))).await;
    drop((broadcast, track));
    let mut state = client.watch_state();
    step("lost", state.wait_for(|state| *state != ConnectionState::Connected))
        .await
        .expect("the client lives");

    let (_server, _broadcast, mut track) = start(ServerConfig::new(listen)).await;
    track.write(text("after"), true).expect("written");
    let after = read(&mut reader).await;
    assert_eq!(after.bytes, text("after"));
    assert!(after.group > before.group, "a restarted server's groups are newer");
    assert_eq!(client.state(), ConnectionState::Connected);
}

#[tokio::test]
async fn a_reader_recovers_over_quic() {
    a_reader_recovers(Transport::Quic).await;
}

#[tokio::test]
async fn a_reader_recovers_over_websocket() {
    a_reader_recovers(Transport::WebSocket).await;
}

/// An answer that is under way when the server stops is read to its end.
#[tokio::test]
async fn a_download_ends_before_the_server_does() {
    /// More than the kernel takes in advance.
    const LENGTH: usize = 64 << 20;
    let large = Router::new().route("/large", get(|| async { vec![b'x'; LENGTH] }));
    let server = step("bind", Server::bind(loopback(), large)).await.expect("a server");
    let mut stream = TcpStream::connect(server.local_addr()).await.expect("a connection");
    stream.write_all(b"GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n").await.expect("sent");
    let mut first = [0; 16];
    step("the beginning", stream.read_exact(&mut first)).await.expect("an answer");
    let stopping = tokio::spawn(server.shutdown(Duration::from_secs(5)));
    tokio::time::sleep(Duration::from_millis(100)).await;
    let mut rest = Vec::new();
    step("the rest", stream.read_to_end(&mut rest)).await.expect("read");
    assert!(rest.len() > LENGTH && rest.ends_with(b"xx"), "{} bytes", rest.len());
    step("shutdown", stopping).await.expect("stopped");
}

#[tokio::test]
async fn a_clients_own_broadcast_comes_back_with_it() {
    let (server, broadcast, track) = start(loopback()).await;
    let listen = server.local_addr();
    let client = connect(&server, over(Transport::Quic)).await;
    let edits = client.publish("scene/edits/alice").expect("published");
    let mut edits_track = edits.track("edits", 0).expect("a track");
    edits.announce().expect("announced");
    step("shutdown", server.shutdown(Duration::from_secs(2))).await;
    drop((broadcast, track));

    let (server, _broadcast, _track) = start(ServerConfig::new(listen)).await;
    let mut announced = server.announced("scene/edits").expect("watched");
    let appeared = match step("announced again", announced.next()).await {
        Some(lumencast_transport::Announcement::Appeared(appeared)) => appeared,
        _ => panic!("no broadcast appeared"),
    };
    let mut reader = appeared.subscribe("edits", ReadOptions::default());
    edits_track.write(text("again"), true).expect("written");
    assert_eq!(read(&mut reader).await.bytes, text("again"));
}

#[tokio::test]
async fn a_port_in_use_is_named() {
    let server = serve(loopback()).await;
    let taken = ServerConfig::new(server.local_addr());
    let Err(err) = lumencast_transport::Server::bind(taken, axum::Router::new()).await else {
        panic!("a second server took the same port");
    };
    let port = server.local_addr().port().to_string();
    let message = err.to_string();
    assert!(message.contains(&port) && message.contains("choose another port"), "{message}");

    let tcp = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let taken = ServerConfig::new(tcp.local_addr().expect("its address"));
    let Err(err) = lumencast_transport::Server::bind(taken, axum::Router::new()).await else {
        panic!("a server took a TCP port in use");
    };
    assert!(err.to_string().contains("TCP"), "{err}");
}
