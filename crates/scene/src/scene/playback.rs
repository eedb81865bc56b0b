//! Clocks of animations.

use crate::{Playback, animation};

/// State of an animation: at scene time `since` it was at `time`, in seconds of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Clock {
    pub(crate) playing: bool,
    pub(crate) time: f64,
    pub(crate) speed: f64,
    pub(crate) since: f64,
    /// Number of the edit that set it; 0 when none has. It orders animations that are paused by
    /// when they were set.
    pub(crate) set_by: u64,
}

impl Clock {
    /// A clock that starts playing the animation from its beginning.
    pub(crate) fn starting(since: f64) -> Self {
        Self { playing: true, time: 0.0, speed: 1.0, since, set_by: 0 }
    }

    /// The animation's own time, not wrapped, at scene time `now`.
    pub(crate) fn time_at(&self, now: f64) -> f64 {
        if self.playing { self.time + self.speed * (now - self.since) } else { self.time }
    }

    /// The position in the animation's curves, 0 to `duration`, at scene time `now`.
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
