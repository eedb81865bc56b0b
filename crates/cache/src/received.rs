//! What became of a frame.

use lumencast_codec::UpdateInfo;

/// What became of a frame of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Received {
    /// When and from what it was computed.
    pub info: UpdateInfo,
    /// Whether it was newer than what its region had. Older ones are not shown, but later deltas
    /// may build on them.
    pub news: bool,
}
