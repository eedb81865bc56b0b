//! File descriptors: how many there are, and what they are for.

use std::io;

use crate::ServerConfig;

/// Number of descriptors for everything else in the process: sockets, log, files that it reads.
const OTHERS: usize = 64;

/// Advice for when descriptors are used up.
pub(crate) const ADVICE: &str =
    "the process has as many files open as it may: raise the limit (ulimit -n)";

/// Number of connections that a server may hold open for HTTP. It is the configured number, reduced
/// where its sessions and the files that it sends need the descriptors.
pub(crate) fn connections(config: &ServerConfig) -> usize {
    let kept = OTHERS + config.max_sessions + config.max_requests;
    let most = limit().map_or(usize::MAX, |limit| limit.saturating_sub(kept));
    if most < config.max_connections {
        tracing::info!(connections = most, "few file descriptors: fewer connections; {ADVICE}");
    }
    config.max_connections.min(most)
}

/// Whether an error means that the process or the machine has no descriptor left.
pub(crate) fn are_used_up(error: &io::Error) -> bool {
    // ENFILE and EMFILE have the same numbers on all Unix systems.
    cfg!(unix) && matches!(error.raw_os_error(), Some(23 | 24))
}

/// Number of descriptors that this process may have.
#[cfg(unix)]
fn limit() -> Option<usize> {
    let limit = rustix::process::getrlimit(rustix::process::Resource::Nofile).current?;
    usize::try_from(limit).ok()
}

#[cfg(not(unix))]
fn limit() -> Option<usize> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_leave_descriptors_for_the_rest() {
        let mut config = ServerConfig::new("127.0.0.1:0".parse().expect("an address"));
        config.max_connections = 8;
        assert_eq!(connections(&config), 8);
        config.max_connections = usize::MAX;
        config.max_sessions = 100;
        let fewer = connections(&config);
        config.max_sessions = 101;
        assert_eq!(connections(&config), fewer - usize::from(limit().is_some()));
    }

    #[test]
    fn the_system_says_when_they_are_used_up() {
        assert_eq!(are_used_up(&io::Error::from_raw_os_error(24)), cfg!(unix));
        assert!(!are_used_up(&io::Error::from(io::ErrorKind::AddrInUse)));
    }
}
