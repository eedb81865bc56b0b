//! Where the bytes of a file are that is served.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use axum::body::Bytes;
use flate2::Compression;
use flate2::write::GzEncoder;

use crate::media_type::is_text;

/// Text shorter than this, bytes, is not worth compressing.
const SHORT: usize = 1024;

/// Where the bytes of a file are.
#[derive(Clone, Debug)]
pub(crate) enum Contents {
    /// On disk, by a path without links; streamed at each request.
    Path(PathBuf),
    /// In memory, and for those who accept it the same compressed.
    Bytes { plain: Bytes, gzip: Option<Bytes> },
}

impl Contents {
    /// A file on disk. Where a link leads is looked up now, and followed no more.
    pub(crate) fn at(path: &Path) -> io::Result<Self> {
        Ok(Self::Path(path.canonicalize()?))
    }

    pub(crate) fn of(bytes: Bytes) -> Self {
        Self::Bytes { plain: bytes, gzip: None }
    }

    /// The same with text that is kept in memory compressed, too.
    pub(crate) fn compressed(self, name: &str) -> Self {
        match self {
            Self::Bytes { plain, .. } if is_text(name) && plain.len() >= SHORT => {
                let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
                let gzip = gzip.write_all(&plain).and_then(|()| gzip.finish());
                Self::Bytes { plain, gzip: gzip.ok().map(Bytes::from) }
            }
            other => other,
        }
    }
}
