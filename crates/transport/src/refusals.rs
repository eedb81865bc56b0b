//! Counts of refusals by reason.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Why a connection, a request or a session was refused, or a session closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefusalKind {
    /// The host is not the server's.
    Host,
    /// The page's origin is not allowed, or is missing.
    Origin,
    /// The token is missing, wrong or expired.
    Token,
    /// There are too many TCP connections.
    Connections,
    /// There are too many requests being answered.
    Requests,
    /// There are too many sessions.
    Sessions,
    /// A session has too many names, or a name that is too long.
    Names,
}

impl RefusalKind {
    /// All kinds.
    pub const ALL: [Self; 7] = [
        Self::Host,
        Self::Origin,
        Self::Token,
        Self::Connections,
        Self::Requests,
        Self::Sessions,
        Self::Names,
    ];

    /// A word for the kind, for logs and metrics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Host => "host",
            Self::Origin => "origin",
            Self::Token => "token",
            Self::Connections => "connections",
            Self::Requests => "requests",
            Self::Sessions => "sessions",
            Self::Names => "names",
        }
    }
}

/// Counts of refusals since the start; clones share them.
#[derive(Clone, Debug, Default)]
pub struct Refusals(Arc<[AtomicU64; RefusalKind::ALL.len()]>);

impl Refusals {
    pub(crate) fn count(&self, kind: RefusalKind) {
        self.0[kind as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// Number of refusals of this kind.
    pub fn of(&self, kind: RefusalKind) -> u64 {
        self.0[kind as usize].load(Ordering::Relaxed)
    }
}
