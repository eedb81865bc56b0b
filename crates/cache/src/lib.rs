//! Order, loss, staleness and blending of received light: what a client knows, without a socket, a
//! thread or a clock.
//!
//! ```
//! use lumencast_cache::Cache;
//! # use lumencast_codec::{Catalog, Epoch, SceneInfo};
//! # let scene = SceneInfo { name: "room".into(), root: "room.glb".into() };
//! # let catalog = Catalog { epoch: Epoch(1), scene, tick_seconds: 0.04, fields: vec![], unknown: vec![] }.encode();
//! let mut cache = Cache::of_client("me");
//! cache.add_catalog(&catalog, 0.0)?; // bytes of the tracks, as they come, with the time
//! let light = cache.light(0.02); // at any time
//! assert_eq!(light.age, None); // nothing has come yet
//! # Ok::<(), lumencast_cache::CacheError>(())
//! ```

#![forbid(unsafe_code)]

mod cache;
mod clock;
mod edits;
mod error;
mod field;
mod handover;
mod lightmap;
mod newest;
mod passage;
mod received;
mod region;
mod resources;
mod tile;
mod volume;

pub use cache::{Cache, CurrentLight};
pub use edits::SceneEvent;
pub use error::CacheError;
pub use received::Received;
