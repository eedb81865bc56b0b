//! A look at a running server: its catalog, its state, its light and its scene, as they are now.

use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lumencast_client::{Replica, SceneFiles, Session, SessionOptions, current_tick};
use lumencast_codec::{Catalog, StateFrame};
use lumencast_light::Field;
use lumencast_scene::Scene;
use lumencast_transport::ConnectOptions;
use tokio::runtime::Runtime;

use crate::output::{self, tell};
use crate::printable::printable_error;

/// How long a server may take to show its light, besides two of its ticks.
const PATIENCE: Duration = Duration::from_secs(15);

/// How long the connection may take.
const CONNECTION: Duration = Duration::from_secs(5);

/// How long threads may take to end.
const GRACE: Duration = Duration::from_secs(1);

/// Longer than light takes to pass from one update to the next.
const SETTLED: Duration = Duration::from_secs(3600);

/// What a look at a server shows.
pub(crate) struct Seen {
    pub(crate) catalog: Catalog,
    pub(crate) fields: Vec<Field>,
    /// The scene, where it was asked for and could be had.
    pub(crate) scene: Option<Scene>,
    pub(crate) state: StateFrame,
    /// The number of edits that made the scene what it is.
    pub(crate) edits: usize,
    /// The frames read have so many bytes.
    pub(crate) bytes: u64,
}

/// Connects to the address of a scene and reads its light and its state, no older than this question.
pub(crate) fn look(url: &str) -> Result<Seen> {
    looking(|runtime| runtime.block_on(read(url)).map(|(_, seen)| seen))
}

/// The same, with the scene as it is now.
pub(crate) fn look_at_scene(url: &str) -> Result<Seen> {
    looking(|runtime| {
        let (session, mut seen) = runtime.block_on(read(url))?;
        match scene(runtime, url, &session) {
            Ok(scene) => seen.scene = Some(scene),
            Err(error) => {
                tell!("warning: what is in the scene is not known: {}", printable_error(&error));
            }
        }
        Ok(seen)
    })
}

fn looking(look: impl FnOnce(&Runtime) -> Result<Seen>) -> Result<Seen> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .context("cannot start the network threads")?;
    let seen = look(&runtime);
    runtime.shutdown_timeout(GRACE);
    seen
}

async fn read(url: &str) -> Result<(Session, Seen)> {
    let mut connection = ConnectOptions::default();
    connection.timeout = CONNECTION;
    let mut options = SessionOptions::default();
    options.connection = connection;
    let session = Session::connect(url, options).await?;
    // A session that joins hears of ticks since the last snapshot: what it has heard is not yet what is.
    let now = current_tick(url).await.unwrap_or_else(|error| {
        tell!("warning: what is told may be some seconds old: {error}");
        0
    });
    let period = session.catalog().map_or(0.0, |catalog| catalog.tick_seconds);
    let patience = PATIENCE + Duration::try_from_secs_f64(2.0 * period).unwrap_or_default();
    if tokio::time::timeout(patience, session.reached(now)).await.is_err() {
        bail!("{url}: connected, but no light of now came within {patience:?}");
    }
    let what = || format!("{url}: it has gone");
    let seen = Seen {
        catalog: session.catalog().with_context(what)?,
        fields: session.light(Instant::now() + SETTLED, |light| light.fields().to_vec()),
        scene: None,
        state: session.state().with_context(what)?,
        edits: session.edits().map_or(0, |edits| edits.len()),
        bytes: session.statistics(Instant::now()).received,
    };
    Ok((session, seen))
}

/// Downloads the files of a server's scene under a bar that shows how many are here. They are removed
/// with the result: edits may read them as long as it lives.
pub(crate) fn download(runtime: &Runtime, url: &str) -> Result<SceneFiles> {
    let bar = output::bar(0, "Loading the scene");
    let files = runtime.block_on(lumencast_client::download(url, |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    }));
    bar.finish_and_clear();
    Ok(files?)
}

/// The server's scene as its edits have left it.
fn scene(runtime: &Runtime, url: &str, session: &Session) -> Result<Scene> {
    let files = download(runtime, url)?;
    let mut replica = Replica::new(Scene::load(files.root())?);
    replica.update(session, Instant::now());
    if replica.missed() > 0 {
        tell!("warning: {} edits of the server cannot be followed here", replica.missed());
    }
    Ok(replica.into_scene())
}
