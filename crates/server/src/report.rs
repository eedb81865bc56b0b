//! What a tick did and how long it took.

use std::fmt;
use std::time::Instant;

/// The steps of a tick, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Edits of clients and of the script.
    Edits,
    /// Animation, and the flat snapshot of the scene.
    Animation,
    /// Acceleration structures.
    Accelerate,
    /// Tracing.
    Gather,
    /// New light into the histories.
    Blend,
    /// Light and state into frames.
    Encode,
    /// Frames onto their tracks.
    Publish,
}

impl Stage {
    /// All of them, in order.
    pub const ALL: [Self; 7] = [
        Self::Edits,
        Self::Animation,
        Self::Accelerate,
        Self::Gather,
        Self::Blend,
        Self::Encode,
        Self::Publish,
    ];
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Edits => "edits",
            Self::Animation => "animation",
            Self::Accelerate => "accelerate",
            Self::Gather => "gather",
            Self::Blend => "blend",
            Self::Encode => "encode",
            Self::Publish => "publish",
        })
    }
}

/// What one tick did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Number of the tick.
    pub tick: u64,
    /// Seconds by stage, in the order of [`Stage::ALL`].
    pub seconds: [f64; Stage::ALL.len()],
    /// Whether it took longer than its period, or its light is not done; the next one takes fewer
    /// samples.
    pub late: bool,
    /// Samples a probe.
    pub samples_a_probe: u32,
    /// Samples of probes whose light came in this tick.
    pub samples: u64,
    /// Path segments traced.
    pub rays: u64,
    /// Edits applied.
    pub accepted: u64,
    /// Edits refused.
    pub refused: u64,
    /// Probes of all volumes.
    pub probes: u64,
    /// Of them, those inside walls.
    pub buried: u64,
    /// Version of the scene after the tick's edits and animation.
    pub scene_version: u64,
    /// Scene time, seconds.
    pub scene_time: f64,
    /// Whether the files that make up the scene may have changed.
    pub files_changed: bool,
}

impl Report {
    /// Seconds that the whole tick took.
    pub fn total_seconds(&self) -> f64 {
        self.seconds.iter().sum()
    }

    /// Seconds of one stage.
    pub fn stage(&self, stage: Stage) -> f64 {
        self.seconds[stage as usize]
    }
}

/// Measures the stages of a tick, one after the other.
#[derive(Debug)]
pub(crate) struct Stopwatch(Instant);

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self(Instant::now())
    }

    /// Seconds since the start or the last lap.
    pub(crate) fn lap(&mut self) -> f64 {
        let now = Instant::now();
        now.duration_since(std::mem::replace(&mut self.0, now)).as_secs_f64()
    }
}
