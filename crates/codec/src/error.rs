//! Why bytes were refused.

use lumencast_video::VideoError;
use thiserror::Error;

/// Why bytes were refused. Nothing changes in a decoder that refuses a frame.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The bytes end before the value does.
    #[error("the bytes end too early")]
    Truncated,
    /// Made by another version of the format.
    #[error("version {found} of the format, this program reads version {known}")]
    Version {
        /// That version.
        found: u64,
        /// The version that this program reads.
        known: u64,
    },
    /// A limit of docs/wire.md is exceeded.
    #[error("{what}: {value} exceeds the limit of {limit}")]
    Limit {
        /// What is too large.
        what: &'static str,
        /// How large it is.
        value: u64,
        /// How large it may be.
        limit: u64,
    },
    /// A value that the format does not allow.
    #[error("malformed: {0}")]
    Malformed(&'static str),
    /// Text that is not the JSON expected.
    #[error("JSON: {0}")]
    Json(String),
    /// A delta whose base this decoder does not hold: an older frame was lost. Wait for a keyframe,
    /// or for the next frame of a lower layer.
    #[error("update {update} needs update {base}, which is not at hand")]
    MissingBase {
        /// The update that the frame holds.
        update: u64,
        /// The update that it changes.
        base: u64,
    },
    /// A frame of video that is older than what was decoded. It is no fault of the sender.
    #[error("update {update} comes after a newer one")]
    Late {
        /// The update that the frame holds.
        update: u64,
    },
    /// Video that cannot be decoded. Wait for a keyframe.
    #[error(transparent)]
    Video(VideoError),
    /// The frame's region is not of the size or order that the catalog says.
    #[error("the frame does not fit its region: {0}")]
    Mismatch(&'static str),
}

impl DecodeError {
    /// The kind as a word, the same in every implementation (see `vectors/codec.json`).
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Truncated => "truncated",
            Self::Version { .. } => "version",
            Self::Limit { .. } => "limit",
            Self::Malformed(_) => "malformed",
            Self::Json(_) => "json",
            Self::MissingBase { .. } => "missing_base",
            Self::Late { .. } => "late",
            Self::Video(_) => "video",
            Self::Mismatch(_) => "mismatch",
        }
    }

    /// `Err(Limit)` if `value` exceeds `limit`.
    pub(crate) fn limit(what: &'static str, value: usize, limit: usize) -> Result<(), Self> {
        if value > limit {
            return Err(Self::Limit { what, value: value as u64, limit: limit as u64 });
        }
        Ok(())
    }
}

/// A JSON error as ours.
pub(crate) fn json<T>(result: serde_json::Result<T>) -> Result<T, DecodeError> {
    result.map_err(|error| DecodeError::Json(error.to_string()))
}
