//! Edits of clients: their broadcasts, read into the inbox.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use lumencast_codec::{limits, tracks};
use lumencast_transport::{
    Announcement, Announcements, Error, Rarely, ReadOptions, RemoteBroadcast,
};
use tokio::task::JoinSet;

use crate::inbox::{Inbox, Verdict};
use crate::names::{Claim, ClientName, Names};

/// Edits older than this are not worth waiting for when a newer group is there.
const MAX_AGE: Duration = Duration::from_secs(5);
/// How often it is looked for names that have been left.
const LOOK: Duration = Duration::from_secs(5);

/// Reads the edits of every client that announces some, until the server closes. `clock` is the
/// server's.
pub(crate) async fn collect(
    mut announcements: Announcements,
    inbox: Arc<Mutex<Inbox>>,
    clock: Instant,
) {
    let mut collector = Collector {
        inbox,
        clock,
        names: Names::default(),
        readers: JoinSet::new(),
        nameless: Rarely::default(),
        skipped: Rarely::default(),
        cut_off: Rarely::default(),
    };
    let mut looking = tokio::time::interval(LOOK);
    loop {
        tokio::select! {
            announcement = announcements.next() => match announcement {
                Some(announcement) => collector.announced(announcement),
                None => return,
            },
            Some(ended) = collector.readers.join_next() => {
                if let Ok(ended) = ended {
                    collector.ended(ended);
                }
            }
            _ = looking.tick() => {}
        }
        while let Some(claim) = collector.names.next(collector.now()) {
            collector.read(claim);
        }
        for name in collector.names.gone(collector.now()) {
            collector.inbox.lock().unwrap_or_else(PoisonError::into_inner).leave(name);
        }
    }
}

/// The names that are in use and the tasks that read under them.
struct Collector {
    inbox: Arc<Mutex<Inbox>>,
    clock: Instant,
    names: Names<RemoteBroadcast>,
    readers: JoinSet<Ended>,
    nameless: Rarely,
    skipped: Rarely,
    cut_off: Rarely,
}

impl Collector {
    fn now(&self) -> f64 {
        self.clock.elapsed().as_secs_f64()
    }

    fn announced(&mut self, announcement: Announcement) {
        let broadcast = match announcement {
            Announcement::Appeared(broadcast) => broadcast,
            Announcement::Gone { session, path } => {
                // A reader takes what is still on its way and then ends by itself.
                if let Some(client) = ClientName::of_path(&path) {
                    self.names.withdraw(&client, session);
                }
                return;
            }
        };
        let Some(client) = ClientName::of_path(broadcast.path()) else {
            if let Some(times) = self.nameless.now() {
                tracing::warn!(times, "edits under a name that is none, which are not read");
            }
            return;
        };
        let session = broadcast.session();
        let name = client.name.clone();
        match self.names.claim(Claim { client, session, broadcast }, self.now()) {
            Some(claim) => self.read(claim),
            None => {
                if let Some(times) = self.skipped.now() {
                    let reason = "another session edits under its name, or too many clients edit";
                    tracing::warn!(%name, times, "a client waits: {reason}");
                }
            }
        }
    }

    fn read(&mut self, claim: Claim<RemoteBroadcast>) {
        let (inbox, clock) = (self.inbox.clone(), self.clock);
        let Claim { client, session, broadcast } = claim;
        self.readers.spawn(async move {
            let was_cut_off = read(&client.name, &broadcast, &inbox, clock).await;
            Ended { name: client.name, session, was_cut_off }
        });
    }

    fn ended(&mut self, Ended { name, session, was_cut_off }: Ended) {
        self.names.ended(&name, session, self.now());
        if was_cut_off && let Some(times) = self.cut_off.now() {
            let reason = "too many edits, or too many frames that are none";
            tracing::warn!(%name, times, "a client is cut off: {reason}");
        }
    }
}

/// A session whose edits are read no more.
struct Ended {
    name: String,
    session: u64,
    was_cut_off: bool,
}

/// Reads one client's edits until its broadcast ends or it is cut off; returns whether it was.
async fn read(
    client: &str,
    broadcast: &RemoteBroadcast,
    inbox: &Mutex<Inbox>,
    clock: Instant,
) -> bool {
    tracing::debug!(client, "edits the scene");
    let options = ReadOptions::default().with_max_age(MAX_AGE).with_max_frame(limits::EDIT_BYTES);
    let mut track = broadcast.subscribe(tracks::EDITS, options);
    loop {
        let frame = match track.next().await {
            Ok(Some(frame)) => frame.bytes,
            Ok(None) => return false,
            // Counted as rubbish.
            Err(Error::FrameTooLarge { .. }) => bytes::Bytes::new(),
            Err(error) => {
                tracing::debug!(client, %error, "edits ended");
                return false;
            }
        };
        let now = clock.elapsed().as_secs_f64();
        let verdict =
            inbox.lock().unwrap_or_else(PoisonError::into_inner).receive(client, &frame, now);
        if verdict == Verdict::CutOff {
            return true;
        }
    }
}
