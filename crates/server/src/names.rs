//! Whose name is whose: a name belongs to the session that edits under it.
//!
//! A client is called `<name>.<key>`. Everyone is told its name, with each of its edits; its key
//! nobody but the server. A connection that was lost comes back as another session, which shows the
//! key and has the name at once. Whoever does not know the key gets the name when the session has
//! gone, and a name with a key a minute later.

use std::collections::{BTreeMap, VecDeque};

/// Clients whose edits are read at a time.
pub(crate) const MAX_CLIENTS: usize = 1024;
/// Seconds for which a name waits for the session that shows its key.
const KEPT_FOR: f64 = 60.0;
/// Seconds after which a client counts as gone.
const GONE_AFTER: f64 = 10.0;
/// Most characters of a name or a key.
const LONGEST: usize = 64;

/// A client, as its broadcast is called.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ClientName {
    /// What others know it by.
    pub(crate) name: String,
    /// Empty where it has none.
    key: String,
}

impl ClientName {
    /// The client of `<scene>/edits/<name>` or `<scene>/edits/<name>.<key>`, if the path is of that
    /// form.
    pub(crate) fn of_path(path: &str) -> Option<Self> {
        let mut parts = path.split('/');
        let (Some(_), Some("edits"), Some(client), None) =
            (parts.next(), parts.next(), parts.next(), parts.next())
        else {
            return None;
        };
        let (name, key) = match client.split_once('.') {
            Some((name, key)) => (name, Some(key)),
            None => (client, None),
        };
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        let is_sound =
            |word: &str| (1..=LONGEST).contains(&word.len()) && word.chars().all(allowed);
        (is_sound(name) && key.is_none_or(is_sound))
            .then(|| Self { name: name.to_owned(), key: key.unwrap_or_default().to_owned() })
    }
}

/// A session that wants to edit under a name, with what is to be read of it.
#[derive(Debug)]
pub(crate) struct Claim<B> {
    pub(crate) client: ClientName,
    pub(crate) session: u64,
    pub(crate) broadcast: B,
}

/// The names in use and those who wait for one.
#[derive(Debug)]
pub(crate) struct Names<B> {
    holders: BTreeMap<String, Holder>,
    waiting: VecDeque<Claim<B>>,
    gone: Vec<String>,
}

#[derive(Debug)]
struct Holder {
    session: u64,
    key: String,
    /// When its session went.
    left: Option<f64>,
    /// Whether it has been told that it is gone.
    told: bool,
}

impl<B> Default for Names<B> {
    fn default() -> Self {
        Self { holders: BTreeMap::new(), waiting: VecDeque::new(), gone: Vec::new() }
    }
}

impl<B> Names<B> {
    /// Gives the name to the session, whose edits are to be read then; or lets it wait for the name, and
    /// returns nothing.
    pub(crate) fn claim(&mut self, claim: Claim<B>, now: f64) -> Option<Claim<B>> {
        if self.is_free(&claim, self.has_room(), now) {
            let ClientName { name, key } = claim.client.clone();
            let holder = Holder { session: claim.session, key, left: None, told: false };
            self.holders.insert(name, holder);
            return Some(claim);
        }
        self.waiting.push_back(claim);
        None
    }

    fn has_room(&self) -> bool {
        self.holders.values().filter(|holder| holder.left.is_none()).count() < MAX_CLIENTS
    }

    fn is_free(&self, claim: &Claim<B>, has_room: bool, now: f64) -> bool {
        let ClientName { name, key } = &claim.client;
        match self.holders.get(name) {
            Some(holder) if holder.left.is_some_and(|left| now - left >= KEPT_FOR) => true,
            Some(holder) => {
                holder.session == claim.session || (!key.is_empty() && holder.key == *key)
            }
            None => has_room,
        }
    }

    /// The session has nothing to read under the name any more.
    pub(crate) fn ended(&mut self, name: &str, session: u64, now: f64) {
        if let Some(holder) = self.holders.get_mut(name).filter(|h| h.session == session) {
            holder.left = Some(now);
            if holder.key.is_empty() {
                self.holders.remove(name);
                self.gone.push(name.to_owned());
            }
        }
    }

    /// The clients that have been away for ten seconds, or that cannot come back, each once.
    pub(crate) fn gone(&mut self, now: f64) -> Vec<String> {
        let mut gone = std::mem::take(&mut self.gone);
        for (name, holder) in &mut self.holders {
            let is_gone = holder.left.is_some_and(|left| now - left >= GONE_AFTER);
            if is_gone && !std::mem::replace(&mut holder.told, true) {
                gone.push(name.clone());
            }
        }
        gone
    }

    /// The session waits for the name no longer.
    pub(crate) fn withdraw(&mut self, client: &ClientName, session: u64) {
        self.waiting.retain(|claim| claim.session != session || claim.client != *client);
    }

    /// One of those who wait, if there is a name for it.
    pub(crate) fn next(&mut self, now: f64) -> Option<Claim<B>> {
        self.holders.retain(|_, holder| holder.left.is_none_or(|left| now - left < KEPT_FOR));
        let has_room = self.has_room();
        let place = self.waiting.iter().position(|claim| self.is_free(claim, has_room, now))?;
        let claim = self.waiting.remove(place)?;
        self.claim(claim, now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn client(name: &str) -> ClientName {
        ClientName::of_path(&format!("sponza/edits/{name}")).expect("a name")
    }

    fn claim(client: ClientName, session: u64) -> Claim<()> {
        Claim { client, session, broadcast: () }
    }

    #[test]
    fn names_and_keys() {
        let of = |path: &str| ClientName::of_path(path).map(|c| (c.name, c.key));
        let pair = |name: &str, key: &str| Some((name.to_owned(), key.to_owned()));
        assert_eq!(of("sponza/edits/A-z_09"), pair("A-z_09", ""));
        assert_eq!(of("sponza/edits/alice.secret"), pair("alice", "secret"));
        for wrong in [
            "",
            "a",
            "sponza",
            "sponza/edits/",
            "sponza/edits/a b",
            "sponza/edits/ä",
            "sponza/edits/a.",
            "sponza/edits/.a",
            "sponza/edits/a.b.c",
            "sponza/edits/x/victim",
            "sponza/else/a",
        ] {
            assert_eq!(of(wrong), None, "{wrong}");
        }
        assert_eq!(of(&format!("s/edits/{}", "x".repeat(65))), None);
        assert_eq!(of(&format!("s/edits/x.{}", "x".repeat(65))), None);
    }

    #[test]
    fn a_name_belongs_to_its_session() {
        let mut names = Names::default();
        assert!(names.claim(claim(client("alice"), 1), 0.0).is_some());
        assert!(names.claim(claim(client("alice"), 2), 0.0).is_none());
        assert!(names.claim(claim(client("alice.guess"), 3), 0.0).is_none());
        assert!(names.next(1000.0).is_none(), "for as long as it is there");
        names.ended("alice", 2, 1000.0);
        assert!(names.next(1000.0).is_none(), "that was another session");
        names.withdraw(&client("alice"), 2);
        assert_eq!(names.gone(1000.0), [""; 0]);
        names.ended("alice", 1, 1000.0);
        let next = names.next(1000.0).expect("free at once, since it had no key");
        assert_eq!(next.session, 3);
        assert_eq!((names.gone(1000.0), names.gone(1000.0)), (vec!["alice".to_owned()], vec![]));
    }

    #[test]
    fn who_has_the_key_comes_back_to_the_name() {
        let mut names = Names::default();
        assert!(names.claim(claim(client("alice.key"), 1), 0.0).is_some());
        assert!(names.claim(claim(client("alice"), 2), 1.0).is_none());
        assert!(names.claim(claim(client("alice.guess"), 3), 1.0).is_none());
        // The first session is dead, which the server does not know yet.
        assert!(names.claim(claim(client("alice.key"), 4), 2.0).is_some());
        names.ended("alice", 1, 3.0);
        assert!(names.next(100.0).is_none(), "the fourth goes on");
        names.ended("alice", 4, 100.0);
        assert!(names.next(130.0).is_none(), "kept for it");
        assert!(names.claim(claim(client("alice.key"), 5), 140.0).is_some());
        names.ended("alice", 5, 150.0);
        let gone = [100.0, 159.0, 160.0, 161.0].map(|now| names.gone(now).len());
        assert_eq!(gone, [0, 0, 1, 0]);
        assert_eq!(names.next(211.0).expect("given up").session, 2);
    }

    /// Those for whom there was no room are read as soon as there is.
    #[test]
    fn who_was_skipped_is_tried_again() {
        let mut names = Names::default();
        for number in 0..MAX_CLIENTS {
            assert!(
                names.claim(claim(client(&format!("c{number}.k")), number as u64), 0.0).is_some()
            );
        }
        assert!(names.claim(claim(client("late.k"), 5000), 0.0).is_none());
        assert!(names.next(0.0).is_none());
        names.ended("c7", 7, 1.0);
        assert_eq!(names.next(1.0).expect("room").client.name, "late");
        assert!(names.next(1.0).is_none());
    }
}
