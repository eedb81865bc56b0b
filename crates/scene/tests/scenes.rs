//! Scenes of the world outside and the built-in ones: they load, move, and hold what they promise.

use std::path::{Path, PathBuf};

use glam::Vec3;
use lumencast_scene::{BUILTINS, Edit, Scene, Script, Snapshot};

/// The folder of scenes that are not part of the repository.
fn scenes() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    let folder = std::env::var_os("LUMENCAST_SCENES").map_or(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: there are no scenes in {}", folder.display());
    None
}

fn triangles(snapshot: &Snapshot) -> usize {
    snapshot.instances.iter().map(|i| i.mesh.triangle_count()).sum()
}

/// Everything that a gatherer relies on.
fn check(name: &str, snapshot: &Snapshot) {
    for instance in &snapshot.instances {
        assert!(instance.world_from_object.inverse().is_finite(), "{name}: {}", instance.node);
        for (index, primitive) in instance.mesh.primitives.iter().enumerate() {
            let vertices = instance.vertices(index);
            let count = vertices.positions.len();
            let all_there = |n: usize| n == 0 || n == count;
            assert_eq!(vertices.normals.len(), count, "{name}");
            assert!(all_there(vertices.tangents.len()) && all_there(primitive.colors.len()));
            assert!(primitive.uv.iter().all(|uv| all_there(uv.len())), "{name}");
            assert!(primitive.triangles.iter().flatten().all(|i| (*i as usize) < count), "{name}");
            assert!(vertices.positions.iter().all(|p| p.is_finite()), "{name}");
            assert!(vertices.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3), "{name}");
            let unit =
                |t: &glam::Vec4| (t.truncate().length() - 1.0).abs() < 1e-3 && t.w.abs() == 1.0;
            assert!(vertices.tangents.iter().all(unit), "{name}");
            assert!((primitive.material.0 as usize) < snapshot.materials.len(), "{name}");
        }
    }
    assert!(snapshot.lights.iter().all(|l| (l.direction.length() - 1.0).abs() < 1e-5), "{name}");
}

/// Triangles of each file, as its author counts them. Fewer are drawn where some have no area.
const FILES: &[(&str, usize)] = &[
    ("sponza/Sponza.glb", 262_267),
    ("sponza/SponzaPBR.glb", 262_267),
    ("breakfast_room/BreakfastRoom.glb", 269_538),
    ("cornell/CornellBox.glb", 32),
    ("cornell/CornellBoxPoint.glb", 30),
    ("samples/AlphaBlendModeTest/AlphaBlendModeTest.glb", 61),
    ("samples/AnimatedMorphCube/AnimatedMorphCube.glb", 12),
    ("samples/Box/Box.glb", 12),
    ("samples/BoxAnimated/BoxAnimated.glb", 254),
    ("samples/BoxInterleaved/BoxInterleaved.glb", 12),
    ("samples/BoxTextured/BoxTextured.glb", 12),
    ("samples/Cameras/Cameras.glb", 2),
    ("samples/CesiumMan/CesiumMan.glb", 4_672),
    ("samples/CesiumMilkTruck/CesiumMilkTruck.glb", 3_624),
    ("samples/Fox/Fox.glb", 576),
    ("samples/InterpolationTest/InterpolationTest.glb", 110),
    ("samples/MorphPrimitivesTest/MorphPrimitivesTest.glb", 32),
    ("samples/PunctualLights/PunctualLights.glb", 8_834),
    ("samples/RiggedSimple/RiggedSimple.glb", 188),
    ("samples/SimpleSparseAccessor/SimpleSparseAccessor.glb", 12),
    ("samples/TextureSettingsTest/TextureSettingsTest.glb", 72),
    ("samples/TextureTransformTest/TextureTransformTest.glb", 24),
];

/// The minutes that are measured do something: each of their edits fits its scene.
#[test]
fn scripted_minutes_fit_their_scenes() {
    for (name, file) in [("cornell", "minute"), ("door", "minute-door"), ("tomb", "minute-tomb")] {
        let path = format!("{}/../../benches/{file}.jsonl", env!("CARGO_MANIFEST_DIR"));
        let script = Script::parse(&std::fs::read_to_string(path).unwrap()).unwrap();
        let mut scene = Scene::builtin(name).unwrap();
        let edits: Vec<&Edit> = script.due(0.0, 60.0).collect();
        assert!(edits.len() > 10, "{name}: {} edits", edits.len());
        for edit in edits {
            scene.apply(edit).unwrap();
        }
    }
}

#[test]
fn the_worlds_scenes_load_and_move() {
    let Some(folder) = scenes() else { return };
    for (file, expected) in FILES {
        let started = std::time::Instant::now();
        let mut scene = Scene::load(&folder.join(file)).unwrap_or_else(|e| panic!("{e}"));
        let first = scene.snapshot();
        eprintln!("{file}: {} ms, {:?}", started.elapsed().as_millis(), scene.warnings());
        check(file, &first);
        let drawn = triangles(&first);
        assert!(drawn <= *expected && drawn >= expected - expected / 100, "{file}: {drawn}");
        let is_animated = scene.animations().any(|a| a.duration > 0.0);
        let moved = (0..10).filter(|_| scene.advance(0.13)).count();
        assert_eq!(moved > 0, is_animated, "{file}");
        check(file, &scene.snapshot());
        let mut joiner = Scene::load(&folder.join(file)).unwrap_or_else(|e| panic!("{e}"));
        joiner.advance(scene.time());
        assert!(scene.edits_since_load().is_empty(), "{file}");
        let places = |s: &Snapshot| -> Vec<_> {
            s.instances.iter().map(|i| (i.node, i.world_from_object)).collect()
        };
        assert_eq!(places(&scene.snapshot()), places(&joiner.snapshot()), "{file}");
    }
}

#[test]
fn every_sample_is_in_the_list() {
    let Some(folder) = scenes() else { return };
    let samples = std::fs::read_dir(folder.join("samples")).expect("a folder");
    for sample in samples.map(|s| s.expect("an entry").file_name()) {
        let name = sample.to_string_lossy();
        let known = FILES.iter().any(|(file, _)| file.contains(&format!("samples/{name}/")));
        if !known {
            let path = folder.join(format!("samples/{name}/{name}.glb"));
            check(&name, &Scene::load(&path).unwrap_or_else(|e| panic!("{e}")).snapshot());
        }
    }
}

/// CesiumMan stands about 1.5 m tall whatever joint moves him; errors in skinning tear him apart.
#[test]
fn a_skinned_figure_keeps_its_size() {
    let Some(folder) = scenes() else { return };
    let path = folder.join("samples/CesiumMan/CesiumMan.glb");
    let mut scene = Scene::load(&path).unwrap_or_else(|e| panic!("{e}"));
    for _ in 0..8 {
        let bounds = scene.bounds();
        let size = bounds.max - bounds.min;
        assert!((1.4..1.6).contains(&size.y) && size.x < 1.3 && size.z < 1.3, "{size}");
        scene.advance(0.25);
    }
}

#[test]
fn built_in_scenes_have_their_triangles_volumes_and_cameras() {
    let expected =
        [("cornell", 3_800..4_200), ("door", 10_500..11_500), ("tomb", 515_000..521_000)];
    assert_eq!(BUILTINS, expected.clone().map(|(name, _)| name));
    for (name, range) in expected {
        let mut scene = Scene::builtin(name).expect(name);
        assert_eq!(scene.warnings(), [""; 0], "{name}");
        let snapshot = scene.snapshot();
        check(name, &snapshot);
        let drawn = triangles(&snapshot);
        assert!(range.contains(&drawn), "{name}: {drawn}");
        assert_eq!(scene.cameras().len(), 1, "{name}");
        assert_eq!(snapshot.lights.len(), 1, "{name}");
        assert!(scene.nodes().all(|n| !n.name.is_empty()), "{name}: objects have names");
        let bounds = scene.bounds();
        for volume in scene.volumes() {
            let inside = |p: Vec3| p.cmpge(bounds.min).all() && p.cmple(bounds.max).all();
            assert!(volume.grid.positions().all(inside), "{name}");
        }
        assert_eq!(scene.advance(0.5), name != "door", "{name}");
        check(name, &scene.snapshot());
    }
    let cornell = Scene::builtin("cornell").expect("cornell").volumes();
    assert_eq!((cornell.len(), cornell[0].grid.probe_count()), (1, 512));
}

/// Clients get the very file that the server has loaded.
#[test]
fn built_in_scenes_are_files() {
    let scene = Scene::builtin("cornell").expect("cornell");
    assert_eq!((scene.name(), scene.root_file()), ("cornell", "cornell.glb"));
    let files = scene.files();
    let lumencast_scene::FileContents::Bytes(bytes) = &files[0].contents else {
        panic!("no bytes")
    };
    let again = Scene::from_glb("again", bytes.clone()).expect("the same");
    assert_eq!(again.nodes().count(), scene.nodes().count());
}
