//! Frames from a server to its clients and back, through the real relay on loopback.

use crate::common::{connect, loopback, over, read, serve, step, text};
use lumencast_transport::{Announcement, Error, ReadOptions, Transport};
use std::time::Duration;

async fn frames_arrive_in_order(transport: Transport) {
    let server = serve(loopback()).await;
    let broadcast = server.publish("scene").expect("published");
    let mut track = broadcast.track("light", 1).expect("a track");
    broadcast.announce().expect("announced");

    let client = connect(&server, over(transport)).await;
    assert_eq!(client.scene(), "scene");
    assert_eq!(server.sessions(), 1);
    let mut reader = client.subscribe("scene", "light", ReadOptions::default().with_priority(7));

    track.write(text("0"), true).expect("written");
    let first = read(&mut reader).await;
    assert_eq!((first.index, &first.bytes[..]), (0, &b"0"[..]));
    assert!(track.is_used());
    for number in 1..5 {
        track.write(text(&number.to_string()), false).expect("written");
        let frame = read(&mut reader).await;
        assert_eq!((frame.group, frame.index), (first.group, number));
        assert_eq!(frame.bytes, text(&number.to_string()));
    }
    let large = vec![42; 300_000];
    track.write(large.clone().into(), true).expect("written");
    let next = read(&mut reader).await;
    assert_eq!((next.index, &next.bytes[..]), (0, &large[..]));
    assert!(next.group > first.group);

    drop(reader);
    step("unused", async {
        while track.is_used() {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    })
    .await;
}

#[tokio::test]
async fn over_quic() {
    frames_arrive_in_order(Transport::Quic).await;
}

#[tokio::test]
async fn over_websocket() {
    frames_arrive_in_order(Transport::WebSocket).await;
}

#[tokio::test]
async fn a_late_reader_begins_with_the_newest_group() {
    let server = serve(loopback()).await;
    let broadcast = server.publish("scene").expect("published");
    let mut track = broadcast.track("light", 0).expect("a track");
    broadcast.announce().expect("announced");
    for (frame, new_group) in [("old", true), ("key", true), ("delta", false)] {
        track.write(text(frame), new_group).expect("written");
    }
    for transport in [Transport::Quic, Transport::WebSocket] {
        let client = connect(&server, over(transport)).await;
        let mut reader = client.subscribe("scene", "light", ReadOptions::default());
        let key = read(&mut reader).await;
        assert_eq!((key.index, key.bytes), (0, text("key")));
        let delta = read(&mut reader).await;
        assert_eq!((delta.index, delta.bytes), (1, text("delta")));
    }
}

#[tokio::test]
async fn a_reader_waits_for_broadcast_and_track() {
    let server = serve(loopback()).await;
    let client = connect(&server, over(Transport::Quic)).await;
    let mut reader = client.subscribe("scene", "light", ReadOptions::default());
    let reading = tokio::spawn(async move { read(&mut reader).await });
    tokio::time::sleep(Duration::from_millis(100)).await;
    let broadcast = server.publish("scene").expect("published");
    broadcast.announce().expect("announced");
    tokio::time::sleep(Duration::from_millis(300)).await;
    let mut track = broadcast.track("light", 0).expect("a track");
    track.write(text("at last"), true).expect("written");
    assert_eq!(step("first frame", reading).await.expect("read").bytes, text("at last"));
}

#[tokio::test]
async fn two_clients_read_the_same() {
    let server = serve(loopback()).await;
    let broadcast = server.publish("scene").expect("published");
    let mut track = broadcast.track("light", 0).expect("a track");
    broadcast.announce().expect("announced");
    let quic = connect(&server, over(Transport::Quic)).await;
    let websocket = connect(&server, over(Transport::WebSocket)).await;
    assert_eq!(server.sessions(), 2);
    let mut readers = [&quic, &websocket]
        .map(|client| client.subscribe("scene", "light", ReadOptions::default()));
    track.write(text("key"), true).expect("written");
    for reader in &mut readers {
        assert_eq!(read(reader).await.bytes, text("key"));
    }
    drop(quic);
    track.write(text("delta"), false).expect("written");
    assert_eq!(read(&mut readers[1]).await.bytes, text("delta"));
    step("one session left", async {
        while server.sessions() != 1 {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    })
    .await;
}

async fn edits_reach_the_server(transport: Transport) {
    let server = serve(loopback()).await;
    let mut announced = server.announced("scene/edits").expect("watched");
    let client = connect(&server, over(transport)).await;
    let broadcast = client.publish("scene/edits/alice").expect("published");
    let mut track = broadcast.track("edits", 0).expect("a track");
    broadcast.announce().expect("announced");

    let appeared = match step("announced", announced.next()).await {
        Some(Announcement::Appeared(appeared)) => appeared,
        _ => panic!("no broadcast appeared"),
    };
    assert_eq!(appeared.path(), "scene/edits/alice");
    let options = ReadOptions::default().with_max_frame(1000).with_max_age(Duration::from_secs(5));
    let mut reader = appeared.subscribe("edits", options);
    for edit in ["one", "two"] {
        track.write(text(edit), edit == "one").expect("written");
        assert_eq!(read(&mut reader).await.bytes, text(edit));
    }
    track.write(vec![0; 1001].into(), true).expect("written");
    let refused = step("large", reader.next()).await;
    assert!(matches!(refused, Err(Error::FrameTooLarge { size: 1001, limit: 1000, .. })));
    for (edit, new_group) in [("three", false), ("four", true)] {
        track.write(text(edit), new_group).expect("written");
        assert_eq!(read(&mut reader).await.bytes, text(edit), "after the one that was too large");
    }

    drop((track, broadcast, client));
    assert!(matches!(step("end", reader.next()).await, Ok(None)));
    match step("gone", announced.next()).await {
        Some(Announcement::Gone { path, .. }) => assert_eq!(path, "scene/edits/alice"),
        _ => panic!("the broadcast stayed"),
    }
}

#[tokio::test]
async fn edits_reach_the_server_over_quic() {
    edits_reach_the_server(Transport::Quic).await;
}

#[tokio::test]
async fn edits_reach_the_server_over_websocket() {
    edits_reach_the_server(Transport::WebSocket).await;
}
