//! Who was refused, counted by why.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Why a connection, a request or a session was refused, or a session closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefusalKind {
    /// A host that is not the server's.
    Host,
    /// A page of an origin that is not the server's, or of none.
    Origin,
    /// A token that is missing, wrong or expired.
    Token,
    /// Too many TCP connections.
    Connections,
    /// Too many requests under way.
    Requests,
    /// Too many sessions.
    Sessions,
    /// A session with too many names, or too long ones.
    Names,
}

impl RefusalKind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Host,
        Self::Origin,
        Self::Token,
        Self::Connections,
        Self::Requests,
        Self::Sessions,
        Self::Names,
    ];

    /// A word for it.
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

/// Counts since the start; copies count together.
#[derive(Clone, Debug, Default)]
pub struct Refusals(Arc<[AtomicU64; RefusalKind::ALL.len()]>);

impl Refusals {
    pub(crate) fn count(&self, kind: RefusalKind) {
        self.0[kind as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// How often somebody was refused for this.
    pub fn of(&self, kind: RefusalKind) -> u64 {
        self.0[kind as usize].load(Ordering::Relaxed)
    }
}
