//! What can go wrong.

use thiserror::Error;

/// Why there is no picture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ShadeError {
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
    /// A picture larger than the adapter draws, or without pixels.
    #[error("a picture of {width} × {height} cannot be drawn: 1 to {limit} pixels a side can")]
    Size {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
        /// The adapter's.
        limit: u32,
    },
    /// Light with more probes than the adapter's textures hold.
    #[error(
        "the light's {volumes} volumes do not fit a 3D texture of {limit} texels a side; give \
         fewer or coarser volumes"
    )]
    Field {
        /// How many.
        volumes: usize,
        /// The adapter's.
        limit: u32,
    },
}
