//! The head of a probe frame.

use glam::UVec3;
use lumencast_light::Order;

use crate::update_info::layer;
use crate::{DecodeError, FrameHead, UpdateInfo, limits};

/// All of a probe frame but its payload.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeHeader {
    /// When and from what it was computed.
    pub info: UpdateInfo,
    /// The update that a delta changes; `None` in a keyframe.
    pub base: Option<u64>,
    /// log2 of the scale that half floats are stored by.
    pub scale_log2: i8,
    /// Order of the expansion.
    pub order: Order,
    /// Cells of the region along x, y, z.
    pub size: UVec3,
}

impl ProbeHeader {
    /// Number of probes.
    pub fn probes(&self) -> usize {
        self.size.as_usizevec3().element_product()
    }

    /// Appends the header. `base` must be 1 to 255 updates back.
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        let Self { info, base, scale_log2, .. } = *self;
        FrameHead { info, base, scale_log2 }.write(out);
        out.push(self.order.into());
        out.extend(self.size.to_array().map(|cells| cells as u8));
    }

    /// Reads the header of a frame without decoding its payload: enough to know its update, order
    /// and size.
    ///
    /// # Errors
    /// [`DecodeError`] when the bytes are no header of this version or exceed a limit.
    pub fn read(frame: &[u8]) -> Result<Self, DecodeError> {
        Self::split(frame).map(|(header, _)| header)
    }

    /// Header and payload.
    pub(crate) fn split(frame: &[u8]) -> Result<(Self, &[u8]), DecodeError> {
        let (FrameHead { info, base, scale_log2 }, mut reader) = FrameHead::split(frame)?;
        if base.is_some_and(|base| layer(base) > layer(info.update)) {
            return Err(DecodeError::Malformed("a base in a higher layer"));
        }
        let order = Order::try_from(reader.u8()?).map_err(|_| DecodeError::Malformed("order"))?;
        let size = reader.take(3)?;
        let size = UVec3::new(size[0].into(), size[1].into(), size[2].into());
        if size.min_element() == 0 {
            return Err(DecodeError::Malformed("an empty region"));
        }
        let cells = size.max_element() as usize;
        DecodeError::limit(
            "cells of a region along an axis",
            cells,
            limits::REGION_CELLS as usize,
        )?;
        Ok((Self { info, base, scale_log2, order, size }, reader.0))
    }
}
