//! Access: who may read and who may edit.
//!
//! Names are slash-separated paths. The server's broadcasts have one part (`sponza`). A client may
//! publish only `<one part>/edits/<one part>`, whatever its token says.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use moq_auth::{Algorithm, Claims, Grant, Pattern, Patterns, Request, lease};
use moq_relay::auth::{Admission, Admissions};

use crate::refusals::{RefusalKind, Refusals};
use crate::{Error, Result};

/// The names that anyone may read: the server's own broadcasts.
const READABLE: &str = "*";
/// The names that clients may publish at most.
const EDITABLE: &str = "*/edits/*";

/// Rules of who may read the server's broadcasts, and who may publish edits.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub enum Access {
    /// Everyone on this machine may read and edit. The check of hosts and origins keeps web pages
    /// of others out. A server with this access listens on loopback only.
    #[default]
    Loopback,
    /// Whoever reaches the server may read and edit.
    Open,
    /// Publishing needs a token signed by `key`: a JWT in the URL's query, `?jwt=…`.
    Token {
        /// The key that tokens must be signed with.
        key: Key,
        /// Whether reading tracks needs a token too. Answers of the application over HTTP need
        /// none.
        to_read: bool,
    },
}

/// A key that signs and verifies tokens (HMAC-SHA256 as a JSON Web Key).
#[derive(Clone)]
pub struct Key(Arc<moq_auth::Key>);

impl std::fmt::Debug for Key {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Key(…)")
    }
}

impl Key {
    /// Generates a random key.
    ///
    /// # Errors
    /// [`Error::Key`] where no key can be made.
    pub fn generate() -> Result<Self> {
        let key = moq_auth::Key::generate(Algorithm::HS256, None).map_err(key_error)?;
        Ok(Self(Arc::new(key)))
    }

    /// Reads a key from a file that [`Key::write`] or `moq auth generate` wrote.
    ///
    /// # Errors
    /// [`Error::Key`] where the file cannot be read or holds no key.
    pub fn read(path: &Path) -> Result<Self> {
        let key = moq_auth::Key::from_file(path)
            .map_err(|err| Error::Key(format!("{}: {err}", path.display())))?;
        Ok(Self(Arc::new(key)))
    }

    /// Writes the key to a file, which only its owner should be able to read.
    ///
    /// # Errors
    /// [`Error::Key`] where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        self.0.to_file(path).map_err(|err| Error::Key(format!("{}: {err}", path.display())))
    }

    /// Issues a token whose bearer may read `scene` and publish edits to it. It expires after
    /// `lifetime`, which also closes an open session; `None` means never.
    ///
    /// # Errors
    /// [`Error::Key`] where `scene` is not a valid path, or signing fails.
    pub fn issue_token(&self, scene: &str, lifetime: Option<Duration>) -> Result<String> {
        let pattern =
            |text: &str| text.parse::<Pattern>().map_err(|err| Error::Key(err.to_string()));
        let claims = Claims::default()
            .with_subscribe([pattern(scene)?])
            .with_publish([pattern(&format!("{scene}/edits/*"))?])
            .with_issued(SystemTime::now())
            .with_expires(lifetime.map(|lifetime| SystemTime::now() + lifetime));
        self.0.sign(&claims).map_err(key_error)
    }
}

fn key_error(err: impl std::fmt::Display) -> Error {
    Error::Key(err.to_string())
}

/// The number of open sessions, their limit, and refusals.
#[derive(Debug, Clone)]
pub(crate) struct Sessions {
    open: Arc<AtomicUsize>,
    limit: usize,
    pub(crate) refusals: Refusals,
    /// Names of the server's own broadcasts.
    pub(crate) scenes: Arc<Mutex<BTreeSet<String>>>,
}

impl Sessions {
    pub(crate) fn new(limit: usize) -> Self {
        Self { open: Arc::default(), limit, refusals: Refusals::default(), scenes: Arc::default() }
    }

    pub(crate) fn count(&self) -> usize {
        self.open.load(Ordering::Relaxed)
    }

    pub(crate) fn full(&self) -> bool {
        self.count() >= self.limit
    }

    /// Root of the names of a session that dialled this path. It is a broadcast of this server, or
    /// empty where a proxy has the server under another path.
    fn root_of(&self, path: &str) -> String {
        let scenes = self.scenes.lock().unwrap_or_else(PoisonError::into_inner);
        scenes.get(path.trim_matches('/')).cloned().unwrap_or_default()
    }

    /// Counts a session until the ticket is dropped; `None` where there are too many.
    fn admit(&self) -> Option<Ticket> {
        let below = |open| (open < self.limit).then_some(open + 1);
        let counted = self.open.fetch_update(Ordering::Relaxed, Ordering::Relaxed, below);
        counted.is_ok().then(|| Ticket(self.open.clone()))
    }
}

/// A counted session, until it is dropped.
struct Ticket(Arc<AtomicUsize>);

impl Drop for Ticket {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Answers all sessions that ask for admission, until the server stops.
pub(crate) async fn decide(mut admissions: Admissions, access: Access, sessions: Sessions) {
    while let Some(admission) = admissions.next().await {
        answer(admission, &access, &sessions);
    }
}

fn answer(admission: Admission, access: &Access, sessions: &Sessions) {
    let root = sessions.root_of(&admission.request.path);
    let grant = match grant(access, &root, &admission.request) {
        Ok(grant) => grant,
        Err(reason) => {
            tracing::info!(remote = ?admission.request.remote, %reason, "session refused");
            sessions.refusals.count(RefusalKind::Token);
            return admission.refuse(moq_relay::auth::Error::Refused);
        }
    };
    let Some(ticket) = sessions.admit() else {
        tracing::warn!(limit = sessions.limit, "session refused: too many are open");
        sessions.refusals.count(RefusalKind::Sessions);
        return admission.refuse(moq_relay::auth::Error::Unavailable("too many sessions".into()));
    };
    let (producer, consumer) = lease::Producer::new(grant);
    admission.grant(consumer);
    tokio::spawn(async move {
        producer.closed().await;
        drop(ticket);
    });
}

/// Permissions of a session, by the token in its request's query. Its names are relative to `root`.
fn grant(access: &Access, root: &str, request: &Request) -> Result<Grant, String> {
    let reader = Claims::default().with_subscribe([pattern(READABLE)]);
    let claims = match (access, token(request.query.as_deref())) {
        (Access::Loopback | Access::Open, _) => reader.with_publish([pattern(EDITABLE)]),
        (Access::Token { to_read: false, .. }, None) => reader,
        (Access::Token { to_read: true, .. }, None) => return Err("no token".into()),
        (Access::Token { key, .. }, Some(token)) => {
            limited(key.0.verify(token).map_err(|err| err.to_string())?)?
        }
    };
    let permissions = claims.authorize(root).map_err(|err| err.to_string())?;
    let mut grant = Grant::new(permissions.publish, permissions.subscribe);
    grant.root = Some(root.to_owned());
    grant.expires = claims.expires;
    Ok(grant)
}

/// The claims with absolute names, limited to what clients may publish.
fn limited(claims: Claims) -> Result<Claims, String> {
    let absolute = |names: &Patterns| names.rooted(&claims.root).map_err(|err| err.to_string());
    let editable = Patterns::from(pattern(EDITABLE));
    let publish = absolute(&claims.publish)?.intersect(&editable).map_err(|err| err.to_string())?;
    let subscribe = absolute(&claims.subscribe)?;
    Ok(Claims::default()
        .with_publish(publish.iter().cloned())
        .with_subscribe(subscribe.iter().cloned())
        .with_expires(claims.expires))
}

/// The token in a URL's query, where the MoQ tools put it.
fn token(query: Option<&str>) -> Option<&str> {
    query?.split('&').find_map(|pair| pair.strip_prefix("jwt=")).filter(|token| !token.is_empty())
}

fn pattern(text: &'static str) -> Pattern {
    text.parse().expect("a constant pattern is valid")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(access: &Access, path: &str, query: Option<&str>) -> Result<Grant, String> {
        let mut request = Request::new("test", moq_auth::Transport::Quic, path);
        request.query = query.map(str::to_owned);
        let sessions = Sessions::new(1);
        sessions.scenes.lock().expect("unpoisoned").insert("sponza".into());
        grant(access, &sessions.root_of(path), &request)
    }

    fn token_access(to_read: bool) -> (Key, Access) {
        let key = Key::generate().expect("a key");
        (key.clone(), Access::Token { key, to_read })
    }

    #[test]
    fn clients_publish_edits_only() {
        let grant = ask(&Access::Loopback, "/", None).expect("granted");
        for (path, allowed) in [
            ("sponza/edits/a", true),
            ("sponza/edits/a/b", false),
            ("sponza", false),
            ("sponza/edit", false),
            ("edits/a", false),
            ("a/b/edits/c", false),
        ] {
            assert_eq!(grant.publish.matches(path), allowed, "{path}");
        }
        assert!(grant.subscribe.matches("sponza"));
        assert!(!grant.subscribe.matches("sponza/edits/a"));
    }

    #[test]
    fn names_are_relative_to_the_path_dialled() {
        let grant = ask(&Access::Loopback, "/sponza", None).expect("granted");
        assert!(grant.publish.matches("edits/a"));
        assert!(!grant.publish.matches(""));
        assert!(grant.subscribe.matches(""));
        // A proxy has the server under this path.
        let grant = ask(&Access::Loopback, "/light/of/ours/", None).expect("granted");
        assert!(grant.publish.matches("sponza/edits/a") && grant.subscribe.matches("sponza"));
        assert_eq!(grant.root.as_deref(), Some(""));
    }

    #[test]
    fn a_token_is_needed_to_publish() {
        let (key, access) = token_access(false);
        let anonymous = ask(&access, "/", None).expect("reading is open");
        assert!(anonymous.publish.is_empty() && anonymous.subscribe.matches("sponza"));

        let jwt = key.issue_token("sponza", Some(Duration::from_secs(60))).expect("a token");
        let bearer = ask(&access, "/", Some(&format!("x=1&jwt={jwt}"))).expect("granted");
        assert!(bearer.publish.matches("sponza/edits/a"));
        assert!(!bearer.publish.matches("cornell/edits/a"));
        assert!(bearer.expires.is_some());
    }

    #[test]
    fn wrong_and_missing_tokens_are_refused() {
        let (key, access) = token_access(true);
        assert!(ask(&access, "/", None).is_err());
        assert!(ask(&access, "/", Some("jwt=")).is_err());
        assert!(ask(&access, "/", Some("jwt=rubbish")).is_err());
        let stranger =
            Key::generate().and_then(|key| key.issue_token("sponza", None)).expect("a token");
        assert!(ask(&access, "/", Some(&format!("jwt={stranger}"))).is_err());
        let jwt = key.issue_token("sponza", None).expect("a token");
        assert!(ask(&access, "/", Some(&format!("jwt={jwt}"))).is_ok());
    }

    #[test]
    fn a_token_cannot_claim_more_than_edits() {
        let (key, access) = token_access(false);
        let everything = "**".parse::<Pattern>().expect("a pattern");
        let claims = Claims::default().with_root("sponza").with_publish([everything]);
        let jwt = key.0.sign(&claims).expect("signed");
        let grant = ask(&access, "/", Some(&format!("jwt={jwt}"))).expect("granted");
        assert!(grant.publish.matches("sponza/edits/a"));
        assert!(!grant.publish.matches("sponza"));
        assert!(!grant.publish.matches("cornell/edits/a"));
    }

    #[test]
    fn sessions_are_limited_and_given_back() {
        let sessions = Sessions::new(2);
        let first = sessions.admit().expect("room");
        let _second = sessions.admit().expect("room");
        assert!(sessions.admit().is_none() && sessions.full());
        drop(first);
        assert!(sessions.admit().is_some());
    }
}
