//! Frames of one page as video → light.

use lumencast_video::{H264Decoder, Picture, PictureDecoder};

use super::mapping::LightTable;
use super::planes::{Packing, irradiance};
use super::tile_light::TileLight;
use super::video_frame::VideoHead;
use crate::{DecodeError, FrameHead};

/// Decodes the frames of one page, in order. Holds the newest picture and what the video decoder takes.
pub(crate) struct PageDecoder {
    page_size: u32,
    packing: Packing,
    decoder: Option<H264Decoder>,
    newest: Option<(u64, Picture)>,
}

impl PageDecoder {
    pub(crate) fn new(page_size: u32, packing: Packing) -> Self {
        Self { page_size, packing, decoder: None, newest: None }
    }

    pub(crate) fn decode(&mut self, frame: &[u8]) -> Result<TileLight, DecodeError> {
        let (VideoHead { info, base, mapping }, unit) = VideoHead::split(frame)?;
        let table = LightTable::new(mapping);
        if !table.is_finite() {
            return Err(DecodeError::Malformed("a value is not finite"));
        }
        let newest = self.newest.as_ref().map(|(update, _)| *update);
        if newest.is_some_and(|newest| newest >= info.update) {
            return Err(DecodeError::Late { update: info.update });
        }
        if let Some(base) = base.filter(|base| newest != Some(*base)) {
            return Err(DecodeError::MissingBase { update: info.update, base });
        }
        let picture = match (unit.is_empty(), self.newest.take()) {
            (true, Some((_, picture))) if base.is_some() => picture,
            (true, _) => return Err(DecodeError::Malformed("a keyframe without a picture")),
            (false, _) => self.picture(unit)?,
        };
        let light = irradiance(&picture, self.packing, self.page_size, &table);
        self.newest = Some((info.update, picture));
        let head = FrameHead { info, base, scale_log2: mapping.scale_log2 };
        Ok(TileLight { head, irradiance: light })
    }

    /// Decodes an access unit. After an error nothing is known until the next keyframe.
    fn picture(&mut self, unit: &[u8]) -> Result<Picture, DecodeError> {
        let video = |error| DecodeError::Video(error);
        let decoder = match &mut self.decoder {
            Some(decoder) => decoder,
            None => self.decoder.insert(H264Decoder::new().map_err(video)?),
        };
        let decoded = decoder.decode(unit).map_err(video);
        let picture = decoded.inspect_err(|_| self.decoder = None)?;
        if (picture.width, picture.height) != self.packing.size(self.page_size) {
            self.decoder = None;
            return Err(DecodeError::Mismatch("size"));
        }
        Ok(picture)
    }
}
