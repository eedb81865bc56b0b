//! Names that sessions publish under; each session has its own part of the origin.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use moq_net::{announce, origin};
use moq_relay::auth;

use crate::error::Failure;

/// Largest size of a name in bytes, including the scene's.
const LONGEST: usize = 256;

/// The origin for sessions. Each publishes under its own number, so that none interferes with
/// another.
#[derive(Clone)]
pub(crate) struct Names {
    origin: origin::Producer,
    next: Arc<AtomicU64>,
    /// Greatest number of names of a session at a time.
    most: usize,
}

impl Names {
    /// An origin beside that of the server's own broadcasts; the two share a cache.
    pub(crate) fn beside(own: &origin::Producer, most: usize) -> Self {
        let origin = moq_tokio::origin::spawn_config(own.config());
        Self { origin, next: Arc::default(), most }
    }

    pub(crate) fn consume(&self) -> origin::Consumer {
        self.origin.consume()
    }

    /// The part of the origin for one session, limited to what its token allows; `None` where that
    /// is nothing.
    pub(crate) fn of_session(&self, token: &auth::Token) -> Option<origin::Producer> {
        let number = self.next.fetch_add(1, Ordering::Relaxed).to_string();
        let root = moq_net::Path::new(&number).join(&token.root).to_owned();
        self.origin.scope(root, &token.publish).ok()
    }

    /// Counts the names of a session; returns the reason for closing the session when there is one.
    pub(crate) async fn watch(&self, published: &origin::Producer) -> Failure {
        let mut announced = published.consume().announced();
        let mut count = 0;
        while let Some(update) = announced.next().await {
            match update.kind {
                announce::Kind::Announced => count += 1,
                announce::Kind::Updated => {}
                announce::Kind::Retracted => count -= 1,
            }
            if count > self.most {
                return format!("it publishes under more than {} names", self.most).into();
            }
            if update.prefix.as_str().len() > LONGEST {
                return format!("it publishes under a name of more than {LONGEST} bytes").into();
            }
        }
        std::future::pending().await
    }
}
