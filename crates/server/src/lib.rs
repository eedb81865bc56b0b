//! The server: a scene's light, computed tick by tick and cast to its clients.
//!
//! A [`Tick`] is the whole way of the data in one function, [`Tick::step`]: edits, animation,
//! acceleration structure, gather, encode, publish. It has no socket, no thread and no clock, so a
//! program (or a test) may step it by hand. A [`Server`] puts the network around it: it keeps the
//! rate, reads clients' edits, and serves the page, the scene's files and the metrics.

#![forbid(unsafe_code)]

mod contents;
mod edits;
mod error;
mod files;
mod gathering;
mod http;
mod inbox;
mod loader;
mod media_type;
mod metrics;
mod names;
mod open_file;
mod pace;
mod page;
mod publish;
mod published;
mod report;
mod resources;
mod server;
mod temporary;
mod tick;
mod unwrapping;

pub use error::ServerError;
pub use inbox::{Inbox, Limits, Mail, Received, Verdict};
pub use metrics::Metrics;
pub use pace::{Beat, Budget, SampleRange};
pub use page::is_embedded as page_is_embedded;
pub use publish::Outlet;
pub use report::{Report, Stage};
pub use server::{Server, ServerConfig};
pub use tick::{Tick, TickOptions};
