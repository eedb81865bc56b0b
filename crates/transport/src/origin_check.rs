//! Checks which hosts and web origins a request names.
//!
//! Any web page may open a connection to `localhost`, and any name may resolve to it (DNS
//! rebinding). So every request on HTTP, WebSocket and WebTransport must name a host of this
//! server. Where a browser says which page asks (`Origin`), the page must be of this server. A
//! server on loopback also accepts other pages of this machine, such as those of development
//! servers. Native clients send no `Origin`; the host and [`Access`](crate::Access) judge them.

use std::net::{IpAddr, SocketAddr};

use axum::http::header::{self, HeaderName};

use crate::refusals::RefusalKind;

/// Why a request is refused. Its sender gets the text with status 403.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Refusal {
    #[error("the request names no host")]
    NoHost,
    #[error(
        "the host {0:?} is not this server's; to accept it, start the server with --allow-host"
    )]
    ForeignHost(String),
    #[error(
        "the origin {0:?} is not this server's; to accept it, start the server with --allow-origin"
    )]
    ForeignOrigin(String),
    #[error("a page of another site asks without naming its origin")]
    CrossSite,
    #[error("the header {0} is not one readable value")]
    Unreadable(HeaderName),
}

impl Refusal {
    pub(crate) fn kind(&self) -> RefusalKind {
        match self {
            Self::NoHost | Self::ForeignHost(_) => RefusalKind::Host,
            Self::Unreadable(name) if *name == header::HOST => RefusalKind::Host,
            Self::ForeignOrigin(_) | Self::CrossSite | Self::Unreadable(_) => RefusalKind::Origin,
        }
    }
}

/// The hosts and origins of one server.
#[derive(Debug, Clone)]
pub(crate) struct OriginCheck {
    /// Whether only this machine reaches the server.
    is_local: bool,
    port: u16,
    hosts: Vec<String>,
    origins: Vec<String>,
}

impl OriginCheck {
    /// A check for a server at `address`. It also accepts `hosts` (names without port) and pages of
    /// `origins` (`scheme://host[:port]`).
    pub(crate) fn new(address: SocketAddr, hosts: &[String], origins: &[String]) -> Self {
        let lower = |list: &[String]| list.iter().map(|item| item.to_ascii_lowercase()).collect();
        let (is_local, port) = (address.ip().is_loopback(), address.port());
        Self { is_local, port, hosts: lower(hosts), origins: lower(origins) }
    }

    /// Checks a request by its `Host` (or `:authority`) and by its `Origin` where there is one.
    pub(crate) fn check(&self, host: Option<&str>, origin: Option<&str>) -> Result<(), Refusal> {
        let authority = host.ok_or(Refusal::NoHost)?.to_ascii_lowercase();
        if !self.is_own_host(host_of(&authority)) {
            return Err(Refusal::ForeignHost(authority));
        }
        match origin.map(str::to_ascii_lowercase) {
            Some(origin) if !self.is_own_origin(&origin, &authority) => {
                Err(Refusal::ForeignOrigin(origin))
            }
            _ => Ok(()),
        }
    }

    /// Whether a host name is safe from rebinding. Address literals are not resolved, so they are.
    /// Of other names only loopback names and configured ones are accepted.
    fn is_own_host(&self, host: &str) -> bool {
        is_loopback_name(host)
            || literal(host).is_some()
            || self.hosts.iter().any(|own| own == host)
    }

    /// Whether a page is of this server or a trusted one. It is if it came from the authority that
    /// it asks, or from loopback at the server's port, which nobody else can hold. Where the server
    /// is on loopback, any port of loopback will do.
    fn is_own_origin(&self, origin: &str, authority: &str) -> bool {
        if self.origins.iter().any(|allowed| allowed == origin) {
            return true;
        }
        let Some((scheme, rest)) = origin.split_once("://") else { return false };
        let default_port = match scheme {
            "http" => 80,
            "https" => 443,
            _ => return false,
        };
        let own_port = || port_of(rest).unwrap_or(default_port) == self.port;
        let loopback = is_loopback_origin(rest) && (self.is_local || own_port());
        rest == authority || loopback
    }
}

/// The host in `host[:port]`, with an IPv6 literal's brackets removed.
fn host_of(authority: &str) -> &str {
    if let Some(rest) = authority.strip_prefix('[') {
        return rest.split(']').next().unwrap_or(rest);
    }
    authority.split(':').next().unwrap_or(authority)
}

/// The port in `host[:port]`.
fn port_of(authority: &str) -> Option<u16> {
    authority.rsplit_once(':').and_then(|(_, port)| port.parse().ok())
}

fn literal(host: &str) -> Option<IpAddr> {
    host.parse().ok()
}

fn is_loopback_name(host: &str) -> bool {
    host == "localhost" || host.ends_with(".localhost")
}

/// Whether an origin without its scheme is `localhost`, `127.0.0.1` or `[::1]`, with or without
/// port. On other addresses such as 127.0.0.2 the same port may be somebody else's.
fn is_loopback_origin(rest: &str) -> bool {
    let host = host_of(rest);
    let port = port_of(rest).map_or(String::new(), |port| format!(":{port}"));
    let whole = |host: &str| rest == format!("{host}{port}");
    let is_address = ["127.0.0.1", "[::1]"].into_iter().any(whole);
    is_address || (is_loopback_name(host) && whole(host))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check() -> OriginCheck {
        OriginCheck::new(
            "127.0.0.1:4443".parse().expect("an address"),
            &["light.example".into()],
            &["https://studio.example".into()],
        )
    }

    #[test]
    fn own_hosts_pass_and_others_do_not() {
        for host in ["localhost:4443", "LOCALHOST", "127.0.0.1:4443", "[::1]:4443", "light.example"]
        {
            assert_eq!(check().check(Some(host), None), Ok(()), "{host}");
        }
        for host in ["evil.example:4443", "localhost.evil.example", "light.example.evil", ""] {
            assert!(
                matches!(check().check(Some(host), None), Err(Refusal::ForeignHost(_))),
                "{host}"
            );
        }
        assert_eq!(check().check(None, None), Err(Refusal::NoHost));
    }

    #[test]
    fn only_own_pages_pass() {
        let local = Some("localhost:4443");
        for origin in [
            "http://localhost:4443",
            "http://127.0.0.1:4443",
            "http://[::1]:4443",
            "http://localhost:5173",
            "http://127.0.0.1:8080",
            "http://app.localhost:3000",
            "http://localhost",
            "https://studio.example",
        ] {
            assert_eq!(check().check(local, Some(origin)), Ok(()), "{origin}");
        }
        for origin in [
            "https://evil.example",
            "http://127.0.0.2:4443",
            "http://localhost:5173:80",
            "http://localhost:evil",
            "http://6.6.6.6:4443",
            "http://localhost:4443@evil.example",
            "http://localhost:4443.evil.example",
            "null",
            "file://",
            "",
        ] {
            assert!(
                matches!(check().check(local, Some(origin)), Err(Refusal::ForeignOrigin(_))),
                "{origin}"
            );
        }
    }

    #[test]
    fn of_a_server_for_others_only_its_own_port_is_local() {
        let address = "0.0.0.0:4443".parse().expect("an address");
        let check = OriginCheck::new(address, &[], &[]);
        let ask = |origin| check.check(Some("localhost:4443"), Some(origin));
        assert_eq!(ask("http://localhost:4443"), Ok(()));
        assert!(ask("http://localhost:5173").is_err() && ask("http://127.0.0.2:4443").is_err());
    }

    #[test]
    fn a_page_may_ask_the_address_it_came_from() {
        let lan = Some("192.168.1.5:4443");
        assert_eq!(check().check(lan, Some("http://192.168.1.5:4443")), Ok(()));
        assert!(check().check(lan, Some("http://192.168.1.6:4443")).is_err());
    }
}
