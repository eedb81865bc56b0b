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
    #[error("cannot read {}: {source}", file.display())]
    Read {
        /// As it was named.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file of another kind.
    #[error("{} is not a picture that is read here; give a PNG, OpenEXR or Radiance HDR file", file.display())]
    Kind {
        /// As it was named.
        file: PathBuf,
    },
    /// Broken, cut off, or of a variant that is not read.
    #[error("cannot decode {}: {source}; write it anew, OpenEXR with channels R, G and B", file.display())]
    Decode {
        /// As it was named.
        file: PathBuf,
        /// What the decoder says.
        source: image::ImageError,
    },
    /// The file cannot be written.
    #[error("cannot write {}: {source}", file.display())]
    Write {
        /// As it was named.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
}
