//! Frames of one tile → light.

use glam::{UVec2, Vec3};

use super::halves::{Lumel, to_rgb};
use super::header::LumelHeader;
use super::model::code_tile;
use crate::DecodeError;
use crate::range_coder::Decoder;

/// Decodes the frames of one tile of a lightmap. Holds the newest, which deltas refer to: 6 bytes a
/// lumel.
#[derive(Clone, Debug)]
pub struct LumelDecoder {
    size: UVec2,
    newest: Option<(u64, Vec<Lumel>)>,
}

/// Light of a tile at one update.
#[derive(Clone, Debug, PartialEq)]
pub struct TileLight {
    /// What the frame's header says.
    pub header: LumelHeader,
    /// Irradiance (r, g, b), lux, row after row.
    pub irradiance: Vec<Vec3>,
}

impl LumelDecoder {
    /// For a tile of `size` lumels, as the catalog says.
    pub fn new(size: UVec2) -> Self {
        Self { size, newest: None }
    }

    /// Decodes a frame. Frames may come in any order and may be missing.
    ///
    /// # Errors
    /// Any [`DecodeError`]; the decoder is then as it was. [`DecodeError::MissingBase`] is no fault
    /// of the sender: the frame's base was lost, or has been replaced by a newer one.
    pub fn decode(&mut self, frame: &[u8]) -> Result<TileLight, DecodeError> {
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
        Ok(TileLight { header, irradiance })
    }

    fn base(&self, update: u64, base: u64) -> Result<&[Lumel], DecodeError> {
        match &self.newest {
            Some((newest, lumels)) if *newest == base => Ok(lumels),
            _ => Err(DecodeError::MissingBase { update, base }),
        }
    }
}
