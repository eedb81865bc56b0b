//! A stock relay in front of a server: what many clients read and write through it.

use lumencast_transport::{Announcement, Client, ReadOptions, Transport};
use moq_relay::{Config, Relay, cluster};

use crate::common::{loopback, over, pem, read, serve, step, text};

/// A relay that dials a server and lets everybody in; its certificate's fingerprint, its port and its end.
async fn relay_of(server: std::net::SocketAddr) -> (String, u16, tokio::task::JoinHandle<()>) {
    let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).expect("a certificate");
    let folder = std::env::temp_dir().join(format!("lumencast-relay-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let [cert, key] = ["cert.pem", "key.pem"].map(|name| folder.join(name));
    let chain = pem("CERTIFICATE", made.cert.der());
    std::fs::write(&cert, &chain).expect("written");
    std::fs::write(&key, pem("PRIVATE KEY", &made.signing_key.serialize_der())).expect("written");
    let served = moq_tokio::tls::Certificates::from_pem(chain.as_bytes());
    let fingerprint = served.expect("a certificate").fingerprints().pop().expect("one");

    let mut config = Config::default();
    config.listen.bind = Some("127.0.0.1:0".parse().expect("an address"));
    config.listen.tls.cert = vec![cert];
    config.listen.tls.key = vec![key];
    config.connect.bind = Some("127.0.0.1:0".parse().expect("an address"));
    config.auth.public = vec![moq_auth::Pattern::all()];
    config.cluster.connect = vec![cluster::Peer::new(format!("http://{server}/"))];
    let relay = step("relay", Relay::load(config)).await.expect("a relay").with_signals(false);
    std::fs::remove_dir_all(&folder).expect("removed");
    let port = relay.quic_addr().expect("its address").port();
    let running = tokio::spawn(async move { drop(relay.run().await) });
    (fingerprint, port, running)
}

#[tokio::test]
async fn light_and_edits_pass_a_stock_relay() {
    let server = serve(loopback()).await;
    let broadcast = server.publish("scene").expect("published");
    let mut track = broadcast.track("light", 0).expect("a track");
    broadcast.announce().expect("announced");
    track.write(text("light"), true).expect("written");
    let mut announced = server.announced("scene/edits").expect("watched");

    let (fingerprint, port, relay) = relay_of(server.local_addr()).await;
    let url = format!("https://localhost:{port}/scene");
    let mut clients = Vec::new();
    for name in ["alice", "bob", "carol"] {
        let mut options = over(Transport::Quic);
        options.fingerprint = Some(fingerprint.clone());
        let client = step("connect", Client::connect(&url, options)).await.expect("connected");
        let mut reader = client.subscribe("scene", "light", ReadOptions::default());
        assert_eq!(read(&mut reader).await.bytes, text("light"));

        let edits = client.publish(&format!("scene/edits/{name}")).expect("published");
        let mut edit_track = edits.track("edits", 0).expect("a track");
        edits.announce().expect("announced");
        edit_track.write(text(name), true).expect("written");
        let Some(Announcement::Appeared(appeared)) = step("announced", announced.next()).await
        else {
            panic!("no broadcast appeared");
        };
        assert_eq!(appeared.path(), format!("scene/edits/{name}"));
        let mut reader = appeared.subscribe("edits", ReadOptions::default());
        assert_eq!(read(&mut reader).await.bytes, text(name));
        clients.push((client, edits, edit_track));
    }
    assert_eq!(server.sessions(), 1, "the relay's, for all of them");
    track.write(text("more light"), true).expect("written");
    let mut reader = clients[0].0.subscribe("scene", "light", ReadOptions::default());
    while read(&mut reader).await.bytes != text("more light") {}
    relay.abort();
}
