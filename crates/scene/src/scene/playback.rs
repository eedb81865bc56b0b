//! The clocks of animations.

use crate::{Playback, animation};

/// How an animation stands: at `time` (its own seconds) when the scene's time was `since`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Clock {
    pub(crate) playing: bool,
    pub(crate) time: f64,
    pub(crate) speed: f64,
    pub(crate) since: f64,
    /// Number of the edit that set it; 0 when none has. Tells which of two animations that stand
    /// still was set last.
    pub(crate) set_by: u64,
}

impl Clock {
    /// Playing from its beginning.
    pub(crate) fn starting(since: f64) -> Self {
        Self { playing: true, time: 0.0, speed: 1.0, since, set_by: 0 }
    }

    /// Its own time, not wrapped, when the scene's time is `now`.
    pub(crate) fn time_at(&self, now: f64) -> f64 {
        if self.playing { self.time + self.speed * (now - self.since) } else { self.time }
    }

    /// Where in its curves it stands.
    pub(crate) fn position(&self, now: f64, duration: f64) -> f32 {
        animation::wrap(self.time_at(now), duration) as f32
    }

    pub(crate) fn set(&mut self, change: &Playback, now: f64, edit: u64) {
        *self = Self {
            playing: change.playing.unwrap_or(self.playing),
            time: change.time.unwrap_or_else(|| self.time_at(now)),
            speed: change.speed.unwrap_or(self.speed),
            since: now,
            set_by: edit,
        };
    }
}
