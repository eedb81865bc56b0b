//! The session: a connection, what is read over it, and the cache that it is read into.

use std::collections::{BTreeMap, HashSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use glam::Vec3;
use lumencast_cache::{Cache, CurrentLight, SceneEvent};
use lumencast_codec::{Catalog, LightTrack, ResourceHash, StateFrame, limits, tracks};
use lumencast_light::LumelAges;
use lumencast_scene::Edit;
use lumencast_transport::{
    Client, ConnectOptions, ConnectionState, Error, Frame, ReadOptions, TrackReader,
};
use tokio::sync::watch;
use tokio::task::{AbortHandle, JoinSet};

use crate::error::ClientError;
use crate::plan::plan;
use crate::resources::fetch;
use crate::statistics::{Meter, Statistics};

/// State frames count for so long: every one of them tells something.
const STATE_AGE: Duration = Duration::from_secs(5);
/// Between two looks at where the eye is.
const LOOK: Duration = Duration::from_millis(250);
/// From one try to fetch a resource to the next.
const AGAIN: Duration = Duration::from_secs(1);
/// How long a catalog may take after the connection.
const CATALOG_WAIT: Duration = Duration::from_secs(5);

/// How a session is made.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct SessionOptions {
    /// How it connects.
    pub connection: ConnectOptions,
}

/// A scene's light and state, read from a server for as long as this lives. Dropping it ends it.
pub struct Session {
    shared: Arc<Shared>,
    client: Arc<Client>,
    /// Ends with it.
    _tasks: JoinSet<()>,
}

/// What the session and its tasks share.
struct Shared {
    began: Instant,
    known: Mutex<Known>,
    /// Changes when another catalog has come.
    catalogs: watch::Sender<u64>,
    /// Changes when anything has come.
    news: watch::Sender<()>,
    eye: watch::Sender<Option<Vec3>>,
}

/// What has come so far.
#[derive(Default)]
struct Known {
    cache: Cache,
    meter: Meter,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Known> {
        // Frames that cannot be read change nothing, so neither does a panic in between.
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Seconds on the cache's clock.
    fn seconds(&self, at: Instant) -> f64 {
        at.saturating_duration_since(self.began).as_secs_f64()
    }

    /// Takes a resource in.
    fn add_resource(&self, bytes: &[u8]) {
        let mut known = self.lock();
        known.meter.received += bytes.len() as u64;
        if let Err(error) = known.cache.add_resource(bytes) {
            tracing::debug!(%error, "a resource is dropped");
            known.meter.dropped += 1;
        }
        drop(known);
        self.news.send_replace(());
    }

    /// Takes a frame in.
    fn take(
        &self,
        frame: &Frame,
        into: impl FnOnce(&mut Cache, f64) -> Result<(), lumencast_cache::CacheError>,
    ) -> bool {
        let now = self.seconds(Instant::now());
        let mut known = self.lock();
        known.meter.bytes.add(frame.bytes.len() as f64, now);
        known.meter.received += frame.bytes.len() as u64;
        match into(&mut known.cache, now) {
            Ok(()) => {
                drop(known);
                self.news.send_replace(());
                true
            }
            Err(error) => {
                tracing::debug!(%error, "a frame is dropped");
                known.meter.dropped += 1;
                false
            }
        }
    }
}

impl Session {
    /// Connects to `http(s)://host:port/scene` and waits for its catalog. To be called within a Tokio
    /// runtime, which has to live as long as the session.
    ///
    /// # Errors
    /// No connection, or no catalog that this version understands.
    pub async fn connect(url: &str, options: SessionOptions) -> Result<Self, ClientError> {
        let client = Arc::new(Client::connect(url, options.connection).await?);
        let shared = Arc::new(Shared {
            began: Instant::now(),
            known: Mutex::default(),
            catalogs: watch::Sender::new(0),
            news: watch::Sender::new(()),
            eye: watch::Sender::new(None),
        });
        let mut tasks = JoinSet::new();
        tasks.spawn(read_catalog(client.clone(), shared.clone()));
        tasks.spawn(read_state(client.clone(), shared.clone()));
        tasks.spawn(read_light(client.clone(), shared.clone()));
        tasks.spawn(read_resources(url.to_owned(), shared.clone()));
        let mut catalogs = shared.catalogs.subscribe();
        let first = catalogs.wait_for(|count| *count > 0);
        let came = matches!(tokio::time::timeout(CATALOG_WAIT, first).await, Ok(Ok(_)));
        if !came {
            let what = match shared.lock().meter.dropped {
                0 => format!("it has no scene {:?}", client.scene()),
                _ => "its catalog is none of this version's (docs/wire.md)".to_owned(),
            };
            return Err(ClientError::NoScene { url: url.to_owned(), what });
        }
        Ok(Self { shared, client, _tasks: tasks })
    }

    /// The light to be seen at `now`, handed to `see`; it stays the same while that runs.
    pub fn light<R>(&self, now: Instant, see: impl FnOnce(CurrentLight<'_>) -> R) -> R {
        let now = self.shared.seconds(now);
        see(self.shared.lock().cache.light(now))
    }

    /// How long ago, at `now`, the light of each lightmap's tiles came.
    pub fn lumel_ages(&self, now: Instant) -> Vec<LumelAges> {
        let now = self.shared.seconds(now);
        self.shared.lock().cache.lumel_ages(now)
    }

    /// What has happened to the scene since the last call, in order.
    pub fn scene_events(&self) -> Vec<SceneEvent> {
        self.shared.lock().cache.scene_events()
    }

    /// Scene time at `now`, seconds.
    pub fn scene_time(&self, now: Instant) -> Option<f64> {
        let now = self.shared.seconds(now);
        self.shared.lock().cache.scene_time(now)
    }

    /// Waits until the state and the light of every region are of this tick or later
    /// ([`Cache::has_reached`]), and what fields name has come, for as long as it takes.
    pub async fn reached(&self, tick: u64) {
        let mut news = self.shared.news.subscribe();
        let has_all = || {
            let cache = &self.shared.lock().cache;
            cache.has_reached(tick) && cache.wanted_resources().is_empty()
        };
        while !has_all() {
            // The sender lives as long as this session.
            let _ = news.changed().await;
        }
    }

    /// The newest state that has come, without its edits.
    pub fn state(&self) -> Option<StateFrame> {
        self.shared.lock().cache.newest_state().cloned()
    }

    /// Edits that turn the scene as it stands in its file into the server's; nothing while a tick is
    /// missing.
    pub fn edits(&self) -> Option<Vec<Edit>> {
        self.shared.lock().cache.server_edits().map(<[Edit]>::to_vec)
    }

    /// Scene time of the newest state that has come, seconds.
    pub fn state_time(&self) -> Option<f64> {
        self.shared.lock().cache.newest_state().map(|state| state.time)
    }

    /// What the server offers.
    pub fn catalog(&self) -> Option<Catalog> {
        self.shared.lock().cache.current_catalog().cloned()
    }

    /// Tells from where light is looked at: near regions then go first.
    pub fn look_from(&self, eye: Vec3) {
        self.shared.eye.send_replace(Some(eye));
    }

    /// Whether it is connected now.
    pub fn connection(&self) -> ConnectionState {
        self.client.state()
    }

    /// How it goes.
    pub fn statistics(&self, now: Instant) -> Statistics {
        let now = self.shared.seconds(now);
        let mut known = self.shared.lock();
        let Known { cache, meter } = &mut *known;
        let state = cache.newest_state();
        Statistics {
            ticks: meter.ticks.at(now),
            frames: meter.frames.at(now),
            bytes: meter.bytes.at(now),
            received: meter.received,
            tick_ms: state.map(|state| state.tick_ms),
            samples: state.map(|state| state.samples),
            dropped: meter.dropped,
        }
    }
}

fn options(priority: u8) -> ReadOptions {
    ReadOptions::default().with_priority(priority).with_max_frame(limits::FRAME_BYTES)
}

/// The next frame of a track, past those that are too large; nothing once the client is closed.
async fn next(reader: &mut TrackReader) -> Option<Frame> {
    loop {
        match reader.next().await {
            Ok(frame) => return frame,
            Err(Error::FrameTooLarge { size, .. }) => {
                tracing::debug!(track = reader.name(), size, "a frame is too large");
            }
            Err(error) => {
                tracing::debug!(track = reader.name(), %error, "a track ended");
                return None;
            }
        }
    }
}

async fn read_catalog(client: Arc<Client>, shared: Arc<Shared>) {
    let mut reader =
        client.subscribe(client.scene(), tracks::CATALOG, options(tracks::CATALOG_PRIORITY));
    while let Some(frame) = next(&mut reader).await {
        if shared.take(&frame, |cache, now| cache.add_catalog(&frame.bytes, now)) {
            shared.catalogs.send_modify(|count| *count += 1);
        }
    }
}

async fn read_state(client: Arc<Client>, shared: Arc<Shared>) {
    // Before the catalog there is nothing that it could be the state of.
    let mut catalogs = shared.catalogs.subscribe();
    if catalogs.wait_for(|count| *count > 0).await.is_err() {
        return;
    }
    let options = options(tracks::STATE_PRIORITY).with_max_age(STATE_AGE);
    let mut reader = client.subscribe(client.scene(), tracks::STATE, options);
    while let Some(frame) = next(&mut reader).await {
        if shared.take(&frame, |cache, now| cache.add_state(&frame.bytes, now).map(|_| ())) {
            let now = shared.seconds(Instant::now());
            shared.lock().meter.ticks.add(1.0, now);
        }
    }
}

/// Fetches what is wanted. What cannot be had is asked for again after a while.
async fn read_resources(url: String, shared: Arc<Shared>) {
    let mut news = shared.news.subscribe();
    let mut failed: HashSet<ResourceHash> = HashSet::new();
    loop {
        let wanted = shared.lock().cache.wanted_resources();
        if let Some(hash) = wanted.into_iter().find(|hash| !failed.contains(hash)) {
            match fetch(&url, hash).await {
                Ok(bytes) => shared.add_resource(&bytes),
                Err(error) => {
                    tracing::debug!(%hash, %error, "a resource cannot be had");
                    failed.insert(hash);
                }
            }
        } else if failed.is_empty() {
            if news.changed().await.is_err() {
                return;
            }
        } else {
            tokio::time::sleep(AGAIN).await;
            failed.clear();
        }
    }
}

/// A track that is being read.
struct Reading {
    priority: watch::Sender<u8>,
    task: AbortHandle,
}

/// Reads the tracks of all regions, and changes their priorities as the eye moves.
async fn read_light(client: Arc<Client>, shared: Arc<Shared>) {
    let mut catalogs = shared.catalogs.subscribe();
    let mut eyes = shared.eye.subscribe();
    let mut tasks = JoinSet::new();
    let mut reading: BTreeMap<LightTrack, Reading> = BTreeMap::new();
    loop {
        let catalog = shared.lock().cache.current_catalog().cloned();
        let wanted: BTreeMap<LightTrack, u8> = match catalog {
            Some(catalog) => plan(&catalog, *eyes.borrow_and_update()).into_iter().collect(),
            None => BTreeMap::new(),
        };
        reading.retain(|track, reading| {
            let goes_on = wanted.contains_key(track) && !reading.task.is_finished();
            if !goes_on {
                reading.task.abort();
            }
            goes_on
        });
        for (track, priority) in wanted {
            let known = reading.entry(track).or_insert_with(|| {
                let (sender, changes) = watch::channel(priority);
                let read = read_region(client.clone(), shared.clone(), track, changes);
                Reading { priority: sender, task: tasks.spawn(read) }
            });
            known.priority.send_if_modified(|now| std::mem::replace(now, priority) != priority);
        }
        tokio::select! {
            Ok(()) = catalogs.changed() => {}
            Ok(()) = eyes.changed() => tokio::time::sleep(LOOK).await,
            Some(_) = tasks.join_next() => {}
            else => return,
        }
    }
}

async fn read_region(
    client: Arc<Client>,
    shared: Arc<Shared>,
    track: LightTrack,
    mut priority: watch::Receiver<u8>,
) {
    let options = options(*priority.borrow_and_update());
    let mut reader = client.subscribe(client.scene(), &track.to_string(), options);
    loop {
        let frame = tokio::select! {
            frame = next(&mut reader) => frame,
            changed = priority.changed() => {
                if changed.is_err() {
                    return;
                }
                reader.set_priority(*priority.borrow_and_update());
                continue;
            }
        };
        let Some(frame) = frame else { return };
        let taken =
            shared.take(&frame, |cache, now| cache.add_light(track, &frame.bytes, now).map(|_| ()));
        if taken {
            let now = shared.seconds(Instant::now());
            shared.lock().meter.frames.add(1.0, now);
        }
    }
}
