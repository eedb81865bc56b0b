//! What can go wrong.

use thiserror::Error;

/// Why a device cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No graphics adapter was found.
    #[error(
        "no graphics adapter was found. Install a driver for the GPU, or one in software: \
         mesa-vulkan-drivers (on Debian 12 from bookworm-backports: apt-get install -t \
         bookworm-backports mesa-vulkan-drivers); lumencast doctor lists what there is"
    )]
    NoAdapter,
    /// The adapter gives no device.
    #[error("{adapter} cannot be used: {reason}")]
    Device {
        /// Its name.
        adapter: String,
        /// What it says.
        reason: String,
    },
    /// The device went away, or ran out of memory.
    #[error("the graphics device failed while {during}: {reason}")]
    Failed {
        /// What was done.
        during: &'static str,
        /// What it says.
        reason: String,
    },
    /// A picture is larger than the adapter draws, or has no pixels.
    #[error("a picture of {width} × {height} cannot be drawn: 1 to {limit} pixels a side can")]
    Size {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
        /// The most pixels a side.
        limit: u32,
    },
}

impl GpuError {
    /// The device failed in its own words.
    pub(crate) fn failed(during: &'static str, reason: impl ToString) -> Self {
        Self::Failed { during, reason: reason.to_string() }
    }
}
