//! Frames of one region of a lightmap → light.

use glam::UVec2;

use super::coding::Coding;
use super::page_decoder::PageDecoder;
use super::tile_decoder::TileDecoder;
use super::tile_light::TileLight;
use crate::DecodeError;

/// Decodes the frames of one tile of a lightmap. Holds the newest, which deltas refer to: 6 bytes a
/// lumel; as video 1.5, 3 where planes are stacked, and what [`lumencast_video::H264Decoder`] takes.
pub struct LumelDecoder(Kind);

enum Kind {
    Tile(TileDecoder),
    Page(Box<PageDecoder>),
}

impl LumelDecoder {
    /// For a tile of `size` lumels of a lightmap that is coded so, as the catalog says.
    pub fn new(coding: Coding, size: UVec2) -> Self {
        Self(match coding.packing() {
            None => Kind::Tile(TileDecoder::new(size)),
            Some(packing) => Kind::Page(Box::new(PageDecoder::new(size.x, packing))),
        })
    }

    /// Decodes a frame. Frames may come in any order and may be missing.
    ///
    /// # Errors
    /// Any [`DecodeError`]; the decoder is then as it was, or waits for a keyframe where video was
    /// damaged. [`DecodeError::MissingBase`] is no fault of the sender: the frame's base was lost, or
    /// has been replaced by a newer one; nor is [`DecodeError::Late`].
    pub fn decode(&mut self, frame: &[u8]) -> Result<TileLight, DecodeError> {
        match &mut self.0 {
            Kind::Tile(decoder) => decoder.decode(frame),
            Kind::Page(decoder) => decoder.decode(frame),
        }
    }
}

impl std::fmt::Debug for LumelDecoder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LumelDecoder").finish_non_exhaustive()
    }
}
