//! What keeps light from being computed.

use thiserror::Error;

/// What keeps light from being computed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SolveError {
    /// A volume of probes that makes no sense.
    #[error("volume {volume}: {reason}")]
    Volume {
        /// Its number among the scene's volumes.
        volume: u32,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// Surfaces that are not cut into charts.
    #[error(transparent)]
    Charts(#[from] lumencast_charts::ChartError),
    /// The system has no thread to work on.
    #[error("no thread to cut surfaces on: {0}")]
    NoThread(String),
    /// Light that was being computed is not coming.
    #[error("the gatherer gave up a job; its log says why")]
    Gather,
}
