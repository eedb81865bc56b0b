//! Frames of one region → light.

use glam::{UVec3, Vec3};
use lumencast_light::Order;

use super::header::ProbeHeader;
use super::model::{Given, Reconstruction, code_region};
use super::quantise::to_rgb;
use crate::DecodeError;
use crate::range_coder::Decoder;
use crate::update_info::layer;

/// Decodes the frames of one region of a field. Holds the newest reconstruction of layers 0 and 1,
/// which deltas refer to: for an L2 region of 512 probes 2 × 55 KiB.
#[derive(Clone, Debug)]
pub struct ProbeDecoder {
    size: UVec3,
    order: Order,
    bases: [Option<(u64, Reconstruction)>; 2],
}

/// Light of a region at one update.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionLight {
    /// What the frame's header says.
    pub header: ProbeHeader,
    /// Coefficients (r, g, b), cd/m²: `order.coefficients()` a probe, probes in index order of the
    /// region (x fastest, then y, then z).
    pub coefficients: Vec<Vec3>,
}

impl ProbeDecoder {
    /// For a region of `size` cells, as the catalog says.
    pub fn new(size: UVec3, order: Order) -> Self {
        Self { size, order, bases: [None, None] }
    }

    /// Decodes a frame. Frames may come in any order and may be missing.
    ///
    /// # Errors
    /// Any [`DecodeError`]; the decoder is then as it was. [`DecodeError::MissingBase`] is no fault
    /// of the sender: the frame's base was lost, or has been replaced by a newer one.
    pub fn decode(&mut self, frame: &[u8]) -> Result<RegionLight, DecodeError> {
        let (header, payload) = ProbeHeader::split(frame)?;
        if header.size != self.size {
            return Err(DecodeError::Mismatch("size"));
        }
        if header.order != self.order {
            return Err(DecodeError::Mismatch("order"));
        }
        let base = header.base.map(|base| self.base(header.info.update, base)).transpose()?;
        let mut decoder =
            Decoder::new(payload).ok_or(DecodeError::Malformed("start of the payload"))?;
        let region = code_region(&mut decoder, self.size, self.order, base, &mut Given)?;
        if !decoder.at_end() {
            return Err(DecodeError::Malformed("bytes after the end"));
        }
        let coefficients = region.values.iter().copied().map(to_rgb).collect();
        self.keep(header.info.update, region);
        Ok(RegionLight { header, coefficients })
    }

    fn base(&self, update: u64, base: u64) -> Result<&Reconstruction, DecodeError> {
        self.bases
            .iter()
            .flatten()
            .find_map(|(number, region)| (*number == base).then_some(region))
            .ok_or(DecodeError::MissingBase { update, base })
    }

    /// Keeps what later deltas may refer to; late frames do not replace newer ones.
    fn keep(&mut self, update: u64, region: Reconstruction) {
        if let Some(slot) = self.bases.get_mut(usize::from(layer(update)))
            && slot.as_ref().is_none_or(|(newest, _)| *newest < update)
        {
            *slot = Some((update, region));
        }
    }
}
