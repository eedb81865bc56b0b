//! The server's scene, here.

use std::sync::Arc;
use std::time::Instant;

use lumencast_cache::SceneEvent;
use lumencast_scene::{Scene, Snapshot};

use crate::session::Session;

/// A scene that follows a server's: its edits in the server's order, its animations at the server's
/// time.
#[derive(Debug)]
pub struct Replica {
    scene: Scene,
    /// Edits that could not be followed, since the last snapshot.
    missed: usize,
}

impl Replica {
    /// Of the scene as it stands in its file.
    pub fn new(scene: Scene) -> Self {
        Self { scene, missed: 0 }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene, which then follows no longer.
    pub fn into_scene(self) -> Scene {
        self.scene
    }

    /// The scene as it is now.
    pub fn snapshot(&mut self) -> Arc<Snapshot> {
        self.scene.snapshot()
    }

    /// Edits that could not be followed since the last snapshot: of files that are not here, for
    /// instance.
    pub fn missed(&self) -> usize {
        self.missed
    }

    /// Follows the server up to `now`.
    pub fn update(&mut self, session: &Session, now: Instant) {
        for event in session.scene_events() {
            match event {
                SceneEvent::Snapshot(edits) => {
                    self.scene = self.scene.pristine(session.state_time().unwrap_or_default());
                    self.missed = 0;
                    edits.iter().for_each(|edit| self.replay(edit));
                }
                SceneEvent::Edit { edit, .. } => self.replay(&edit),
                // Of this client's own edits, which come back as those of others do.
                _ => {}
            }
        }
        self.advance_to(session.scene_time(now));
    }

    fn replay(&mut self, edit: &lumencast_scene::Edit) {
        if let Err(error) = self.scene.replay(edit) {
            tracing::warn!(%error, ?edit, "an edit of the server's cannot be followed");
            self.missed += 1;
        }
    }

    /// Time goes on, but not back: a clock that was estimated too early is waited for.
    fn advance_to(&mut self, time: Option<f64>) {
        if let Some(time) = time {
            self.scene.advance(time - self.scene.time());
        }
    }
}
