//! What can go wrong.

use lumencast_gpu::GpuError;
use thiserror::Error;

/// Why there is no picture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ShadeError {
    /// The device cannot be used, or not for a picture of this size.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Light has more probes than the adapter's textures hold.
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
    /// Lightmaps are larger than the adapter's textures.
    #[error(
        "the light's {pages} pages of {side}² lumels do not fit the adapter's textures; give fewer or \
         smaller ones"
    )]
    Pages {
        /// Lumels a side of the largest.
        side: u32,
        /// Number of all.
        pages: u32,
    },
}
