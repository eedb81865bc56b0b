//! Files that edits name: read once, apart from the scene, and within limits.

use glam::Vec3;
use serde_json::Value;

use super::{Folder, assert_same, triangle};
use crate::{Edit, Environment, InstanceSource, Scene, Transform};

fn scene(folder: &Folder) -> Scene {
    Scene::load(&folder.write("scene.glb", triangle().finish(Value::Null))).expect("a scene")
}

fn add(file: &str) -> Edit {
    Edit::AddInstance {
        node: None,
        name: None,
        source: InstanceSource::File(file.into()),
        parent: None,
        transform: Transform::default(),
    }
}

fn picture(uri: &str) -> Edit {
    let (uri, image) = (uri.into(), None);
    let environment = Environment::Image { uri, intensity: 1.0, rotation: 0.0, image };
    Edit::SetEnvironment { environment }
}

/// A Radiance picture of one texel.
fn hdr() -> Vec<u8> {
    let mut file = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n".to_vec();
    file.extend([64, 128, 32, 130]);
    file
}

#[test]
fn a_file_is_read_apart_from_its_scene() {
    let folder = Folder::new("apart");
    let mut scene = scene(&folder);
    folder.write("more.glb", triangle().finish(Value::Null));
    let before = scene.snapshot();

    let file = scene.file_to_read(&add("./more.glb")).expect("it is not known");
    assert_eq!(file.name(), "more.glb");
    let read = std::thread::spawn(|| file.read()).join().expect("a thread");
    scene.take_in(read);
    assert_eq!(scene.version(), before.version, "nothing has changed yet");

    std::fs::remove_file(folder.0.join("more.glb")).expect("removed");
    folder.write("more.glb", "rubbish");
    assert!(scene.file_to_read(&add("more.glb")).is_none());
    scene.apply(&add("more.glb")).expect("it was read");
    scene.apply(&add("more.glb")).expect("it is part of the scene");
    assert_eq!(scene.snapshot().instances.len(), 3);
}

#[test]
fn what_fails_is_read_again_once_it_has_changed() {
    let folder = Folder::new("fails");
    let mut scene = scene(&folder);
    folder.write("broken.glb", "glTF of a kind");
    for (edit, name) in [(add("broken.glb"), "glTF"), (picture("broken.glb"), ".hdr or .exr")] {
        let first = scene.apply(&edit).expect_err("broken").to_string();
        assert!(first.contains(name) || first.contains(".glb"), "{first}");
        assert!(scene.file_to_read(&edit).is_none(), "the failure is remembered");
        assert_eq!(scene.apply(&edit).expect_err("as it was").to_string(), first);
    }
    folder.write("broken.glb", triangle().finish(Value::Null));
    scene.apply(&add("broken.glb")).expect("mended");
}

/// Opening a pipe would wait for somebody to write to it.
#[cfg(unix)]
#[test]
fn a_pipe_is_no_file() {
    let folder = Folder::new("pipe");
    let mut scene = scene(&folder);
    let made = std::process::Command::new("mkfifo").arg(folder.0.join("pipe.glb")).status();
    assert!(made.expect("mkfifo").success());
    let error = scene.apply(&add("pipe.glb")).expect_err("a pipe").to_string();
    assert!(error.contains("not a regular file"), "{error}");
}

/// Edits that make no sense whatever the file holds do not ask for it.
#[test]
fn senseless_edits_read_nothing() {
    let folder = Folder::new("senseless");
    let scene = scene(&folder);
    folder.write("more.glb", triangle().finish(Value::Null));
    let Edit::AddInstance { node, name: None, source, parent, .. } = add("more.glb") else {
        unreachable!()
    };
    let transform = Transform { scale: Some(Vec3::ZERO), ..Transform::default() };
    let flat = Edit::AddInstance { node, name: None, source, parent, transform };
    for edit in [flat, add("../more.glb"), add("none.glb"), picture("../sky.hdr")] {
        assert!(scene.file_to_read(&edit).is_none(), "{edit:?}");
    }
    assert!(scene.file_to_read(&add("more.glb")).is_some());
}

/// A picture is read once under all its names. It is kept until four others have been unused since.
#[test]
fn pictures_are_known_by_their_files() {
    let folder = Folder::new("pictures");
    let mut scene = scene(&folder);
    let names = ["a", "b", "c", "d", "e", "f"].map(|name| format!("{name}.hdr"));
    names.iter().for_each(|name| drop(folder.write(name, hdr())));
    let mut reads = |name: &str| {
        let reads = scene.file_to_read(&picture(name)).is_some();
        scene.apply(&picture(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(matches!(scene.environment(), Environment::Image { image: Some(_), .. }));
        reads
    };
    assert!(reads("a.hdr"));
    for other in ["./a.hdr", "././a.hdr", ".//a.hdr", "%61.hdr"] {
        assert!(!reads(other), "{other}");
    }
    assert_eq!(names.each_ref().map(|name| reads(name)), [false, true, true, true, true, true]);
    assert!(!reads("b.hdr") && reads("a.hdr"));
}

/// Replicas number materials in the order in which files were added, whatever they had read before.
#[test]
fn files_are_numbered_as_they_are_added() {
    let folder = Folder::new("numbers");
    for name in ["a.glb", "b.glb"] {
        let mut writer = triangle();
        writer.add("materials", serde_json::json!({ "name": name }));
        folder.write(name, writer.finish(Value::Null));
    }
    let (mut first, mut other) = (scene(&folder), scene(&folder));
    for (scene, names) in [(&mut first, ["a.glb", "b.glb"]), (&mut other, ["b.glb", "a.glb"])] {
        names.iter().for_each(|name| drop(scene.apply(&add(name)).expect("added")));
    }
    // A server that restarts may have read the files in another order.
    let mut replica = first.pristine(0.0);
    other.edits_since_load().iter().for_each(|edit| replica.replay(edit).expect("replayed"));
    assert_same(&mut other, &mut replica);
    let materials = |scene: &mut Scene| -> Vec<_> {
        let snapshot = scene.snapshot();
        let mesh = |instance: &crate::Instance| instance.mesh.primitives[0].material;
        snapshot.instances.iter().map(mesh).collect()
    };
    assert_eq!(materials(&mut other), materials(&mut replica));
}
