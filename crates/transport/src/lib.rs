//! Frames of bytes over Media over QUIC: a server, clients, and nothing about what they carry.
//!
//! This is the only crate with sockets, and the only one that knows the MoQ crates, whose
//! interfaces still move. A server holds an embedded relay; stock relays may stand in front of it.
//!
//! What is sent has four levels. A *broadcast* has a path (`sponza`) and holds *tracks*, each named
//! and read on its own. A track is a sequence of *groups*, a group a sequence of *frames*. Frames of
//! a group arrive whole, in order and without gaps; groups may be skipped. So a group begins with
//! what can be understood without the past. A group that is being sent gives way to a newer one:
//! with one frame a group, a link slower than the stream would carry almost nothing whole. About ten
//! frames a group, several tracks with graded priorities and fewer tracks on a slower link do.
//!
//! ```
//! use lumencast_transport::{Client, ConnectOptions, ReadOptions, Server, ServerConfig};
//!
//! # #[tokio::main]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let config = ServerConfig::new("127.0.0.1:0".parse()?);
//! let server = Server::bind(config, axum::Router::new()).await?;
//! let broadcast = server.publish("sponza")?;
//! let mut track = broadcast.track("catalog", 0)?;
//! broadcast.announce()?;
//! track.write(bytes::Bytes::from_static(b"light"), true)?;
//!
//! let address = format!("http://{}/sponza", server.local_addr());
//! let client = Client::connect(&address, ConnectOptions::default()).await?;
//! let mut reader = client.subscribe(client.scene(), "catalog", ReadOptions::default());
//! let frame = reader.next().await?.ok_or("the track ended")?;
//! assert_eq!(&frame.bytes[..], b"light");
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]

mod access;
mod broadcast;
mod client;
mod descriptors;
mod error;
mod fetch;
mod guests;
mod http;
mod in_order;
mod listen;
mod names;
mod origin_check;
mod peer;
mod progress;
mod quic;
mod rarely;
mod reader;
mod refusals;
mod server;
mod session;
mod tcp;
mod tls;
#[cfg(target_os = "linux")]
mod unsent;
mod websocket;

use std::time::Duration;

pub use access::{Access, Key};
pub use broadcast::{Broadcast, TrackWriter};
pub use client::{Client, ConnectOptions, ConnectionState, Transport, take_scene};
pub use error::{Error, Result};
pub use fetch::{Fetch, Fetched};
pub use progress::Patience;
pub use rarely::Rarely;
pub use reader::{Announcement, Announcements, Frame, ReadOptions, RemoteBroadcast, TrackReader};
pub use refusals::{RefusalKind, Refusals};
pub use server::{Server, ServerConfig};
pub use tls::Tls;

/// A QUIC connection that is silent for so long is dead. With [`KEEP_ALIVE`], a client knows of its
/// server's death within five seconds, also through a relay (13.6 s with the usual 30 and 10).
const IDLE_TIMEOUT: Duration = Duration::from_secs(3);

/// How often a connection with nothing to say shows that it lives.
const KEEP_ALIVE: Duration = Duration::from_secs(1);
