//! Files that may be served: an allow-list of names, so that no request can name another.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use axum::body::{Body, Bytes};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

/// Where the bytes of a file are.
#[derive(Clone, Debug)]
pub(crate) enum Contents {
    /// On disk; read at each request.
    Path(PathBuf),
    /// In memory.
    Bytes(Bytes),
}

/// Names, relative to a URL, with forward slashes, and what stands behind them.
#[derive(Clone, Debug, Default)]
pub(crate) struct FileSet(BTreeMap<String, Contents>);

impl FromIterator<(String, Contents)> for FileSet {
    fn from_iter<I: IntoIterator<Item = (String, Contents)>>(files: I) -> Self {
        Self(files.into_iter().collect())
    }
}

impl FileSet {
    /// All files of a folder and of the folders in it. Symbolic links are left out.
    pub(crate) fn folder(root: &Path) -> io::Result<Self> {
        let mut files = Self::default();
        let mut folders = vec![(root.to_owned(), String::new())];
        while let Some((folder, prefix)) = folders.pop() {
            for entry in std::fs::read_dir(folder)? {
                let entry = entry?;
                let kind = entry.file_type()?;
                let Ok(name) = entry.file_name().into_string() else {
                    tracing::warn!(path = %entry.path().display(), "not served: its name is not UTF-8");
                    continue;
                };
                let name = format!("{prefix}{name}");
                if kind.is_dir() {
                    folders.push((entry.path(), name + "/"));
                } else if kind.is_file() {
                    files.0.insert(name, Contents::Path(entry.path()));
                }
            }
        }
        Ok(files)
    }

    /// Whether there is a file of this name.
    pub(crate) fn contains(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    /// The names of all files.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// What stands behind a name.
    pub(crate) fn get(&self, name: &str) -> Option<&Contents> {
        self.0.get(name)
    }
}

/// The answer to a request for a file.
pub(crate) async fn respond(name: &str, contents: Option<Contents>) -> Response {
    let bytes = match contents {
        None => return (StatusCode::NOT_FOUND, "no such file\n").into_response(),
        Some(Contents::Bytes(bytes)) => bytes,
        Some(Contents::Path(path)) => match tokio::fs::read(&path).await {
            Ok(bytes) => bytes.into(),
            Err(error) => {
                tracing::warn!(path = %path.display(), %error, "cannot read a file to serve");
                return (StatusCode::NOT_FOUND, "the file cannot be read\n").into_response();
            }
        },
    };
    let kind = HeaderValue::from_static(content_type(name));
    ([(header::CONTENT_TYPE, kind)], Body::from(bytes)).into_response()
}

/// The media type of a file by the end of its name.
fn content_type(name: &str) -> &'static str {
    let extension = name.rsplit_once('.').map_or("", |(_, e)| e).to_ascii_lowercase();
    match extension.as_str() {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" | "map" => "application/json",
        "txt" => "text/plain; charset=utf-8",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        "wasm" => "application/wasm",
        "glb" => "model/gltf-binary",
        "gltf" => "model/gltf+json",
        "hdr" => "image/vnd.radiance",
        "exr" => "image/x-exr",
        _ => "application/octet-stream",
    }
}
