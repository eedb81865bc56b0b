//! Harmless faults are repaired with a warning, where viewers ignore them.

use glam::Vec3;
use serde_json::{Value, json};

use super::bad_input::{bent, without_bounds};
use super::{TRIANGLE, fault, load, triangle};
use crate::builtin::writer::{Writer, container};
use crate::{Projection, Scene};

/// The only warning of a scene.
fn warning(scene: &Scene) -> &str {
    let [warning] = scene.warnings() else { panic!("{:?}", scene.warnings()) };
    warning
}

#[test]
fn attributes_that_are_not_finite_are_passed_over() {
    for attribute in ["NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0", "WEIGHTS_0"] {
        for bad in [f32::NAN, f32::INFINITY, 1e30] {
            let scene = Scene::from_glb("test", bent(attribute, bad)).expect("mended");
            let expected = format!("mesh 1 \"bent\", primitive 0: {attribute}: 1 of its elements");
            assert!(warning(&scene).starts_with(&expected), "{}", warning(&scene));
            let primitive = &scene.meshes()[1].primitives[0];
            assert!(primitive.vertices.normals.iter().all(|n| *n == Vec3::Z));
            let tangents = &primitive.vertices.tangents;
            assert!(tangents.iter().all(|t| *t == Vec3::X.extend(1.0)), "{tangents:?}");
            assert!(primitive.uv.iter().flatten().all(|uv| uv.is_finite()));
            assert!(primitive.colors.iter().all(|c| c.is_finite()));
            assert!(primitive.weights.iter().all(|w| (w.element_sum() - 1.0).abs() < 1e-6));
        }
    }
}

/// A vertex of no triangle may be anywhere; it does not widen the scene.
#[test]
fn vertices_of_no_triangle_may_have_no_place() {
    let mut w = Writer::default();
    let far: Vec<f32> = TRIANGLE.iter().map(|v| v + 10.0).collect();
    let positions = w.floats("VEC3", &[&far[..], &[f32::NAN, 0.0, 0.0]].concat());
    let indices = w.indices(&[[0, 1, 2]]);
    let primitive = json!({ "attributes": { "POSITION": positions }, "indices": indices });
    w.add("meshes", json!({ "primitives": [primitive] }));
    w.node(json!({ "mesh": 0 }));
    let scene = Scene::from_glb("test", without_bounds(w)).expect("mended");
    assert!(warning(&scene).contains("POSITION: 1 of its elements"));
    assert_eq!(scene.bounds().min, Vec3::splat(10.0));
}

/// Keys of the same time are a jump: the first of them counts before it, the last from it on.
#[test]
fn keys_of_one_time() {
    let mut w = triangle();
    let values = [0.0, 2.0, 4.0, 6.0, 8.0].map(|x| [x, 0.0, 0.0]).concat();
    let times = [0.0, 1.0, 1.0, 1.0, 2.0];
    w.animation("a", (0, "translation"), "LINEAR", &times, ("VEC3", &values));
    let mut scene = load(w);
    assert!(warning(&scene).contains("channel 0: keys of one time"));
    let mut x = |by: f64| {
        scene.advance(by);
        scene.snapshot().instances[0].world_from_object.translation.x
    };
    assert_eq!([x(0.5), x(0.5), x(0.5)], [1.0, 6.0, 7.0]);
    let mut w = triangle();
    w.animation("a", (0, "translation"), "LINEAR", &[0.0, 2.0, 1.0], ("VEC3", &values[..9]));
    assert!(fault(w).contains("the times of its keys are not finite, or fall"));
}

#[test]
fn a_light_of_range_0_has_none() {
    let mut w = triangle();
    w.light(json!({ "type": "point", "range": 0.0 }), json!({}));
    let scene = load(w);
    assert_eq!(scene.lights()[0].light.range, None);
    assert!(warning(&scene).contains("light 0: its range of 0"));
}

#[test]
fn a_camera_without_a_near_plane_gets_one() {
    for (far, expected) in [(json!(null), 0.01), (json!(0.1), 0.001)] {
        let mut w = triangle();
        let perspective = json!({ "yfov": 1.0, "znear": 0.0, "zfar": far });
        w.add("cameras", json!({ "name": "eye", "perspective": perspective }));
        w.node(json!({ "camera": 0 }));
        let scene = load(w);
        let Projection::Perspective { near, .. } = scene.cameras()[0].camera.projection else {
            panic!("another camera")
        };
        assert!((near - expected).abs() < 1e-6, "{near}");
        assert!(warning(&scene).contains("camera 0 \"eye\""));
    }
}

/// A file's JSON and binary chunk.
fn parts(w: Writer) -> (String, Vec<u8>) {
    let glb = w.finish(Value::Null);
    let length = u32::from_le_bytes([glb[12], glb[13], glb[14], glb[15]]) as usize;
    let json = String::from_utf8(glb[20..20 + length].to_vec()).expect("JSON");
    (json, glb[20 + length + 8..].to_vec())
}

#[test]
fn json_may_be_padded_and_marked() {
    let (json, binary) = parts(triangle());
    let mut padded = json.trim_end().to_owned();
    padded.extend(["\0"; 4]);
    let scene = Scene::from_glb("test", container(&padded, &binary)).expect("mended");
    assert!(warning(&scene).contains("NUL characters after its JSON"));
    for marked in [format!("\u{feff}{json}"), json] {
        let scene = Scene::from_glb("test", container(&marked, &binary)).expect("sound");
        assert_eq!(scene.warnings(), [""; 0]);
    }
}

#[test]
fn names_may_be_padded() {
    let (json, binary) = parts(triangle());
    let padded = json.replace("\"leaf\"", r#""leaf\u0000\u0000""#);
    assert_ne!(padded, json);
    let scene = Scene::from_glb("test", container(&padded, &binary)).expect("mended");
    assert!(scene.nodes().all(|node| node.name == "leaf"));
    assert!(warning(&scene).contains("NUL characters at the end of names"));
}
