use thiserror::Error;

/// Why a picture could not be coded.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum VideoError {
    /// The picture is larger than the codec's encoder takes.
    #[error("pictures of {width} × {height} are beyond H.264's encoder: at most 3840 × 2160")]
    Size {
        /// Samples along x.
        width: u32,
        /// Samples along y.
        height: u32,
    },
    /// The encoder has failed, for a reason of its own.
    #[error("the video encoder has failed: {0}")]
    Encoder(String),
    /// Bytes that are no access unit of this stream.
    #[error("the access unit cannot be decoded: {0}")]
    Unit(String),
}
