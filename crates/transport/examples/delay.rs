//! How long a frame takes from the server to a client on this machine.
//!
//! `cargo run --release -p lumencast-transport --example delay [BYTES [FRAMES]]` sends frames of that
//! size (64 KiB) at 25 Hz, ten a group, over QUIC and over WebSocket, and prints the median and the
//! 99th percentile of the time from `write` to the reader's having the whole frame.
#![expect(clippy::print_stdout, reason = "it is what a measurement is for")]

use std::time::{Duration, Instant};

use bytes::Bytes;
use lumencast_transport::{
    Client, ConnectOptions, Error, ReadOptions, Server, ServerConfig, Transport,
};

const RATE: f64 = 25.0;
const FRAMES_A_GROUP: u64 = 10;
/// Frames at the start that do not count: the connection is still finding its speed.
const WARM_UP: usize = 25;

#[tokio::main]
async fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1).map(|argument| argument.parse::<usize>());
    let mut number = |default| arguments.next().and_then(Result::ok).unwrap_or(default);
    let (bytes, frames) = (number(64 << 10).max(8), number(1000).max(1));
    println!("{bytes} bytes at {RATE} Hz, {frames} frames");
    for transport in [Transport::Quic, Transport::WebSocket] {
        let mut delays = measure(transport, bytes, WARM_UP + frames).await?.split_off(WARM_UP);
        delays.sort_unstable();
        let percentile = |part: f64| delays[((delays.len() - 1) as f64 * part).round() as usize];
        println!(
            "{transport:?}: median {:.2} ms, p99 {:.2} ms",
            percentile(0.5).as_secs_f64() * 1e3,
            percentile(0.99).as_secs_f64() * 1e3
        );
    }
    Ok(())
}

/// The delay of each frame.
async fn measure(
    transport: Transport,
    bytes: usize,
    frames: usize,
) -> Result<Vec<Duration>, Error> {
    let listen = std::net::SocketAddr::from(([127, 0, 0, 1], 0));
    let server = Server::bind(ServerConfig::new(listen), axum::Router::new()).await?;
    let broadcast = server.publish("scene")?;
    let mut track = broadcast.track("light", 0)?;
    broadcast.announce()?;
    let mut options = ConnectOptions::default();
    options.transport = transport;
    let address = format!("http://{}/scene", server.local_addr());
    let client = Client::connect(&address, options).await?;
    let mut reader = client.subscribe("scene", "light", ReadOptions::default());

    let start = Instant::now();
    let writing = tokio::spawn(async move {
        while !track.is_used() {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        let mut ticks = tokio::time::interval(Duration::from_secs_f64(1.0 / RATE));
        for number in 0.. {
            ticks.tick().await;
            let mut frame = vec![0; bytes];
            frame[..8].copy_from_slice(&(start.elapsed().as_nanos() as u64).to_le_bytes());
            if track.write(Bytes::from(frame), number % FRAMES_A_GROUP == 0).is_err() {
                break;
            }
        }
    });
    let mut delays = Vec::with_capacity(frames);
    while delays.len() < frames {
        let frame = reader.next().await?.ok_or(Error::Closed)?;
        let arrived = start.elapsed();
        if let Some(sent) = frame.bytes.first_chunk() {
            delays.push(arrived.saturating_sub(Duration::from_nanos(u64::from_le_bytes(*sent))));
        }
    }
    writing.abort();
    server.shutdown(Duration::from_secs(1)).await;
    Ok(delays)
}
