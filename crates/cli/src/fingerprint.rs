//! A number for all that a kept picture depends on.

use std::fs::File;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;

use anyhow::{Context, Result};
use lumencast_scene::{FileContents, Scene};

/// A hash of a scene's files, its environment and the edits since it was loaded, and of what was `said`
/// beside them. Where the files lie and how old they are does not count.
pub(crate) fn of(scene: &Scene, said: impl Hash) -> Result<u64> {
    let mut hasher = Hashing(DefaultHasher::new());
    said.hash(&mut hasher.0);
    serde_json::to_string(scene.environment())?.hash(&mut hasher.0);
    serde_json::to_string(&scene.edits_since_load())?.hash(&mut hasher.0);
    for file in scene.files() {
        file.name.hash(&mut hasher.0);
        let length = match &file.contents {
            FileContents::Bytes(bytes) => io::copy(&mut bytes.as_ref(), &mut hasher)?,
            FileContents::Path(path) => File::open(path)
                .and_then(|mut file| io::copy(&mut file, &mut hasher))
                .with_context(|| format!("cannot read {}", path.display()))?,
        };
        length.hash(&mut hasher.0);
    }
    Ok(hasher.0.finish())
}

/// Hashes what is written.
struct Hashing(DefaultHasher);

impl io::Write for Hashing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lumencast_scene::{Edit, Environment, NodeId, Transform};

    #[test]
    fn tells_scenes_apart_by_what_they_hold() {
        let folder = std::env::temp_dir().join(format!("lumencast-print-{}", std::process::id()));
        let scene = |at: &str, corner: f32| {
            let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, corner];
            let bytes: Vec<u8> = corners.iter().flat_map(|c: &f32| c.to_le_bytes()).collect();
            let gltf = serde_json::json!({
                "asset": { "version": "2.0" },
                "buffers": [{ "uri": "a.bin", "byteLength": bytes.len() }],
                "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
                "accessors": [
                    { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 },
                ],
                "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
                "nodes": [{ "mesh": 0 }],
                "scenes": [{ "nodes": [0] }],
            });
            let folder = folder.join(at);
            std::fs::create_dir_all(&folder).expect("a folder for temporary files");
            let path = folder.join("a.gltf");
            std::fs::write(folder.join("a.bin"), bytes).expect("as before");
            std::fs::write(&path, gltf.to_string()).expect("as before");
            Scene::open(path.to_str().expect("text")).expect("a scene")
        };
        let print = |scene: &Scene, said: &str| of(scene, said).expect("readable files");
        let mut one = scene("one", 0.0);
        let first = print(&one, "4 bounces");
        assert_eq!(print(&scene("two", 0.0), "4 bounces"), first, "a copy");
        assert_ne!(print(&one, "3 bounces"), first);
        assert_ne!(print(&scene("three", 0.5), "4 bounces"), first, "another corner");
        let environment = Environment::Constant { radiance: glam::Vec3::ONE };
        one.apply(&Edit::SetEnvironment { environment }).expect("an environment");
        assert_ne!(print(&one, "4 bounces"), first, "another environment");
        let mut moved = scene("two", 0.0);
        let translation = Some(glam::Vec3::X);
        let transform = Transform { translation, ..Transform::default() };
        moved.apply(&Edit::MoveNode { node: NodeId(0), transform }).expect("a node");
        assert_ne!(print(&moved, "4 bounces"), first, "another place");
        std::fs::remove_dir_all(folder).expect("there");
        assert!(of(&one, "").is_err_and(|e| e.to_string().contains("a.gltf")), "files are gone");
    }
}
