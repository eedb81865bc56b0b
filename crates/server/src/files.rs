//! Files that may be served: an allow-list of names, so that no request can name another.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use axum::body::Body;
use axum::http::request::Parts;
use axum::http::{HeaderValue, Request, StatusCode, header};
use axum::response::{IntoResponse, Response};
use tower_http::services::ServeDir;

use crate::contents::Contents;
use crate::media_type::content_type;
use crate::open_file::Resource;

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
        let mut folders = vec![(root.canonicalize()?, String::new())];
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

    /// The same with text that is kept in memory compressed, too.
    pub(crate) fn compressed(self) -> Self {
        let each = |(name, contents): (String, Contents)| {
            let contents = contents.compressed(&name);
            (name, contents)
        };
        self.0.into_iter().map(each).collect()
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

/// The answer to a request for a file: all of it or the range that is asked for, unless the client has it
/// already.
pub(crate) async fn respond(name: &str, contents: Option<Contents>, asked: &Parts) -> Response {
    let Some(contents) = contents else {
        return (StatusCode::NOT_FOUND, "no such file\n").into_response();
    };
    // What is served does not depend on the path, but for the ending of what is compressed.
    let mut request = Request::builder().method(asked.method.clone()).uri("/file");
    if let Some(headers) = request.headers_mut() {
        headers.clone_from(&asked.headers);
    }
    let Ok(request) = request.body(Body::empty()) else {
        return StatusCode::BAD_REQUEST.into_response();
    };
    let path = match &contents {
        Contents::Path(path) => path.clone(),
        Contents::Bytes { .. } => PathBuf::new(),
    };
    let mut service = ServeDir::with_backend("", Resource(contents))
        .append_index_html_on_directories(false)
        .precompressed_gzip();
    let mut response = match service.try_call(request).await {
        Ok(response) => response.map(Body::new),
        Err(error) => {
            tracing::warn!(path = %path.display(), %error, "cannot read a file to serve");
            return (StatusCode::NOT_FOUND, "the file cannot be read\n").into_response();
        }
    };
    if response.status().is_success() {
        let kind = HeaderValue::from_static(content_type(name));
        response.headers_mut().insert(header::CONTENT_TYPE, kind);
    }
    response
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Read;

    use axum::body::{Bytes, HttpBody};
    use flate2::read::GzDecoder;

    use super::*;

    async fn ask(contents: &Contents, name: &str, headers: &[(&str, &str)]) -> Response {
        let mut request = Request::get("/elsewhere");
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let (asked, ()) = request.body(()).expect("a request").into_parts();
        respond(name, Some(contents.clone()), &asked).await
    }

    async fn bytes(response: Response) -> Vec<u8> {
        axum::body::to_bytes(response.into_body(), usize::MAX).await.expect("a body").to_vec()
    }

    fn folder() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.bin");
        fs::write(&path, b"0123456789").expect("written");
        (folder, path)
    }

    #[tokio::test]
    async fn files_come_whole_in_ranges_or_not_again() {
        let (_folder, path) = folder();
        let disk = Contents::at(&path).expect("there");
        for contents in [disk, Contents::of(Bytes::from_static(b"0123456789"))] {
            let whole = ask(&contents, "a.glb", &[]).await;
            assert_eq!(whole.headers()[header::CONTENT_TYPE], "model/gltf-binary");
            assert_eq!(whole.headers()[header::CONTENT_LENGTH], "10");
            let tag = whole.headers()[header::ETAG].to_str().expect("text").to_owned();
            assert_eq!(bytes(whole).await, b"0123456789");

            let part = ask(&contents, "a.glb", &[("range", "bytes=2-4")]).await;
            assert_eq!(part.status(), StatusCode::PARTIAL_CONTENT);
            assert_eq!(bytes(part).await, b"234");
            let beyond = ask(&contents, "a.glb", &[("range", "bytes=20-")]).await;
            assert_eq!(beyond.status(), StatusCode::RANGE_NOT_SATISFIABLE);
            let again = ask(&contents, "a.glb", &[("if-none-match", &tag)]).await;
            assert_eq!(again.status(), StatusCode::NOT_MODIFIED);
            assert!(bytes(again).await.is_empty());
        }
    }

    #[tokio::test]
    async fn large_files_come_in_pieces() {
        const LENGTH: usize = 3 << 20;
        let (_folder, path) = folder();
        fs::write(&path, vec![7; LENGTH]).expect("written");
        let contents = Contents::at(&path).expect("there");
        let mut body = ask(&contents, "a.bin", &[]).await.into_body();
        let (mut length, mut longest) = (0, 0);
        while let Some(frame) =
            std::future::poll_fn(|cx| std::pin::Pin::new(&mut body).poll_frame(cx)).await
        {
            let piece = frame.expect("read").into_data().expect("data").len();
            (length, longest) = (length + piece, longest.max(piece));
        }
        assert_eq!(length, LENGTH);
        assert!(longest <= 64 << 10, "{longest}");
    }

    #[tokio::test]
    async fn text_in_memory_is_compressed_for_those_who_accept_it() {
        let script = "let light = 1;\n".repeat(1000);
        let files = [("a.js".to_owned(), Contents::of(script.clone().into()))];
        let files = files.into_iter().collect::<FileSet>().compressed();
        let contents = files.get("a.js").expect("listed");
        let packed = ask(contents, "a.js", &[("accept-encoding", "gzip, br")]).await;
        assert_eq!(packed.headers()[header::CONTENT_ENCODING], "gzip");
        assert_eq!(packed.headers()[header::CONTENT_TYPE], "text/javascript; charset=utf-8");
        assert_eq!(packed.headers()[header::VARY], "accept-encoding");
        let packed = bytes(packed).await;
        assert!(packed.len() < script.len() / 10);
        let mut unpacked = String::new();
        GzDecoder::new(&packed[..]).read_to_string(&mut unpacked).expect("gzip");
        assert_eq!(unpacked, script);
        assert_eq!(bytes(ask(contents, "a.js", &[]).await).await, script.as_bytes());
        let (_folder, path) = folder();
        let disk = Contents::at(&path).expect("there");
        let plain = ask(&disk, "a.js", &[("accept-encoding", "gzip")]).await;
        assert_eq!(bytes(plain).await, b"0123456789");
    }

    /// What takes the place of a listed file, or of a folder above it, is not served.
    #[cfg(unix)]
    #[tokio::test]
    async fn what_takes_a_files_place_is_not_served() {
        use std::os::unix::fs::symlink;
        let (folder, path) = folder();
        let (outside, secret) = self::folder();
        let linked = folder.path().join("linked.bin");
        symlink(&secret, &linked).expect("linked");
        let linked = Contents::at(&linked).expect("a link that was there from the start");
        assert_eq!(ask(&linked, "a.bin", &[]).await.status(), StatusCode::OK);

        let contents = Contents::at(&path).expect("there");
        let replaced: [&dyn Fn(); 3] = [
            &|| symlink(&secret, &path).expect("linked"),
            &|| fs::create_dir(&path).expect("made"),
            &|| {
                let made = std::process::Command::new("mkfifo").arg(&path).status();
                assert!(made.expect("mkfifo").success());
            },
        ];
        for replace in replaced {
            if path.is_dir() {
                fs::remove_dir(&path).expect("removed");
            } else {
                fs::remove_file(&path).expect("removed");
            }
            replace();
            assert_eq!(ask(&contents, "a.bin", &[]).await.status(), StatusCode::NOT_FOUND);
        }
        let within = folder.path().join("folder");
        fs::create_dir(&within).expect("made");
        fs::write(within.join("scene.bin"), b"own").expect("written");
        let contents = Contents::at(&within.join("scene.bin")).expect("there");
        fs::rename(&within, folder.path().join("away")).expect("moved");
        symlink(outside.path(), &within).expect("linked");
        assert_eq!(ask(&contents, "a.bin", &[]).await.status(), StatusCode::NOT_FOUND);
    }
}
