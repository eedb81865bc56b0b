//! A scene that a server lights.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;
use lumencast_client::{Replica, Session};
use lumencast_light::{Light, LumelAges};
use lumencast_scene::{Aabb, NamedView, Scene, Snapshot};
use lumencast_transport::ConnectionState;

use crate::world::World;

/// A server's scene under the server's light. The session goes on in a Tokio runtime of the caller's,
/// which has to live as long as this.
pub struct Live {
    session: Session,
    replica: Replica,
    views: Vec<NamedView>,
    now: Instant,
    eye: Option<Vec3>,
    /// Ages of the newest light and of the oldest region's, seconds.
    ages: (Option<f64>, Option<f64>),
    /// When the first light came.
    lit: Option<Instant>,
}

/// Light is noisy until it has been computed for so long.
const SETTLING: Duration = Duration::from_secs(4);
/// The eye is told of where it has moved by so many metres: near regions go first.
const STEP: f32 = 0.25;

impl Live {
    /// The scene as its file has it, and a session with its server.
    pub fn new(session: Session, scene: Scene) -> Self {
        let views = scene.views();
        let replica = Replica::new(scene);
        Self {
            session,
            replica,
            views,
            now: Instant::now(),
            eye: None,
            ages: (None, None),
            lit: None,
        }
    }
}

impl World for Live {
    fn name(&self) -> &str {
        self.replica.scene().name()
    }

    fn views(&self) -> &[NamedView] {
        &self.views
    }

    fn bounds(&self) -> Aabb {
        self.replica.scene().bounds()
    }

    fn update(&mut self, _now: f64, eye: Vec3) {
        self.now = Instant::now();
        if self.eye.is_none_or(|told| told.distance(eye) > STEP) {
            self.session.look_from(eye);
            self.eye = Some(eye);
        }
        self.replica.update(&self.session, self.now);
        self.ages = self.session.light(self.now, |light| (light.age, light.oldest_age));
        if self.lit.is_none() && self.ages.0.is_some() {
            self.lit = Some(self.now);
        }
    }

    fn snapshot(&mut self) -> Arc<Snapshot> {
        self.replica.snapshot()
    }

    fn light(&mut self, _anew: bool, take: &mut dyn FnMut(&Light)) {
        self.session.light(self.now, |light| take(&light));
    }

    fn lumel_ages(&self) -> Vec<LumelAges> {
        self.session.lumel_ages(self.now)
    }

    fn facts(&self) -> Vec<(&'static str, String)> {
        let statistics = self.session.statistics(self.now);
        let seconds = |age: Option<f64>| age.map(|age| format!("{:.0} ms", 1e3 * age));
        let (age, oldest) = self.ages;
        let server = statistics.tick_ms.map(|ms| format!("{ms:.1} ms a tick"));
        let facts = [
            ("age", seconds(age)),
            ("oldest", seconds(oldest)),
            ("ticks", Some(format!("{:.1} a second", statistics.ticks))),
            ("server", server),
            ("samples", statistics.samples.map(|samples| format!("{samples:.0} a probe"))),
            ("received", Some(format!("{:.1} kB/s", 1e-3 * statistics.bytes))),
        ];
        facts.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
    }

    fn notice(&self) -> Option<String> {
        if let ConnectionState::Lost { reason } = self.session.connection() {
            return Some(format!("The connection is lost; the light stays as it was. ({reason})"));
        }
        if self.replica.missed() > 0 {
            return Some("Some of the server's edits cannot be shown here.".to_owned());
        }
        self.lit.is_none().then(|| "Waiting for the first light…".to_owned())
    }

    fn is_settled(&self) -> bool {
        self.lit.is_some_and(|lit| self.now.saturating_duration_since(lit) > SETTLING)
    }

    fn plays(&self) -> Option<bool> {
        None
    }

    fn play(&mut self, _plays: bool) {}
}
