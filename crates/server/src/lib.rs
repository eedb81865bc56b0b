//! The server: a scene's light, computed tick by tick and cast to its clients.
//!
//! A [`Tick`] is the whole way of the data in one function, [`Tick::step`]: edits, animation,
//! acceleration structure, gather, encode, publish. It has no socket, no thread and no clock, so a
//! program (or a test) may step it by hand. A [`Server`] puts the network around it: it keeps the
//! rate, reads clients' edits, and serves the page, the scene's files and the metrics.

#![forbid(unsafe_code)]

mod bake;
mod contents;
mod edits;
mod error;
mod field;
mod files;
mod gather_options;
mod http;
mod inbox;
mod loader;
mod media_type;
mod metrics;
mod names;
mod noise;
mod open_file;
mod pace;
mod page;
mod placement;
mod publish;
mod report;
mod server;
mod surfaces;
mod temporary;
mod tick;
mod walls;

pub use bake::{Baked, Done, Effort, bake};
pub use error::ServerError;
pub use gather_options::{FitOptions, GatherOptions};
pub use inbox::{Inbox, Limits, Mail, Received, Verdict};
pub use metrics::Metrics;
pub use pace::{Beat, Budget, SampleRange};
pub use page::is_embedded as page_is_embedded;
pub use placement::{Survey, default_volume, survey, volumes};
pub use publish::Outlet;
pub use report::{Report, Stage};
pub use server::{Server, ServerConfig};
pub use tick::{Tick, TickOptions};
