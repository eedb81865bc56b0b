//! The tick with the network around it.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::thread;
use std::time::{Duration, Instant};

use lumencast_codec::Epoch;
use lumencast_gather::Gather;
use lumencast_scene::{FileContents, Scene};

use crate::contents::Contents;
use crate::edits;
use crate::error::ServerError;
use crate::files::FileSet;
use crate::http::{self, Shared, Ticked};
use crate::inbox::{Inbox, Limits};
use crate::loader::Loader;
use crate::metrics::Metrics;
use crate::pace::Beat;
use crate::page;
use crate::publish::Publisher;
use crate::resources::Resources;
use crate::tick::{Tick, TickOptions};

/// How long a tick waits for its light: longer than ticks take that are a little late.
const PATIENCE: Duration = Duration::from_millis(200);
/// How long sessions may take to end when the server stops.
const GRACE: Duration = Duration::from_secs(2);

/// How a server is set up.
#[derive(Debug)]
#[non_exhaustive]
pub struct ServerConfig {
    /// Address, certificate, access.
    pub network: lumencast_transport::ServerConfig,
    /// How light is computed.
    pub tick: TickOptions,
    /// What one client may send.
    pub limits: Limits,
    /// The folder of the page's files, in place of those compiled in.
    pub page: Option<PathBuf>,
}

impl ServerConfig {
    /// A server with the defaults of everything but its network.
    pub fn new(network: lumencast_transport::ServerConfig) -> Self {
        let (tick, limits) = (TickOptions::default(), Limits::default());
        Self { network, tick, limits, page: None }
    }
}

/// A server that holds its port and is ready to run.
pub struct Server {
    network: lumencast_transport::Server,
    tick: Tick,
    publisher: Publisher,
    shared: Arc<Shared>,
    inbox: Arc<Mutex<Inbox>>,
    clock: Instant,
}

impl Server {
    /// Takes the port and publishes the scene's broadcast. Light begins to flow with
    /// [`Server::run`].
    ///
    /// # Errors
    /// A port in use, a page that cannot be read, a volume beyond the limits.
    pub async fn bind(
        scene: Scene,
        gatherer: Box<dyn Gather>,
        config: ServerConfig,
    ) -> Result<Self, ServerError> {
        let page = page::files(config.page.as_deref()).map_err(|error| ServerError::Page {
            folder: config.page.clone().unwrap_or_default(),
            error,
        })?;
        let tick = Tick::new(scene, gatherer, config.tick, random_epoch())?;
        let ticked = RwLock::new(Ticked::at(Instant::now(), tick.period(), 0.0));
        let shared = Arc::new(Shared {
            metrics: Metrics::default(),
            page,
            scene_files: RwLock::new(scene_files(tick.scene())),
            resources: RwLock::new(Resources::new(tick.resources())),
            scene: tick.scene().name().to_owned(),
            root: tick.scene().root_file().to_owned(),
            tick: AtomicU64::new(0),
            ticked,
        });
        let network =
            lumencast_transport::Server::bind(config.network, http::router(shared.clone())).await?;
        let broadcast = network.publish(&shared.scene)?;
        let publisher = Publisher::new(broadcast, &tick.catalog(), shared.clone())?;
        let inbox = Arc::new(Mutex::new(Inbox::new(config.limits)));
        Ok(Self { network, tick, publisher, shared, inbox, clock: Instant::now() })
    }

    /// The address, with the port that was chosen.
    pub fn local_addr(&self) -> SocketAddr {
        self.network.local_addr()
    }

    /// The name of the scene and of its broadcast.
    pub fn scene_name(&self) -> &str {
        &self.shared.scene
    }

    /// The tick.
    pub fn tick(&self) -> &Tick {
        &self.tick
    }

    /// Runs until `stop` is done, then ends the tick in progress, closes every session and returns.
    ///
    /// # Errors
    /// When the tick's thread dies.
    pub async fn run(self, stop: impl Future<Output = ()>) -> Result<(), ServerError> {
        let Self { network, tick, publisher, shared, inbox, clock } = self;
        let prefix = format!("{}/edits", shared.scene);
        let collector =
            tokio::spawn(edits::collect(network.announced(&prefix)?, inbox.clone(), clock));

        let start_error = |error: std::io::Error| ServerError::Stopped(error.to_string());
        let loader = Loader::start().map_err(start_error)?;
        let stopping = Arc::new(AtomicBool::new(false));
        let (ended, mut wait_ended) = tokio::sync::oneshot::channel();
        let ticking = Ticking {
            tick,
            publisher,
            loader,
            shared: shared.clone(),
            inbox,
            clock,
            stopping: stopping.clone(),
        };
        let body = move || {
            ticking.run();
            // Nobody listens any more if the server is stopping.
            let _ = ended.send(());
        };
        let thread = thread::Builder::new().name("tick".into()).spawn(body).map_err(start_error)?;

        let mut counting = tokio::time::interval(Duration::from_secs(1));
        tokio::pin!(stop);
        loop {
            tokio::select! {
                () = &mut stop => break,
                _ = &mut wait_ended => break,
                _ = counting.tick() => {
                    shared.metrics.set_network(network.sessions(), &network.refusals());
                }
            }
        }
        stopping.store(true, Ordering::Relaxed);
        thread.thread().unpark();
        let joined = tokio::task::spawn_blocking(|| thread.join()).await;
        collector.abort();
        network.shutdown(GRACE).await;
        match joined {
            Ok(Ok(())) => Ok(()),
            _ => Err(ServerError::Stopped("its thread has panicked".into())),
        }
    }
}

/// What the tick's thread works with.
struct Ticking {
    tick: Tick,
    publisher: Publisher,
    loader: Loader,
    shared: Arc<Shared>,
    inbox: Arc<Mutex<Inbox>>,
    clock: Instant,
    stopping: Arc<AtomicBool>,
}

impl Ticking {
    /// Ticks at the rate set until told to stop.
    fn run(mut self) {
        let mut beat = Beat::new(self.tick.period(), self.now());
        while !self.stopping.load(Ordering::Relaxed) {
            let wait = beat.wait(self.now());
            if wait > 0.0 {
                // Wakes early when the server stops, or for no reason at all.
                thread::park_timeout(Duration::from_secs_f64(wait));
                continue;
            }
            let started = self.now();
            beat.start(started);
            self.step(started);
        }
    }

    fn now(&self) -> f64 {
        self.clock.elapsed().as_secs_f64()
    }

    /// One tick, with the mail that is ready, and what others are told of it.
    fn step(&mut self, now: f64) {
        let Self { tick, publisher, loader, shared, inbox, .. } = self;
        loader.deliver(tick);
        let mail = inbox
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take_ready(now, |edit| loader.is_ready(tick, edit));
        shared.tick.store(tick.number(), Ordering::Relaxed);
        let report = tick.step_within(now, mail, publisher, PATIENCE);
        // With the log's time, from which pages measure the way to them.
        tracing::debug!(tick = report.tick, late = report.late, "tick published");
        if report.files_changed {
            *shared.scene_files.write().unwrap_or_else(PoisonError::into_inner) =
                scene_files(tick.scene());
        }
        shared.metrics.record(&report);
        *shared.ticked.write().unwrap_or_else(PoisonError::into_inner) =
            Ticked::at(Instant::now(), tick.period(), report.total_seconds());
    }
}

/// The files that make the scene up, as clients ask for them.
fn scene_files(scene: &Scene) -> FileSet {
    let files = scene.files().into_iter().filter_map(|file| {
        let contents = match file.contents {
            FileContents::Path(path) => match Contents::at(&path) {
                Ok(contents) => contents,
                Err(error) => {
                    tracing::warn!(path = %path.display(), %error, "not served");
                    return None;
                }
            },
            FileContents::Bytes(bytes) => Contents::of(bytes.to_vec().into()),
        };
        Some((file.name, contents))
    });
    files.collect()
}

/// Tells this run of the server from others: no secret, only unlikely to come twice.
fn random_epoch() -> Epoch {
    use std::hash::{BuildHasher, RandomState};
    // Every state is seeded by the system's random numbers.
    Epoch(RandomState::new().hash_one(std::process::id()))
}
