//! Writers: a broadcast, its tracks, and their groups and frames.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use bytes::Bytes;
use moq_net::{Timestamp, broadcast, group, origin, track};

use crate::{Error, Result};

/// A named set of tracks that this end publishes. Dropping it ends the broadcast for its readers.
pub struct Broadcast {
    path: Arc<str>,
    inner: broadcast::Producer,
}

impl Broadcast {
    pub(crate) fn new(origin: &origin::Producer, path: &str) -> Result<Self> {
        let inner = origin
            .create_broadcast(path)
            .map_err(|err| Error::Publish { path: path.to_owned(), reason: err.to_string() })?;
        Ok(Self { path: path.into(), inner })
    }

    /// The broadcast's path.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Announces the broadcast to readers. Tracks that readers ask for first, such as a catalog,
    /// must be added before; others may follow at any time.
    ///
    /// # Errors
    /// [`Error::Publish`].
    pub fn announce(&self) -> Result<()> {
        self.inner
            .announce(Default::default())
            .map_err(|err| Error::Publish { path: self.path().to_owned(), reason: err.to_string() })
    }

    /// Adds a track. Where two subscriptions of equal priority compete for a link, the track with
    /// the higher `priority` goes first.
    pub fn track(&self, name: &str, priority: u8) -> Result<TrackWriter> {
        let info = track::Info::default().with_priority(priority);
        let inner = self.inner.create_track(name, info).map_err(|err| track_error(name, &err))?;
        Ok(TrackWriter { name: name.into(), inner, group: None, next_group: first_group() })
    }

    /// Ends the broadcast. Readers see the end of each track that has been finished.
    pub fn close(self) {
        self.inner.close();
    }
}

/// Number of a track's first group: milliseconds since 1970. Group numbers increase, and a reader
/// ignores lower ones than it has seen, so a restarted server must not begin at zero. A track that
/// starts fewer than a thousand groups a second never overtakes this clock.
fn first_group() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |age| age.as_millis() as u64)
}

/// The writing end of a track: a sequence of groups, each a sequence of frames. A new reader starts
/// at the first frame of the newest group. A reader that falls behind misses whole groups.
pub struct TrackWriter {
    name: Arc<str>,
    inner: track::Producer,
    group: Option<group::Producer>,
    next_group: u64,
}

impl TrackWriter {
    /// The track's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Appends a frame to the open group, or to a new one where `new_group` is set or none is open.
    /// It never waits: frames that nobody has fetched stay in memory for some seconds.
    ///
    /// # Errors
    /// The group has 8192 frames or 32 MiB already, or the broadcast is closed.
    pub fn write(&mut self, frame: Bytes, new_group: bool) -> Result<()> {
        if new_group || self.group.is_none() {
            self.finish_group();
            let sequence = self.next_group;
            let group = self.inner.create_group(sequence.into());
            self.group = Some(group.map_err(|err| track_error(&self.name, &err))?);
            self.next_group = sequence + 1;
        }
        match &mut self.group {
            Some(group) => group
                .write_frame(Timestamp::now(), frame)
                .map_err(|err| track_error(&self.name, &err)),
            None => Err(Error::Closed),
        }
    }

    /// Whether anyone reads this track now, directly or through relays. Tracks without readers need
    /// not be computed.
    pub fn is_used(&self) -> bool {
        self.inner.is_used()
    }

    /// Ends the track. Readers get all frames, then the end.
    pub fn finish(mut self) -> Result<()> {
        self.finish_group();
        self.inner.finish().map_err(|err| track_error(&self.name, &err))
    }

    fn finish_group(&mut self) {
        if let Some(group) = self.group.take() {
            // This fails only if the track is closed, which the next write reports.
            let _ = group.finish();
        }
    }
}

fn track_error(track: &str, err: &moq_net::Error) -> Error {
    Error::Track { track: track.to_owned(), reason: err.to_string() }
}
