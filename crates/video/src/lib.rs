//! Pictures as access units of a video codec, and back. What a picture's samples mean is not known
//! here.
//!
//! H.264 by openh264, which is built from source. Another codec is another pair of implementations of
//! [`PictureEncoder`] and [`PictureDecoder`].

mod error;
mod h264;
mod picture;

pub use error::VideoError;
pub use h264::{H264Decoder, H264Encoder, Qp};
pub use picture::{Picture, PictureDecoder, PictureEncoder};
