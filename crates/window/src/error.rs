//! What can go wrong.

use lumencast_picture::PictureError;
use lumencast_shade::{GpuError, ShadeError};
use thiserror::Error;

/// Why a window closed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WindowError {
    /// Nothing can be drawn.
    #[error(transparent)]
    Shade(#[from] ShadeError),
    /// A picture cannot be saved.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// There is nothing to take a picture of.
    #[error("no light has come and settled within {} s. {notice}", patience.as_secs())]
    NoLight {
        /// How long it was waited for.
        patience: std::time::Duration,
        /// What the world says.
        notice: String,
    },
    /// There is no display to open a window on.
    #[error(
        "no window can be opened: {0}. Is there a display (DISPLAY or WAYLAND_DISPLAY)? Without one, \
         lumencast view --screenshot saves what it would show, and lumencast render draws pictures"
    )]
    Display(String),
    /// The adapter cannot show pictures in a window.
    #[error("{adapter} cannot show pictures in this window: {reason}")]
    Surface {
        /// Its name.
        adapter: String,
        /// What it says.
        reason: String,
    },
}

impl From<GpuError> for WindowError {
    fn from(error: GpuError) -> Self {
        Self::Shade(error.into())
    }
}
