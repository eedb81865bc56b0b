//! What can be wrong with a picture.

use std::io;
use std::path::PathBuf;

/// A picture that cannot be made, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// No pixels.
    #[error("a picture of {width} × {height} pixels is empty")]
    Empty {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Not as many pixels as the size says.
    #[error("{given} pixels are given for a picture of {width} × {height}")]
    Length {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Pixels there were.
        given: usize,
    },
    /// The file cannot be read.
    #[error("cannot read {}: {error}", file.display())]
    Read {
        /// As it was named.
        file: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// A file of another kind.
    #[error("{} is not a picture that is read here; give a PNG, OpenEXR or Radiance HDR file", file.display())]
    Kind {
        /// As it was named.
        file: PathBuf,
    },
    /// Broken, cut off, or of a variant that is not read.
    #[error("cannot decode {}: {error}; write it anew, OpenEXR with channels R, G and B", file.display())]
    Decode {
        /// As it was named.
        file: PathBuf,
        /// What the decoder says.
        error: image::ImageError,
    },
    /// The file cannot be written.
    #[error("cannot write {}: {error}", file.display())]
    Write {
        /// As it was named.
        file: PathBuf,
        /// Why.
        error: io::Error,
    },
}

/// Two pictures that cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// They have different sizes.
    #[error(
        "the reference has {} × {} pixels and the picture {} × {}; render both at one size",
        reference.0, reference.1, picture.0, picture.1
    )]
    Sizes {
        /// Width and height of the reference.
        reference: (u32, u32),
        /// Width and height of the picture.
        picture: (u32, u32),
    },
    /// A value is infinite or not a number.
    #[error(
        "{which} has {count} pixels that are not finite, the first at column {x}, row {y} from the \
         top left; whatever made it has a fault"
    )]
    NotFinite {
        /// Which of the two.
        which: &'static str,
        /// Such pixels.
        count: usize,
        /// Column of the first.
        x: u32,
        /// Row of the first.
        y: u32,
    },
}
