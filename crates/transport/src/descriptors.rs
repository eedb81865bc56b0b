//! How many file descriptors there are, and for what.

use std::io;

use crate::ServerConfig;

/// What else a process needs: its sockets, its log, files that it reads.
const OTHERS: usize = 64;

/// What to do when they are used up.
pub(crate) const ADVICE: &str =
    "the process has as many files open as it may: raise the limit (ulimit -n)";

/// How many connections a server may hold open for HTTP: as many as it is set to, and no more than
/// leave descriptors for its sessions and the files that it sends.
pub(crate) fn connections(config: &ServerConfig) -> usize {
    let kept = OTHERS + config.max_sessions + config.max_requests;
    let most = limit().map_or(usize::MAX, |limit| limit.saturating_sub(kept));
    if most < config.max_connections {
        tracing::info!(connections = most, "few file descriptors: fewer connections; {ADVICE}");
    }
    config.max_connections.min(most)
}

/// Whether an error says that there are none left, in this process or on this machine.
pub(crate) fn are_used_up(error: &io::Error) -> bool {
    // EMFILE and ENFILE, alike on all systems of the kind.
    cfg!(unix) && matches!(error.raw_os_error(), Some(23 | 24))
}

/// Descriptors that this process may have.
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
