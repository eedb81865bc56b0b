//! Clients that join late get the same scene.

use glam::{Quat, Vec3, Vec4};
use serde_json::json;

use super::{Folder, assert_same, load, triangle};
use crate::builtin::writer::Writer;
use crate::{
    AnimationId, Edit, Environment, InstanceSource, LightKind, LightSpec, MaterialChange,
    MaterialId, MeshId, NodeId, NodeName, Playback, PunctualLight, Scene, Transform,
};

/// The scene that a late joiner makes of the file and the edits. The edits go through JSON, as on
/// the wire.
fn joined(mut fresh: Scene, edited: &Scene) -> Scene {
    fresh.advance(edited.time());
    for edit in edited.edits_since_load() {
        let json = serde_json::to_string(&edit).expect("JSON");
        let edit: Edit = serde_json::from_str(&json).expect("an edit");
        fresh.replay(&edit).unwrap_or_else(|e| panic!("{edit:?}: {e}"));
    }
    fresh
}

/// Random numbers with a fixed seed.
struct Random(u64);

impl Random {
    fn below(&mut self, n: u32) -> u32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % u64::from(n)) as u32
    }

    fn unit(&mut self) -> f32 {
        self.below(1 << 20) as f32 / (1 << 20) as f32
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }

    fn maybe<T>(&mut self, value: T) -> Option<T> {
        (self.below(2) == 0).then_some(value)
    }

    fn transform(&mut self) -> Transform {
        let (translation, turned, scale) = (self.vector(), self.vector(), self.vector() + 0.5);
        let rotation = Quat::from_euler(glam::EulerRot::XYZ, turned.x, turned.y, turned.z);
        Transform {
            translation: self.maybe(translation),
            rotation: self.maybe(rotation),
            scale: self.maybe(scale),
        }
    }

    fn edit(&mut self) -> Edit {
        let node = NodeId(self.below(60));
        let (transform, above) = (self.transform(), NodeId(self.below(60)));
        let parent = self.maybe(above);
        let name = NodeName::new(["", "lamp", "Lämpchen", "sub/c.gltf"][self.below(4) as usize]);
        let (vector, unit) = (self.vector(), self.unit());
        match self.below(12) {
            0..3 => Edit::MoveNode { node, transform },
            3 => {
                let file = ["a.glb", "b.glb", "sub/c.gltf"][self.below(3) as usize];
                let source = InstanceSource::File(file.into());
                Edit::AddInstance { node: None, name, source, parent, transform }
            }
            4 => {
                let source = InstanceSource::Mesh(MeshId(self.below(3)));
                Edit::AddInstance { node: None, name, source, parent, transform }
            }
            5 => {
                let kind = match self.below(3) {
                    0 => LightKind::Point { radius: vector.x },
                    1 => LightKind::Spot { inner: 0.1, outer: unit, radius: 0.0 },
                    _ => LightKind::Directional { angle: unit },
                };
                let light =
                    PunctualLight { kind, color: vector, intensity: unit, range: Some(3.0) };
                Edit::AddLight { node: None, name, light, parent, transform }
            }
            6 => Edit::RemoveNode { node },
            7 => {
                let light = LightSpec {
                    color: self.maybe(vector),
                    intensity: self.maybe(unit),
                    range: self.maybe(1.0 + unit),
                    radius: self.maybe(unit),
                    ..LightSpec::default()
                };
                Edit::SetLight { node, light }
            }
            8 => Edit::RemoveLight { node },
            9 => {
                let change = MaterialChange {
                    base_color: self.maybe(Vec4::splat(unit)),
                    roughness: self.maybe(unit),
                    metallic: self.maybe(vector.x),
                    emissive: self.maybe(vector * 9.0),
                    transmission: self.maybe(vector.y),
                    ior: self.maybe(1.0 + unit),
                    specular: self.maybe(vector.z),
                    specular_color: self.maybe(vector * 2.0),
                    normal_scale: self.maybe(unit - 0.5),
                    alpha_cutoff: self.maybe(unit).filter(|_| vector.x < 0.5),
                };
                Edit::SetMaterial { material: MaterialId(self.below(10)), change }
            }
            10 => {
                let (playing, time) = (unit < 0.5, f64::from(vector.x));
                let playback = Playback {
                    playing: self.maybe(playing),
                    time: self.maybe(time),
                    speed: self.maybe(f64::from(vector.y)),
                };
                Edit::SetAnimation { animation: AnimationId(self.below(6)), playback }
            }
            _ => Edit::SetEnvironment { environment: Environment::Constant { radiance: vector } },
        }
    }
}

/// A file with a tree of nodes, a light, a material, morph targets and two animations.
fn file() -> Writer {
    let mut w = triangle();
    let positions = w.floats("VEC3", &super::TRIANGLE);
    let primitive = json!({
        "attributes": { "POSITION": positions }, "targets": [{ "POSITION": positions }], "material": 0,
    });
    w.add("meshes", json!({ "primitives": [primitive] }));
    w.add("materials", json!({ "name": "paint", "alphaMode": "MASK" }));
    w.node(json!({ "mesh": 1, "children": [2], "translation": [0.1, 0.2, 0.3] }));
    w.light(json!({ "type": "point" }), json!({ "name": "lamp" }));
    w.animation("wave", (1, "weights"), "LINEAR", &[0.0, 0.7], ("SCALAR", &[0.0, 1.0]));
    w.animation(
        "hop",
        (1, "translation"),
        "LINEAR",
        &[0.0, 0.9],
        ("VEC3", &[0., 0., 0., 0., 1., 0.]),
    );
    w
}

/// Several scenes get a thousand random edits each, most of them valid, with time passing between.
/// At many points a joiner sees the same scene as those who were there all the time.
#[test]
fn late_joiners_see_the_same_scene() {
    let folder = Folder::new("replay");
    let path = folder.write("scene.glb", file().finish(json!(null)));
    for name in ["a.glb", "b.glb", "sub/c.gltf"] {
        folder.write(name, file().finish(json!(null)));
    }
    let mut accepted = 0;
    for seed in 0..6 {
        let mut random = Random(seed);
        let mut scene = Scene::load(&path).expect("the scene");
        let mut follower = Scene::load(&path).expect("the scene");
        for step in 0..1000 {
            if let Ok(edit) = scene.apply(&random.edit()) {
                follower.replay(&edit).expect("what the server has accepted");
                accepted += 1;
            }
            if step % 7 == 0 {
                let seconds = f64::from(random.unit()) * 0.3;
                assert_eq!(scene.advance(seconds), follower.advance(seconds));
            }
            if step % 90 == 0 {
                assert_same(&mut scene, &mut follower);
                let mut joiner = joined(Scene::load(&path).expect("the scene"), &scene);
                assert_same(&mut scene, &mut joiner);
            }
        }
    }
    assert!(accepted > 1500, "only {accepted} edits made sense");
}

#[test]
fn the_list_is_short_when_little_is_different() {
    let mut scene = load(triangle());
    assert!(scene.edits_since_load().is_empty());
    for step in 0..100 {
        let translation = Some(Vec3::new(step as f32, 0.0, 0.0));
        let transform = Transform { translation, ..Transform::default() };
        scene.apply(&Edit::MoveNode { node: NodeId(0), transform }).expect("moved");
        let source = InstanceSource::Mesh(MeshId(0));
        let add = Edit::AddInstance { node: None, name: None, source, parent: None, transform };
        let Edit::AddInstance { node: Some(node), .. } = scene.apply(&add).expect("added") else {
            unreachable!()
        };
        scene.apply(&Edit::RemoveNode { node }).expect("removed");
    }
    assert_eq!(scene.edits_since_load().len(), 1);
}

/// Materials of a file that was added and removed keep their numbers, and so do those of the next
/// file.
#[test]
fn numbers_hold_when_an_added_file_has_gone() {
    let folder = Folder::new("gone");
    let path = folder.write("scene.glb", file().finish(json!(null)));
    folder.write("a.glb", file().finish(json!(null)));
    folder.write("b%.glb", file().finish(json!(null)));
    let mut scene = Scene::load(&path).expect("the scene");
    let mut add = |file: &str| {
        let source = InstanceSource::File(file.into());
        let transform = Transform::default();
        match scene.apply(&Edit::AddInstance {
            node: None,
            name: None,
            source,
            parent: None,
            transform,
        }) {
            Ok(Edit::AddInstance { node: Some(node), .. }) => node,
            other => panic!("{other:?}"),
        }
    };
    let (first, second) = (add("a.glb"), add("b%25.glb"));
    assert_eq!((first, second), (NodeId(3), NodeId(7)), "a node of its own and the file's three");
    scene.apply(&Edit::RemoveNode { node: first }).expect("removed");
    let emissive = Some(Vec3::ONE);
    let change = MaterialChange { emissive, ..MaterialChange::default() };
    scene.apply(&Edit::SetMaterial { material: MaterialId(4), change }).expect("of b");
    let mut joiner = joined(Scene::load(&path).expect("the scene"), &scene);
    assert_same(&mut scene, &mut joiner);
    let snapshot = joiner.snapshot();
    let shown = snapshot.instances.iter().find(|i| i.node == NodeId(9)).expect("b's second node");
    let material = shown.mesh.primitives[0].material;
    assert_eq!((material, snapshot.materials[4].emissive), (MaterialId(4), Vec3::ONE));
}
