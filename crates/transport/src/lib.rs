//! Frames of bytes over Media over QUIC: a server and clients. The crate knows nothing of the
//! content.
//!
//! It is the only crate with sockets. It is also the only one that uses the MoQ crates, whose
//! interfaces still change. A server holds an embedded relay; stock relays may stand in front of
//! it.
//!
//! Data has four levels. A *broadcast* has a path (`sponza`) and holds *tracks*, each with a name
//! and readers of its own. A track is a sequence of *groups*, a group a sequence of *frames*.
//! Frames of a group arrive whole, in order and without gaps. Readers may skip groups, so a group
//! must be understandable without earlier ones.
//!
//! A newer group interrupts one that is being sent. With one frame a group, a link slower than the
//! stream would carry almost no group whole. The remedies are about ten frames a group, several
//! tracks with graded priorities, and fewer tracks on a slower link.
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

/// A QUIC connection that is silent for this long is dead. With [`KEEP_ALIVE`] a client learns of
/// its server's death within five seconds, also through a relay. With the usual 30 and 10 seconds
/// it takes 13.6.
const IDLE_TIMEOUT: Duration = Duration::from_secs(3);

/// Interval at which an idle connection shows that it is alive.
const KEEP_ALIVE: Duration = Duration::from_secs(1);
