//! The names that sessions publish under, each session in a part of the origin of its own.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use moq_net::{announce, origin};
use moq_relay::auth;

use crate::error::Failure;

/// Bytes of a name, with the scene's.
const LONGEST: usize = 256;

/// Where sessions publish: each under its own number, so that none comes in the way of another.
#[derive(Clone)]
pub(crate) struct Names {
    origin: origin::Producer,
    next: Arc<AtomicU64>,
    /// How many names a session may have at a time.
    most: usize,
}

impl Names {
    /// An origin beside that of the server's own broadcasts, with which it shares its cache.
    pub(crate) fn beside(own: &origin::Producer, most: usize) -> Self {
        let origin = moq_tokio::origin::spawn_config(own.config());
        Self { origin, next: Arc::default(), most }
    }

    pub(crate) fn consume(&self) -> origin::Consumer {
        self.origin.consume()
    }

    /// Where one session publishes what its token allows; `None` where that is nothing.
    pub(crate) fn of_session(&self, token: &auth::Token) -> Option<origin::Producer> {
        let number = self.next.fetch_add(1, Ordering::Relaxed).to_string();
        let root = moq_net::Path::new(&number).join(&token.root).to_owned();
        self.origin.scope(root, &token.publish).ok()
    }

    /// Counts what a session announces; ends with the reason for closing it.
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
