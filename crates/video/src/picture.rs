//! A picture, and the two traits that a codec implements.

use crate::VideoError;

/// A picture of 8 bits a sample, full range: a plane of luma, and two of chroma at half its resolution
/// along both axes (4:2:0), without padding between rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Samples of luma along x; even.
    pub width: u32,
    /// Samples of luma along y; even.
    pub height: u32,
    /// Luma, `width` × `height`.
    pub luma: Vec<u8>,
    /// Both planes of chroma, `width / 2` × `height / 2` each.
    pub chroma: [Vec<u8>; 2],
}

impl Picture {
    /// A picture of one colour.
    ///
    /// # Panics
    /// If a side is odd.
    pub fn plain(width: u32, height: u32, luma: u8, chroma: [u8; 2]) -> Self {
        assert!(width.is_multiple_of(2) && height.is_multiple_of(2), "sides are even");
        let samples = width as usize * height as usize;
        let chroma = chroma.map(|value| vec![value; samples / 4]);
        Self { width, height, luma: vec![luma; samples], chroma }
    }
}

/// Turns pictures of one size into access units, in order.
pub trait PictureEncoder: Send {
    /// The access unit of the next picture. A keyframe can be decoded without those before it.
    ///
    /// # Errors
    /// [`VideoError::Size`] or [`VideoError::Encoder`].
    fn encode(&mut self, picture: &Picture, keyframe: bool) -> Result<Vec<u8>, VideoError>;
}

/// Turns access units into pictures, in the order of the encoder. After an error the next unit must be
/// a keyframe.
pub trait PictureDecoder: Send {
    /// The picture of the next access unit.
    ///
    /// # Errors
    /// [`VideoError::Unit`] when the bytes are no access unit, or what it builds on is missing.
    fn decode(&mut self, unit: &[u8]) -> Result<Picture, VideoError>;
}
