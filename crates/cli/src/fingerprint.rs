//! A number for all that a kept picture depends on.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};

use lumencast_scene::{FileContents, Scene};

/// A hash of a scene's files, by length and time of change where they lie on disk, and of what was
/// `said` beside them.
pub(crate) fn of(scene: &Scene, said: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    said.hash(&mut hasher);
    for file in scene.files() {
        file.name.hash(&mut hasher);
        match &file.contents {
            FileContents::Bytes(bytes) => bytes.hash(&mut hasher),
            FileContents::Path(path) => {
                if let Ok(metadata) = fs::metadata(path) {
                    (metadata.len(), metadata.modified().ok()).hash(&mut hasher);
                }
            }
        }
    }
    hasher.finish()
}
