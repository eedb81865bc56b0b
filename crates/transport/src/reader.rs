//! Readers: announcements, broadcasts of others, and the frames of their tracks.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use moq_net::{Pattern, Patterns, announce, broadcast, group, origin, track};

use crate::{Error, Result};

/// Wait before the next attempt where a broadcast does not have the track (yet).
const RETRY: Duration = Duration::from_millis(200);

/// Options for reading a track.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct ReadOptions {
    /// Priority from 0 to 255. Where a link is too slow for all tracks, those of higher priority go
    /// first.
    pub priority: u8,
    /// How far an unfinished group may fall behind the newest before it is skipped; at most five
    /// seconds. Zero suits light, of which only the newest state counts. A track whose every frame
    /// matters needs more.
    pub max_age: Duration,
    /// Largest frame accepted, in bytes.
    pub max_frame: usize,
}

impl Default for ReadOptions {
    /// Priority 0, the newest group only, frames up to 16 MiB.
    fn default() -> Self {
        Self { priority: 0, max_age: Duration::ZERO, max_frame: 16 << 20 }
    }
}

impl ReadOptions {
    /// Sets the priority.
    pub fn with_priority(mut self, priority: u8) -> Self {
        self.priority = priority;
        self
    }

    /// Sets how far behind the newest group others still count.
    pub fn with_max_age(mut self, max_age: Duration) -> Self {
        self.max_age = max_age;
        self
    }

    /// Sets the largest frame accepted, in bytes.
    pub fn with_max_frame(mut self, bytes: usize) -> Self {
        self.max_frame = bytes;
        self
    }

    fn subscription(&self) -> track::Subscription {
        track::Subscription::default().with_priority(self.priority).with_max_age(self.max_age)
    }
}

/// A frame as it was written.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Frame {
    /// Number of its group, which increases with each newer group of the track.
    pub group: u64,
    /// Its index in the group, from 0.
    pub index: u64,
    /// Its content.
    pub bytes: Bytes,
}

/// The broadcast that a reader reads.
enum Source {
    /// Any broadcast under this path, now or later.
    Path { origin: origin::Consumer, path: Arc<str> },
    /// One broadcast, until it ends.
    Broadcast(broadcast::Consumer),
}

/// The reading end of a track.
pub struct TrackReader {
    source: Source,
    track: Arc<str>,
    options: ReadOptions,
    subscription: Option<track::Ordered>,
    group: Option<group::Consumer>,
    /// Whether to pause before the next subscription, since the last one failed or ended.
    pause: bool,
}

impl TrackReader {
    /// A reader of any broadcast under `path`. It waits for the broadcast, and after its end for
    /// its return.
    pub(crate) fn follow(
        origin: origin::Consumer,
        path: &str,
        track: &str,
        options: ReadOptions,
    ) -> Self {
        Self::new(Source::Path { origin, path: path.into() }, track, options)
    }

    fn new(source: Source, track: &str, options: ReadOptions) -> Self {
        Self { source, track: track.into(), options, subscription: None, group: None, pause: false }
    }

    /// The track's name.
    pub fn name(&self) -> &str {
        &self.track
    }

    /// Changes the priority of frames that are not sent yet.
    pub fn set_priority(&mut self, priority: u8) {
        self.options.priority = priority;
        if let Some(subscription) = &mut self.subscription {
            // This fails only on a closed track, which the next read handles.
            let _ = subscription.update(self.options.subscription());
        }
    }

    /// Waits for the next frame. The first one is the first of the newest group. A group that has
    /// become stale is left unfinished and a newer one follows, as [`Frame::group`] shows.
    ///
    /// A reader from a [`Client`](crate::Client) waits while there is no connection, broadcast or
    /// track. It then continues with the server's newest group from its beginning, which may repeat
    /// frames. `None` means that the broadcast has ended or the client was closed.
    ///
    /// Dropping the future loses nothing.
    ///
    /// # Errors
    /// [`Error::FrameTooLarge`], after which reading may continue with the next frame.
    pub async fn next(&mut self) -> Result<Option<Frame>> {
        loop {
            if self.group.is_some() {
                if let Some(frame) = self.next_in_group().await? {
                    return Ok(Some(frame));
                }
            } else if let Some(subscription) = &mut self.subscription {
                match subscription.next_group().await {
                    Ok(Some(group)) => self.group = Some(group),
                    Ok(None) => self.subscription = None,
                    Err(err) => {
                        tracing::debug!(track = %self.track, %err, "subscription ended");
                        self.subscription = None;
                    }
                }
                self.pause = self.subscription.is_none();
                if self.pause && !self.follows() {
                    return Ok(None);
                }
            } else if self.pause {
                tokio::time::sleep(RETRY).await;
                self.pause = false;
            } else if !self.subscribe().await {
                return Ok(None);
            }
        }
    }

    fn follows(&self) -> bool {
        matches!(self.source, Source::Path { .. })
    }

    /// The next frame of the open group. At the group's end it closes the group and returns `None`.
    async fn next_in_group(&mut self) -> Result<Option<Frame>> {
        let Some(group) = &mut self.group else { return Ok(None) };
        let (sequence, index) = (group.sequence, group.index());
        let bytes = match group.read_frame().await {
            Ok(Some(frame)) => frame.payload,
            Ok(None) => {
                self.group = None;
                return Ok(None);
            }
            Err(err) => {
                tracing::debug!(track = %self.track, group = sequence, %err, "group skipped");
                self.group = None;
                return Ok(None);
            }
        };
        let limit = self.options.max_frame;
        if bytes.len() > limit {
            let track = self.track.to_string();
            return Err(Error::FrameTooLarge { track, size: bytes.len(), limit });
        }
        Ok(Some(Frame { group: sequence, index, bytes }))
    }

    /// Subscribes; returns false where there is nothing left to subscribe to.
    async fn subscribe(&mut self) -> bool {
        let broadcast = match &self.source {
            Source::Broadcast(broadcast) => Ok(broadcast.clone()),
            Source::Path { origin, path } => origin.routed_broadcast(&**path).await,
        };
        let subscribed = match broadcast {
            Ok(broadcast) => subscribe(&broadcast, &self.track, self.options).await,
            Err(err) => Err(err),
        };
        match subscribed {
            Ok(subscription) => self.subscription = Some(subscription),
            Err(moq_net::Error::Closed) => return false,
            Err(err) => {
                tracing::debug!(track = %self.track, %err, "not subscribed");
                self.pause = true;
                return self.follows();
            }
        }
        true
    }
}

async fn subscribe(
    broadcast: &broadcast::Consumer,
    track: &str,
    options: ReadOptions,
) -> Result<track::Ordered, moq_net::Error> {
    Ok(broadcast.track(track)?.subscribe(options.subscription()).await?.ordered())
}

/// A broadcast that somebody else publishes.
#[derive(Clone)]
pub struct RemoteBroadcast {
    path: Arc<str>,
    session: u64,
    inner: broadcast::Consumer,
}

impl RemoteBroadcast {
    /// The broadcast's path.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// On a server, the number of the session that publishes it; 0 on a client.
    pub fn session(&self) -> u64 {
        self.session
    }

    /// A reader of a track, until the broadcast ends.
    pub fn subscribe(&self, track: &str, options: ReadOptions) -> TrackReader {
        TrackReader::new(Source::Broadcast(self.inner.clone()), track, options)
    }
}

/// An announcement: a broadcast has appeared or gone.
pub enum Announcement {
    /// Somebody publishes this broadcast.
    Appeared(RemoteBroadcast),
    /// The session has stopped publishing this path.
    Gone {
        /// As [`RemoteBroadcast::session`].
        session: u64,
        /// As [`RemoteBroadcast::path`].
        path: String,
    },
}

/// The broadcasts of others under a path, as they appear and go. Those that exist already come
/// first.
pub struct Announcements {
    origin: origin::Consumer,
    updates: announce::Consumer,
    appearing: Option<String>,
    /// Whether paths begin with the number of a session.
    numbered: bool,
}

impl Announcements {
    /// Broadcasts that a server announces to its client.
    pub(crate) fn of_server(origin: &origin::Consumer, prefix: &str) -> Result<Self> {
        Self::new(origin, prefix, Pattern::subtree(prefix), false)
    }

    /// Broadcasts that sessions publish, each under its session's number.
    pub(crate) fn of_sessions(origin: &origin::Consumer, prefix: &str) -> Result<Self> {
        let pattern = ["*", prefix, "**"].into_iter().filter(|part| !part.is_empty());
        Self::new(origin, prefix, pattern.collect::<Vec<_>>().join("/").parse(), true)
    }

    fn new<E: std::fmt::Display>(
        origin: &origin::Consumer,
        prefix: &str,
        pattern: std::result::Result<Pattern, E>,
        numbered: bool,
    ) -> Result<Self> {
        let refused = |reason: String| Error::Publish { path: prefix.to_owned(), reason };
        let pattern = pattern.map_err(|err| refused(err.to_string()))?;
        let origin =
            origin.scope("", &Patterns::from(pattern)).map_err(|err| refused(err.to_string()))?;
        let updates = origin.announced();
        Ok(Self { origin, updates, appearing: None, numbered })
    }

    /// Waits for the next change; `None` once the server or client is closed. Dropping the future
    /// loses nothing.
    pub async fn next(&mut self) -> Option<Announcement> {
        loop {
            if let Some(full) = &self.appearing {
                let found = self.origin.request_broadcast(full.as_str()).await;
                let (session, path) = self.apart(full);
                let path: Arc<str> = path.into();
                self.appearing = None;
                match found {
                    Ok(inner) => {
                        let appeared = RemoteBroadcast { path, session, inner };
                        return Some(Announcement::Appeared(appeared));
                    }
                    Err(err) => tracing::debug!(%path, %err, "announced broadcast not found"),
                }
            }
            let update = self.updates.next().await?;
            let full = update.prefix.as_str();
            match update.kind {
                announce::Kind::Announced => self.appearing = Some(full.to_owned()),
                announce::Kind::Updated => {}
                announce::Kind::Retracted => {
                    let (session, path) = self.apart(full);
                    return Some(Announcement::Gone { session, path: path.to_owned() });
                }
            }
        }
    }

    /// Splits an announced path into session and path.
    fn apart<'a>(&self, full: &'a str) -> (u64, &'a str) {
        let apart = full.split_once('/').filter(|_| self.numbered);
        let numbered = apart.and_then(|(number, path)| Some((number.parse().ok()?, path)));
        numbered.unwrap_or((0, full))
    }
}
