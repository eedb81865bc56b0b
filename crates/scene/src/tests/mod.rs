//! Tests of the whole crate, on small glTF files made in code.

mod bad_input;
mod deforming;
mod edits;
mod exporters;
mod far;
mod files;
mod geometry;
mod mended;
mod replay;
mod shelf;

use serde_json::{Value, json};

use crate::builtin::writer::Writer;
use crate::{Scene, Snapshot};

/// A triangle in the plane z = 0, counter-clockwise from +Z.
const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// A file whose first node shows one triangle.
fn triangle() -> Writer {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE);
    let primitive = json!({ "attributes": { "POSITION": positions } });
    w.add("meshes", json!({ "name": "leaf", "primitives": [primitive] }));
    w.node(json!({ "name": "leaf", "mesh": 0 }));
    w
}

fn load(writer: Writer) -> Scene {
    Scene::from_glb("test", writer.finish(Value::Null)).expect("a sound file")
}

/// The fault that loading reports.
fn fault(writer: Writer) -> String {
    fault_of(writer.finish(Value::Null))
}

fn fault_of(glb: Vec<u8>) -> String {
    Scene::from_glb("test", glb).expect_err("a faulty file").to_string()
}

/// Asserts that two scenes draw the same and go on alike.
fn assert_same(a: &mut Scene, b: &mut Scene) {
    let (sa, sb) = (a.snapshot(), b.snapshot());
    assert_eq!(by_node(&sa), by_node(&sb));
    let lights = |s: &Snapshot| {
        let mut lights = s.lights.clone();
        lights.sort_by_key(|l| l.node);
        lights
    };
    assert_eq!(lights(&sa), lights(&sb));
    assert_eq!(format!("{:?}", sa.materials), format!("{:?}", sb.materials));
    assert_eq!(sa.environment, sb.environment);
    assert_eq!(a.animations().collect::<Vec<_>>(), b.animations().collect::<Vec<_>>());
    assert_eq!(a.nodes().collect::<Vec<_>>(), b.nodes().collect::<Vec<_>>());
}

fn by_node(snapshot: &Snapshot) -> Vec<String> {
    let mut instances: Vec<_> = snapshot.instances.iter().collect();
    instances.sort_by_key(|i| i.node);
    instances
        .iter()
        .map(|i| {
            format!("{:?} {:?} {:?} {:?}", i.node, i.mesh_id, i.world_from_object, i.deformation)
        })
        .collect()
}

/// A temporary folder, deleted with the test.
struct Folder(std::path::PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lumencast-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> std::path::PathBuf {
        let path = self.0.join(name);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).expect("a folder");
        }
        std::fs::write(&path, bytes).expect("a file");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
