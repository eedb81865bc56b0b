//! Frames of one tile, as halves → light.

use glam::{UVec2, Vec3};

use super::halves::{Lumel, to_rgb};
use super::header::LumelHeader;
use super::model::code_tile;
use super::tile_light::TileLight;
use crate::range_coder::Decoder;
use crate::{DecodeError, FrameHead};

/// Decodes the frames of one tile, in any order. Holds the newest, which deltas refer to.
#[derive(Debug)]
pub(crate) struct TileDecoder {
    size: UVec2,
    newest: Option<(u64, Vec<Lumel>)>,
}

impl TileDecoder {
    pub(crate) fn new(size: UVec2) -> Self {
        Self { size, newest: None }
    }

    pub(crate) fn decode(&mut self, frame: &[u8]) -> Result<TileLight, DecodeError> {
        let (header, payload) = LumelHeader::split(frame)?;
        if header.size != self.size {
            return Err(DecodeError::Mismatch("size"));
        }
        let update = header.info.update;
        let base = header.base.map(|base| self.base(update, base)).transpose()?;
        let mut decoder =
            Decoder::new(payload).ok_or(DecodeError::Malformed("start of the payload"))?;
        let lumels = code_tile(&mut decoder, self.size, base, None)?;
        if !decoder.at_end() {
            return Err(DecodeError::Malformed("bytes after the end"));
        }
        let scaled = |lumel: &Lumel| to_rgb(*lumel, header.scale_log2);
        let irradiance: Vec<Vec3> = lumels.iter().map(scaled).collect();
        if !irradiance.iter().all(|irradiance| irradiance.is_finite()) {
            return Err(DecodeError::Malformed("a value is not finite"));
        }
        // Late frames do not replace newer ones.
        if self.newest.as_ref().is_none_or(|(newest, _)| *newest < update) {
            self.newest = Some((update, lumels));
        }
        let LumelHeader { info, base, scale_log2, .. } = header;
        Ok(TileLight { head: FrameHead { info, base, scale_log2 }, irradiance })
    }

    fn base(&self, update: u64, base: u64) -> Result<&[Lumel], DecodeError> {
        match &self.newest {
            Some((newest, lumels)) if *newest == base => Ok(lumels),
            _ => Err(DecodeError::MissingBase { update, base }),
        }
    }
}
