//! Where the page comes from.

use std::io;
use std::path::Path;

use axum::body::Bytes;

use crate::contents::Contents;
use crate::files::FileSet;

/// `(name, bytes)` of the page's files if it was built when this crate was compiled.
mod embedded {
    include!(concat!(env!("OUT_DIR"), "/page.rs"));
}

/// Shown where there is no page to show.
pub(crate) const MISSING: &str = include_str!("missing.html");

/// Whether the page was compiled in.
pub fn is_embedded() -> bool {
    !embedded::FILES.is_empty()
}

/// The files of the page: those of a folder if one is given, else those compiled in.
pub(crate) fn files(folder: Option<&Path>) -> io::Result<FileSet> {
    match folder {
        Some(folder) => FileSet::folder(folder),
        None => {
            let file = |&(name, bytes): &(&str, &'static [u8])| {
                (name.to_owned(), Contents::of(Bytes::from_static(bytes)))
            };
            Ok(embedded::FILES.iter().map(file).collect::<FileSet>().compressed())
        }
    }
}
