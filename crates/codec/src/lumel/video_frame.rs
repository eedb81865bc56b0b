//! Frames that hold an access unit.

use super::mapping::{MAX_TOE, Mapping};
use crate::{DecodeError, FrameHead, UpdateInfo};

/// All of a frame but its access unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VideoHead {
    pub(crate) info: UpdateInfo,
    pub(crate) base: Option<u64>,
    pub(crate) mapping: Mapping,
}

impl VideoHead {
    /// Appends the head. `base` must be 1 to 255 updates back.
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        let Mapping { scale_log2, toe, range } = self.mapping;
        FrameHead { info: self.info, base: self.base, scale_log2 }.write(out);
        out.extend([toe, range]);
    }

    /// Head and access unit.
    pub(crate) fn split(frame: &[u8]) -> Result<(Self, &[u8]), DecodeError> {
        let (FrameHead { info, base, scale_log2 }, mut reader) = FrameHead::split(frame)?;
        let (toe, range) = (reader.u8()?, reader.u8()?);
        if toe > MAX_TOE || range == 0 {
            return Err(DecodeError::Malformed("the mapping of codes"));
        }
        Ok((Self { info, base, mapping: Mapping { scale_log2, toe, range } }, reader.0))
    }
}
