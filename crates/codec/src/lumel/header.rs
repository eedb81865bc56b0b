//! The head of a lumel frame.

use glam::UVec2;

use crate::bytes::{Reader, put_varint};
use crate::{DecodeError, FrameHead, UpdateInfo, limits};

/// All of a lumel frame but its payload.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LumelHeader {
    /// When and from what it was computed.
    pub info: UpdateInfo,
    /// The update that a delta changes; `None` in a keyframe.
    pub base: Option<u64>,
    /// log2 of the scale that the halves are stored by.
    pub scale_log2: i8,
    /// Lumels of the tile along x and y.
    pub size: UVec2,
}

impl LumelHeader {
    /// Appends the header. `base` must be 1 to 255 updates back.
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        let Self { info, base, scale_log2, size } = *self;
        FrameHead { info, base, scale_log2 }.write(out);
        put_varint(out, size.x.into());
        put_varint(out, size.y.into());
    }

    /// Reads the header of a frame without decoding its payload: enough to know its update and size.
    ///
    /// # Errors
    /// [`DecodeError`] when the bytes are no header of this version or exceed a limit.
    pub fn read(frame: &[u8]) -> Result<Self, DecodeError> {
        Self::split(frame).map(|(header, _)| header)
    }

    /// Header and payload.
    pub(crate) fn split(frame: &[u8]) -> Result<(Self, &[u8]), DecodeError> {
        let (FrameHead { info, base, scale_log2 }, mut reader) = FrameHead::split(frame)?;
        let size = UVec2::new(side(&mut reader)?, side(&mut reader)?);
        Ok((Self { info, base, scale_log2, size }, reader.0))
    }
}

fn side(reader: &mut Reader<'_>) -> Result<u32, DecodeError> {
    let lumels = usize::try_from(reader.varint()?).unwrap_or(usize::MAX);
    DecodeError::limit("lumels of a tile along a side", lumels, limits::TILE_LUMELS as usize)?;
    if lumels == 0 {
        return Err(DecodeError::Malformed("an empty tile"));
    }
    Ok(lumels as u32)
}
