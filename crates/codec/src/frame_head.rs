//! What frames of light begin with, whatever the field's kind.

use crate::bytes::{Reader, put_varint};
use crate::{DecodeError, UpdateInfo, VERSION, limits};

/// What frames of light begin with, whatever the field's kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameHead {
    /// When and from what it was computed.
    pub info: UpdateInfo,
    /// The update that a delta changes; `None` in a keyframe.
    pub base: Option<u64>,
    /// log2 of the scale that half floats are stored by.
    pub scale_log2: i8,
}

const KEYFRAME: u8 = 1;

impl FrameHead {
    /// Reads the head of a frame of any kind: enough to know its update.
    ///
    /// # Errors
    /// [`DecodeError`] when the bytes are no head of this version or exceed a limit.
    pub fn read(frame: &[u8]) -> Result<Self, DecodeError> {
        Self::split(frame).map(|(head, _)| head)
    }

    /// The head, and what follows it.
    pub(crate) fn split(frame: &[u8]) -> Result<(Self, Reader<'_>), DecodeError> {
        DecodeError::limit("bytes of a frame", frame.len(), limits::FRAME_BYTES)?;
        let mut reader = Reader(frame);
        let version = u64::from(reader.u8()?);
        if version != VERSION {
            return Err(DecodeError::Version { found: version, known: VERSION });
        }
        let flags = reader.u8()?;
        if flags & !KEYFRAME != 0 {
            return Err(DecodeError::Malformed("unknown flags"));
        }
        let update = reader.varint()?;
        let distance = reader.varint()?;
        let base = match (flags & KEYFRAME != 0, distance) {
            (true, 0) => None,
            (true, _) => return Err(DecodeError::Malformed("a keyframe with a base")),
            (false, 1..=255) if distance <= update => Some(update - distance),
            (false, _) => return Err(DecodeError::Malformed("distance to the base")),
        };
        let scene_version = reader.varint()?;
        let tick = reader.varint()?;
        let time = reader.f64()?;
        if !time.is_finite() {
            return Err(DecodeError::Malformed("time is not finite"));
        }
        let scale_log2 = reader.u8()? as i8;
        let info = UpdateInfo { update, tick, time, scene_version };
        Ok((Self { info, base, scale_log2 }, reader))
    }

    /// Appends the head. `base` must be 1 to 255 updates back.
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        out.push(VERSION as u8);
        out.push(if self.base.is_none() { KEYFRAME } else { 0 });
        put_varint(out, self.info.update);
        put_varint(out, self.base.map_or(0, |base| self.info.update - base));
        put_varint(out, self.info.scene_version);
        put_varint(out, self.info.tick);
        out.extend(self.info.time.to_le_bytes());
        out.push(self.scale_log2 as u8);
    }
}
