//! Who is let in, and what rubbish does.

use std::sync::Arc;
use std::time::Duration;

use lumencast_transport::{
    Access, Announcement, Client, Error, Key, ReadOptions, RefusalKind, Server, ServerConfig, Tls,
    Transport,
};
use tokio::io::AsyncWriteExt;
use tokio::net::{TcpStream, UdpSocket};
use web_transport_moq::proto::ConnectRequest;
use web_transport_moq::{http, noq};

use crate::common::{
    address, connect, loopback, over, pem, read, serve, status, step, text, with_token,
};

const UPGRADE: &str = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
    Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
    Sec-WebSocket-Protocol: webtransport, qmux-01.moq-lite-05\r\n";

fn get(path: &str, headers: &str) -> String {
    format!("GET {path} HTTP/1.1\r\nConnection: close\r\n{headers}\r\n")
}

#[tokio::test]
async fn foreign_hosts_and_origins_are_refused_on_http() {
    let server = serve(loopback()).await;
    let port = server.local_addr().port();
    let own = format!("Host: localhost:{port}\r\n");
    let ask = |headers: String| {
        let request = get("/page", &headers);
        let server = &server;
        async move { status(server, &request).await }
    };
    assert_eq!(ask(own.clone()).await, "HTTP/1.1 200 OK");
    assert_eq!(ask(format!("{own}Origin: http://localhost:{port}\r\n")).await, "HTTP/1.1 200 OK");
    for headers in [
        format!("{own}Origin: https://evil.example\r\n"),
        format!("{own}Origin: null\r\n"),
        format!("{own}Origin: http://localhost:{port}\r\nOrigin: https://evil.example\r\n"),
        format!("{own}Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: no-cors\r\n"),
        format!("Host: evil.example:{port}\r\n"),
    ] {
        assert_eq!(ask(headers.clone()).await, "HTTP/1.1 403 Forbidden", "{headers}");
    }
    let fingerprint = get("/certificate.sha256", &format!("{own}Origin: https://evil.example\r\n"));
    assert_eq!(status(&server, &fingerprint).await, "HTTP/1.1 403 Forbidden");
    assert_eq!(status(&server, &get("/elsewhere", &own)).await, "HTTP/1.1 404 Not Found");
}

#[tokio::test]
async fn foreign_hosts_and_origins_are_refused_on_websocket() {
    let server = serve(loopback()).await;
    let port = server.local_addr().port();
    let upgrade = |headers: &str| {
        let request = format!("GET / HTTP/1.1\r\n{UPGRADE}{headers}\r\n");
        let server = &server;
        async move { status(server, &request).await }
    };
    let own = format!("Host: 127.0.0.1:{port}\r\n");
    let switched = "HTTP/1.1 101 Switching Protocols";
    assert_eq!(upgrade(&own).await, switched);
    assert_eq!(upgrade(&format!("{own}Origin: http://127.0.0.1:{port}\r\n")).await, switched);
    for headers in
        [format!("{own}Origin: https://evil.example\r\n"), "Host: evil.example\r\n".into()]
    {
        assert_eq!(upgrade(&headers).await, "HTTP/1.1 403 Forbidden", "{headers}");
    }
    let refusals = server.refusals();
    assert_eq!([RefusalKind::Host, RefusalKind::Origin].map(|kind| refusals.of(kind)), [1, 1]);
    let keyless =
        format!("GET / HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n{own}\r\n");
    assert_eq!(status(&server, &keyless).await, "HTTP/1.1 400 Bad Request");
}

/// What a browser's WebTransport gets that names this host and origin.
async fn web_transport(server: &Server, host: &str, origin: Option<&str>) -> Result<(), String> {
    let url: url::Url = format!("https://{host}/").parse().expect("a URL");
    let mut request = ConnectRequest::new(url);
    if let Some(origin) = origin {
        let value = origin.parse().expect("a header's value");
        request = request.with_header(http::header::ORIGIN, value);
    }
    let session = async {
        let connection = endpoint()
            .connect(server.local_addr(), "localhost")
            .expect("a configuration")
            .await
            .expect("a QUIC connection");
        web_transport_moq::Session::connect(connection, request).await
    };
    step("WebTransport", session).await.map(drop).map_err(|err| err.to_string())
}

/// A QUIC endpoint that takes any server for genuine.
fn endpoint() -> noq::Endpoint {
    let mut tls = moq_tokio::tls::Connect::default();
    tls.insecure = Some(true);
    let mut tls = tls.build().expect("a TLS configuration");
    tls.alpn_protocols = vec![web_transport_moq::ALPN.into()];
    let crypto = noq::crypto::rustls::QuicClientConfig::try_from(tls).expect("TLS 1.3");
    let any = "127.0.0.1:0".parse().expect("an address");
    let endpoint = noq::Endpoint::client(any).expect("an endpoint");
    endpoint.set_default_client_config(noq::ClientConfig::new(Arc::new(crypto)));
    endpoint
}

#[tokio::test]
async fn foreign_hosts_and_origins_are_refused_on_webtransport() {
    let server = serve(loopback()).await;
    let own = format!("localhost:{}", server.local_addr().port());
    for origin in [None, Some(format!("http://{own}"))] {
        assert_eq!(web_transport(&server, &own, origin.as_deref()).await, Ok(()), "{origin:?}");
    }
    for (host, origin) in [
        (own.as_str(), Some("https://evil.example")),
        (own.as_str(), Some("http://127.0.0.2:1")),
        (own.as_str(), Some("null")),
        ("evil.example", None),
    ] {
        let refused = web_transport(&server, host, origin).await.expect_err("refused");
        assert!(refused.contains("403"), "{host} {origin:?}: {refused}");
    }
}

#[tokio::test]
async fn configured_hosts_and_origins_are_let_in() {
    let mut config = loopback();
    config.allowed_hosts.push("light.example".into());
    config.allowed_origins.push("https://studio.example".into());
    let server = serve(config).await;
    let origin = Some("https://studio.example");
    assert_eq!(web_transport(&server, "light.example:4443", origin).await, Ok(()));
}

#[tokio::test]
async fn a_client_publishes_nothing_but_edits() {
    let server = serve(loopback()).await;
    let own = server.publish("scene").expect("published");
    let mut own_track = own.track("light", 0).expect("a track");
    own.announce().expect("announced");
    own_track.write(text("genuine"), true).expect("written");
    let mut announced = server.announced("").expect("watched");

    let client = connect(&server, over(Transport::Quic)).await;
    let mut published = Vec::new();
    // The last is allowed, and so shows that the others had their time.
    for path in ["scene", "other", "scene/light", "other/edit/x", "scene/edits/alice"] {
        let broadcast = client.publish(path).expect("the client does not know");
        let mut track = broadcast.track("light", 0).expect("a track");
        track.write(text("forged"), true).expect("written");
        broadcast.announce().expect("announced");
        published.push((broadcast, track));
    }
    let mut paths = Vec::new();
    while !paths.contains(&"scene/edits/alice".to_owned()) {
        match step("announced", announced.next()).await {
            Some(Announcement::Appeared(appeared)) => paths.push(appeared.path().to_owned()),
            _ => panic!("nothing goes"),
        }
    }
    paths.sort();
    assert_eq!(paths, ["scene/edits/alice"]);

    let other = connect(&server, over(Transport::Quic)).await;
    let mut reader = other.subscribe("scene", "light", ReadOptions::default());
    assert_eq!(read(&mut reader).await.bytes, text("genuine"));
}

fn guarded(to_read: bool) -> (Key, ServerConfig) {
    let key = Key::generate().expect("a key");
    let mut config = loopback();
    config.access = Access::Token { key: key.clone(), to_read };
    (key, config)
}

#[tokio::test]
async fn edits_need_a_token_where_one_is_asked_for() {
    let (key, config) = guarded(false);
    let server = serve(config).await;
    let mut announced = server.announced("scene/edits").expect("watched");
    let publish = |client: &Client, name: &str| {
        let broadcast = client.publish(&format!("scene/edits/{name}")).expect("published");
        broadcast.announce().expect("announced");
        broadcast
    };
    let token = key.issue_token("scene", Some(Duration::from_secs(60))).expect("a token");
    for transport in [Transport::Quic, Transport::WebSocket] {
        let stranger = connect(&server, over(transport)).await;
        let _forged = publish(&stranger, "stranger");
        let mut options = over(transport);
        options.token = Some(token.clone());
        let editor = connect(&server, options).await;
        let genuine = publish(&editor, "editor");
        match step("announced", announced.next()).await {
            Some(Announcement::Appeared(appeared)) => {
                assert_eq!(appeared.path(), "scene/edits/editor");
            }
            _ => panic!("no broadcast appeared"),
        }
        drop((genuine, editor));
        assert!(matches!(step("gone", announced.next()).await, Some(Announcement::Gone { .. })));
    }
}

#[tokio::test]
async fn a_missing_or_wrong_token_is_refused_where_reading_needs_one() {
    let (key, config) = guarded(true);
    let server = serve(config).await;
    let url = address(&server, "http");
    let wrong = Key::generate().and_then(|key| key.issue_token("scene", None)).expect("a token");
    for options in [over(Transport::Quic), with_token("rubbish"), with_token(&wrong)] {
        let refused = step("refused", Client::connect(&url, options)).await;
        let Err(Error::Connect { reason, .. }) = refused else { panic!("not refused") };
        assert!(reason.contains("unauthorized"), "{reason}");
    }
    let token = key.issue_token("scene", None).expect("a token");
    let client = connect(&server, with_token(&token)).await;
    assert_eq!(server.sessions(), 1);
    drop(client);
}

#[tokio::test]
async fn an_expired_token_ends_its_session() {
    let (key, config) = guarded(true);
    let server = serve(config).await;
    let token = key.issue_token("scene", Some(Duration::from_secs(2))).expect("a token");
    let client = connect(&server, with_token(&token)).await;
    let mut state = client.watch_state();
    let lost = state.wait_for(|state| *state != lumencast_transport::ConnectionState::Connected);
    step("ended", lost).await.expect("the client lives");
}

#[tokio::test]
async fn sessions_above_the_limit_are_refused() {
    let mut config = loopback();
    config.max_sessions = 1;
    let server = serve(config).await;
    let first = connect(&server, over(Transport::Quic)).await;
    let mut options = over(Transport::Quic);
    options.timeout = Duration::from_millis(500);
    let refused = step("refused", Client::connect(&address(&server, "http"), options)).await;
    assert!(matches!(refused, Err(Error::Connect { .. })));
    let host = format!("Host: {}\r\n", server.local_addr());
    let upgrade = format!("GET / HTTP/1.1\r\n{UPGRADE}{host}\r\n");
    assert_eq!(status(&server, &upgrade).await, "HTTP/1.1 503 Service Unavailable");
    drop(first);
    connect(&server, over(Transport::Quic)).await;
}

#[tokio::test]
async fn open_access_beyond_loopback_has_to_be_said() {
    let config = ServerConfig::new("0.0.0.0:0".parse().expect("an address"));
    let refused = Server::bind(config, axum::Router::new()).await;
    let Err(err) = refused else { panic!("a server for everyone, unasked") };
    assert!(err.to_string().contains("loopback"), "{err}");
}

#[tokio::test]
async fn certificate_files_serve_quic_and_https() {
    let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).expect("a certificate");
    let pem = pem("CERTIFICATE", made.cert.der());
    let folder = std::env::temp_dir().join(format!("lumencast-transport-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let (cert, key) = (folder.join("cert.pem"), folder.join("key.pem"));
    std::fs::write(&cert, &pem).expect("written");
    let secret = made.signing_key.serialize_der();
    std::fs::write(&key, self::pem("PRIVATE KEY", &secret)).expect("written");

    let mut config = loopback();
    config.tls = Tls::Files { cert, key };
    let server = serve(config).await;
    let broadcast = server.publish("scene").expect("published");
    let mut track = broadcast.track("light", 0).expect("a track");
    broadcast.announce().expect("announced");
    track.write(text("light"), true).expect("written");

    let url = address(&server, "https");
    let served = moq_tokio::tls::Certificates::from_pem(pem.as_bytes()).expect("a certificate");
    for transport in [Transport::Quic, Transport::WebSocket] {
        let mut options = over(transport);
        options.fingerprint = served.fingerprints().pop();
        let client = step("connect", Client::connect(&url, options)).await.expect("connected");
        let mut reader = client.subscribe("scene", "light", ReadOptions::default());
        assert_eq!(read(&mut reader).await.bytes, text("light"));
    }
    let mut stranger = over(Transport::Quic);
    stranger.timeout = Duration::from_millis(500);
    let untrusted = step("refused", Client::connect(&url, stranger)).await;
    assert!(matches!(untrusted, Err(Error::Connect { .. })));
    std::fs::remove_dir_all(&folder).expect("removed");

    let mut config = loopback();
    config.tls = Tls::Files { cert: folder.join("cert.pem"), key: folder.join("key.pem") };
    let missing = Server::bind(config, axum::Router::new()).await;
    let Err(Error::Tls(message)) = missing else { panic!("a server without certificate") };
    assert!(message.contains("cert.pem"), "{message}");
}

#[tokio::test]
async fn rubbish_disturbs_nobody() {
    let server = serve(loopback()).await;
    let broadcast = server.publish("scene").expect("published");
    let mut track = broadcast.track("light", 0).expect("a track");
    broadcast.announce().expect("announced");
    let client = connect(&server, over(Transport::Quic)).await;
    let mut reader = client.subscribe("scene", "light", ReadOptions::default());
    track.write(text("before"), true).expect("written");
    assert_eq!(read(&mut reader).await.bytes, text("before"));

    let address = server.local_addr();
    let udp = UdpSocket::bind("127.0.0.1:0").await.expect("a socket");
    // A generator of rubbish that is the same each time (Numerical Recipes' constants).
    let mut state = 1u32;
    let mut rubbish = |length: usize| -> Vec<u8> {
        let mut byte = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        (0..length).map(|_| byte()).collect()
    };
    for length in (0..1400).step_by(7) {
        let mut packet = rubbish(length);
        if let Some(first) = packet.first_mut() {
            // Every other one looks like the first packet of a QUIC version 1 connection.
            *first |= 0xc0 * u8::from(length % 2 == 0);
        }
        if packet.len() > 5 && length % 2 == 0 {
            packet[1..5].copy_from_slice(&[0, 0, 0, 1]);
        }
        udp.send_to(&packet, address).await.expect("sent");
    }
    for length in [1, 100, 100_000] {
        let mut tcp = TcpStream::connect(address).await.expect("a connection");
        // The server may close it while we write.
        let _ = tcp.write_all(&rubbish(length)).await;
    }
    for start in ["\r\n\r\n", "GET", "GET / HTTP/9.9\r\n\r\n", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"] {
        let mut tcp = TcpStream::connect(address).await.expect("a connection");
        let _ = tcp.write_all(start.as_bytes()).await;
    }
    // A WebSocket that speaks no MoQ.
    let mut tcp = TcpStream::connect(address).await.expect("a connection");
    let upgrade = format!("GET / HTTP/1.1\r\n{UPGRADE}Host: {address}\r\n\r\n");
    tcp.write_all(upgrade.as_bytes()).await.expect("sent");
    let _ = tcp.write_all(&rubbish(5000)).await;

    track.write(text("after"), false).expect("written");
    assert_eq!(read(&mut reader).await.bytes, text("after"));
    let newcomer = connect(&server, over(Transport::WebSocket)).await;
    let mut reader = newcomer.subscribe("scene", "light", ReadOptions::default());
    assert_eq!(read(&mut reader).await.bytes, text("before"));
}

/// Two sessions under one name come apart: neither takes the other's place.
#[tokio::test]
async fn a_name_that_two_publish_is_two_broadcasts() {
    let server = serve(loopback()).await;
    let mut announced = server.announced("scene/edits").expect("watched");
    let mut publishing = Vec::new();
    let mut appeared = Vec::new();
    for (transport, words) in [(Transport::Quic, "first"), (Transport::WebSocket, "second")] {
        let client = connect(&server, over(transport)).await;
        let broadcast = client.publish("scene/edits/alice").expect("published");
        let mut track = broadcast.track("edits", 0).expect("a track");
        broadcast.announce().expect("announced");
        track.write(text(words), true).expect("written");
        let Some(Announcement::Appeared(one)) = step("announced", announced.next()).await else {
            panic!("no broadcast appeared");
        };
        assert_eq!(one.path(), "scene/edits/alice");
        appeared.push((one.session(), one.subscribe("edits", ReadOptions::default()), words));
        publishing.push((client, broadcast, track));
    }
    assert_ne!(appeared[0].0, appeared[1].0);
    for (_, reader, words) in &mut appeared {
        assert_eq!(read(reader).await.bytes, text(words));
    }
    let first = appeared[0].0;
    drop(publishing.remove(0));
    match step("gone", announced.next()).await {
        Some(Announcement::Gone { session, path }) => {
            assert_eq!((session, path.as_str()), (first, "scene/edits/alice"));
        }
        _ => panic!("nobody else comes or goes"),
    }
}

#[tokio::test]
async fn a_session_under_too_many_names_is_closed() {
    let mut config = loopback();
    config.max_names = 2;
    let server = serve(config).await;
    let honest = connect(&server, over(Transport::Quic)).await;
    let greedy = connect(&server, over(Transport::Quic)).await;
    let publish = |client: &Client, name: &str| {
        let broadcast = client.publish(&format!("scene/edits/{name}")).expect("published");
        broadcast.announce().expect("announced");
        broadcast
    };
    let _own = [publish(&honest, "a"), publish(&honest, "b")];
    let mut state = greedy.watch_state();
    let _too_many = [publish(&greedy, "a"), publish(&greedy, "c"), publish(&greedy, "d")];
    let lost = state.wait_for(|state| *state != lumencast_transport::ConnectionState::Connected);
    step("closed", lost).await.expect("the client lives");
    assert_eq!(server.refusals().of(RefusalKind::Names), 1);
    assert_eq!(honest.state(), lumencast_transport::ConnectionState::Connected);

    let long = connect(&server, over(Transport::Quic)).await;
    let mut state = long.watch_state();
    let _long = publish(&long, &"x".repeat(300));
    let lost = state.wait_for(|state| *state != lumencast_transport::ConnectionState::Connected);
    step("closed", lost).await.expect("the client lives");
}
