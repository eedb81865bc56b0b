//! A scene's files, from the server to a folder of one's own.

use std::io::Write as _;
use std::path::{Component, Path, PathBuf};

use lumencast_transport::{Fetch, take_scene};
use serde::Deserialize;
use tempfile::TempDir;
use url::Url;

use crate::error::ClientError;

/// Bytes of what a server says of its scene.
const START_BYTES: usize = 16 << 20;
/// Bytes of all files of a scene.
const MOST_BYTES: u64 = 8 << 30;
/// Files of a scene.
const MOST_FILES: usize = 65_536;

/// A scene's files on this machine, until this is dropped.
#[derive(Debug)]
pub struct SceneFiles {
    folder: TempDir,
    root: PathBuf,
}

impl SceneFiles {
    /// The scene's glTF file.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The folder that they are in.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }
}

/// What a server says of its scene at `/lumencast.json`.
#[derive(Deserialize)]
struct Start {
    root: String,
    files: Vec<String>,
    tick: Option<u64>,
}

impl Start {
    async fn of(url: &str, fetch: &Fetch) -> Result<Self, ClientError> {
        let failed = |reason: String| ClientError::Download { url: url.to_owned(), reason };
        let address = beside(url, "lumencast.json").map_err(|error| failed(error.to_string()))?;
        let start = fetch.get(&address).await?.all(START_BYTES).await?;
        serde_json::from_slice(&start)
            .map_err(|error| failed(format!("its lumencast.json is no scene's: {error}")))
    }
}

/// The tick that a server is at: once a session has [reached](crate::Session::reached) it, what is known is
/// no older than this question.
///
/// # Errors
/// A server that cannot be reached, or does not say.
pub async fn current_tick(url: &str) -> Result<u64, ClientError> {
    let reason = || "it does not tell its tick".to_owned();
    let start = Start::of(url, &Fetch::new()?).await?;
    start.tick.ok_or_else(|| ClientError::Download { url: url.to_owned(), reason: reason() })
}

/// Downloads the files of a server's scene; `progress` hears how many are there, of how many.
///
/// # Errors
/// A server that cannot be reached, files that are too many, too large or named beyond their folder.
pub async fn download(
    url: &str,
    mut progress: impl FnMut(usize, usize),
) -> Result<SceneFiles, ClientError> {
    let failed = |reason: String| ClientError::Download { url: url.to_owned(), reason };
    let fetch = Fetch::new()?;
    let Start { root, files, .. } = Start::of(url, &fetch).await?;
    if files.len() > MOST_FILES {
        return Err(failed(format!("it has more than {MOST_FILES} files")));
    }
    let folder = tempfile::Builder::new()
        .prefix("lumencast-")
        .tempdir()
        .map_err(|error| ClientError::Write { path: std::env::temp_dir(), error })?;
    let place = |name: &str| {
        below(folder.path(), name).ok_or_else(|| failed(format!("{name:?} is no name of a file")))
    };
    let mut room = MOST_BYTES;
    for (done, name) in files.iter().enumerate() {
        progress(done, files.len());
        let path = place(name)?;
        let mut address = beside(url, "scene/").map_err(|error| failed(error.to_string()))?;
        if let Ok(mut segments) = address.path_segments_mut() {
            segments.pop_if_empty().extend(name.split('/'));
        }
        let wrote = |error| ClientError::Write { path: path.clone(), error };
        std::fs::create_dir_all(path.parent().unwrap_or(folder.path())).map_err(wrote)?;
        let mut file = std::fs::File::create(&path).map_err(wrote)?;
        let mut fetched = fetch.get(&address).await?;
        while let Some(part) = fetched.next().await? {
            room = room
                .checked_sub(part.len() as u64)
                .ok_or_else(|| failed(format!("its files have more than {MOST_BYTES} bytes")))?;
            file.write_all(&part).map_err(wrote)?;
        }
    }
    progress(files.len(), files.len());
    let root = place(&root)?;
    Ok(SceneFiles { folder, root })
}

/// What a server has beside a scene: `https://host/base/scene` is the address of a scene, and a reverse
/// proxy has the server under `base`.
pub(crate) fn beside(scene: &str, path: &str) -> Result<Url, url::ParseError> {
    let mut base = Url::parse(scene)?;
    take_scene(&mut base);
    base.join(path)
}

/// A file of this name in a folder or below; nothing where the name leads elsewhere.
fn below(folder: &Path, name: &str) -> Option<PathBuf> {
    let is_plain = |part: Component<'_>| matches!(part, Component::Normal(_));
    let plain = !name.is_empty()
        && !name.contains(['\\', '\0', ':'])
        && Path::new(name).components().all(is_plain);
    plain.then(|| folder.join(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_lie_beside_the_scene() {
        for (scene, file) in [
            ("http://[::1]:4443/sponza", "http://[::1]:4443/scene/"),
            ("http://localhost:4443", "http://localhost:4443/scene/"),
            ("https://host/light/sponza?jwt=a", "https://host/light/scene/"),
            ("https://host/light/sponza/", "https://host/light/scene/"),
        ] {
            assert_eq!(beside(scene, "scene/").map(String::from).as_deref(), Ok(file), "{scene}");
        }
    }

    #[test]
    fn names_stay_in_their_folder() {
        let folder = Path::new("/tmp/scene");
        assert_eq!(below(folder, "a/b c.png"), Some(PathBuf::from("/tmp/scene/a/b c.png")));
        for wrong in
            ["", "/etc/passwd", "../x", "a/../../x", "a/./../x", "..", "C:x", "a\\..\\x", "\0"]
        {
            assert_eq!(below(folder, wrong), None, "{wrong:?}");
        }
    }
}
