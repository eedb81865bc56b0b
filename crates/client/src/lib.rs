//! A native client: connects to a server's scene, and keeps its light and its scene up to date.
//!
//! A [`Session`] reads a scene's tracks into a [`Cache`](lumencast_cache::Cache), near regions before far
//! ones, and goes on by itself after a lost connection. A [`Replica`] is the scene itself, downloaded
//! from the server, following the edits and the time that the session tells of.
//!
//! ```no_run
//! use std::time::Instant;
//!
//! use glam::Vec3;
//! use lumencast_client::{Session, SessionOptions};
//!
//! # async fn example() -> Result<(), Box<dyn std::error::Error>> {
//! let address = "http://127.0.0.1:4443/sponza";
//! let session = Session::connect(address, SessionOptions::default()).await?;
//! let irradiance = session.light(Instant::now(), |light| light.irradiance(Vec3::Y, Vec3::Y));
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]

mod download;
mod error;
mod plan;
mod replica;
mod resources;
mod session;
mod statistics;

pub use download::{SceneFiles, current_tick, download};
pub use error::ClientError;
pub use replica::Replica;
pub use session::{Session, SessionOptions};
pub use statistics::Statistics;
