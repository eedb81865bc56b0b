//! The head of a probe frame.

use glam::UVec3;
use lumencast_light::Order;

use crate::bytes::{Reader, put_varint};
use crate::{DecodeError, VERSION, limits};

/// What an update of a field was computed from, and when.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UpdateInfo {
    /// Number u of the update; grows by one an update of the field.
    pub update: u64,
    /// The tick that computed it.
    pub tick: u64,
    /// Scene time of that tick, seconds.
    pub time: f64,
    /// Version of the scene that it shows.
    pub scene_version: u64,
}

impl UpdateInfo {
    /// The temporal layer of an update: 0 for every fourth, 1 for the other even ones, 2 for the odd.
    pub fn layer(&self) -> u8 {
        layer(self.update)
    }
}

/// The temporal layer of update number `update`.
pub(crate) fn layer(update: u64) -> u8 {
    match update % 4 {
        0 => 0,
        2 => 1,
        _ => 2,
    }
}

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

const KEYFRAME: u8 = 1;

impl ProbeHeader {
    /// Number of probes.
    pub fn probes(&self) -> usize {
        self.size.as_usizevec3().element_product()
    }

    /// Appends the header. `base` must be 1 to 255 updates back.
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        out.push(VERSION as u8);
        out.push(if self.base.is_none() { KEYFRAME } else { 0 });
        put_varint(out, self.info.update);
        put_varint(out, self.base.map_or(0, |base| self.info.update - base));
        put_varint(out, self.info.scene_version);
        put_varint(out, self.info.tick);
        out.extend(self.info.time.to_le_bytes());
        out.push(self.scale_log2 as u8);
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
        if base.is_some_and(|base| layer(base) > layer(update)) {
            return Err(DecodeError::Malformed("a base in a higher layer"));
        }
        let scene_version = reader.varint()?;
        let tick = reader.varint()?;
        let time = reader.f64()?;
        if !time.is_finite() {
            return Err(DecodeError::Malformed("time is not finite"));
        }
        let scale_log2 = reader.u8()? as i8;
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
        let info = UpdateInfo { update, tick, time, scene_version };
        Ok((Self { info, base, scale_log2, order, size }, reader.0))
    }
}
