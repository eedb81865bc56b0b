//! The newest update of a region.

use lumencast_codec::UpdateInfo;

/// The newest update of a region.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Newest {
    pub(crate) info: UpdateInfo,
    /// When it came.
    pub(crate) arrived: f64,
}
