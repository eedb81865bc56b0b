//! How lumels are coded.

use lumencast_video::{H264Encoder, Qp, VideoError};
use serde::{Deserialize, Serialize};

use super::planes::Packing;

/// How lumels are coded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Coding {
    /// As half floats, without loss.
    #[default]
    Halves,
    /// As H.264, with colour at half the resolution.
    H264,
    /// As H.264, with colour at full resolution.
    H264Stacked,
}

impl Coding {
    /// How pages become pictures, where they do.
    pub(crate) fn packing(self) -> Option<Packing> {
        match self {
            Self::Halves => None,
            Self::H264 => Some(Packing::Subsampled),
            Self::H264Stacked => Some(Packing::Stacked),
        }
    }
}

/// How a server codes lumels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LumelCoding {
    /// As half floats, without loss: for files, and for clients on the same machine.
    #[default]
    Halves,
    /// As video, with colour at half the resolution.
    H264(Qp),
    /// As video, with colour at full resolution: more bytes, and more nearly what was computed.
    H264Stacked(Qp),
}

impl LumelCoding {
    /// As a catalog tells it.
    pub fn coding(self) -> Coding {
        match self {
            Self::Halves => Coding::Halves,
            Self::H264(_) => Coding::H264,
            Self::H264Stacked(_) => Coding::H264Stacked,
        }
    }

    /// Whether pages of so many lumels a side can be coded so.
    ///
    /// # Errors
    /// [`VideoError::Size`] where they are too large for the video encoder.
    pub fn check(self, page_size: u32) -> Result<(), VideoError> {
        match self.video() {
            None => Ok(()),
            Some((packing, _)) => {
                let (width, height) = packing.size(page_size);
                H264Encoder::check(width, height)
            }
        }
    }

    /// How pages become pictures, where they do.
    pub(crate) fn video(self) -> Option<(Packing, Qp)> {
        let (Self::H264(qp) | Self::H264Stacked(qp)) = self else { return None };
        self.coding().packing().map(|packing| (packing, qp))
    }
}
