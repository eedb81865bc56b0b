//! Scenes far from the world's origin keep their precision.

use glam::{Affine3A, DVec3, Vec3};
use serde_json::{Value, json};

use super::{TRIANGLE, assert_same, load};
use crate::builtin::writer::Writer;
use crate::{Edit, NodeId, Scene, Snapshot, Transform};

/// World position of a point of an instance, in double precision.
fn place(snapshot: &Snapshot, instance: usize, point: Vec3) -> DVec3 {
    let Affine3A { matrix3, translation } = snapshot.instances[instance].world_from_object;
    let at = matrix3.as_dmat3() * point.as_dvec3() + translation.as_dvec3();
    at + snapshot.origin.as_dvec3()
}

/// A file with a triangle for each of these nodes.
fn triangles(nodes: &[Value]) -> Writer {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE);
    w.add("meshes", json!({ "primitives": [{ "attributes": { "POSITION": positions } }] }));
    for node in nodes {
        let mut node = node.clone();
        node["mesh"] = json!(0);
        w.node(node);
    }
    w
}

fn at(translation: DVec3) -> Value {
    json!({ "translation": translation.to_array() })
}

#[test]
fn what_is_near_the_origin_stays_as_it_is() {
    for name in ["cornell", "door", "tomb"] {
        let mut scene = Scene::builtin(name).expect("a built-in scene");
        let snapshot = scene.snapshot();
        assert_eq!(snapshot.origin, Vec3::ZERO, "{name}");
        assert!(snapshot.instances.iter().all(|i| i.mesh.origin == Vec3::ZERO), "{name}");
        assert!(!scene.warnings().iter().any(|w| w.contains("origin")), "{:?}", scene.warnings());
    }
    let mut scene = load(triangles(&[at(DVec3::new(8000.3, -20.0, 0.0))]));
    assert_eq!(scene.snapshot().origin, Vec3::ZERO);
}

/// Neighbours in map coordinates keep their distance to a micrometre.
#[test]
fn places_keep_their_digits() {
    let far = DVec3::new(1e6 + 0.37, 120.2, -4.1e6 - 0.61);
    let step = DVec3::new(0.011, 0.0, 0.003);
    let flat = triangles(&[at(far), at(far + step)]);
    let mut nested = triangles(&[at(DVec3::ZERO), at(step)]);
    nested.node(json!({ "children": [0, 1], "translation": far.to_array() }));
    let mut by_matrix = triangles(&[at(DVec3::ZERO), at(step)]);
    let [x, y, z] = far.to_array();
    let matrix = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., x, y, z, 1.];
    by_matrix.node(json!({ "children": [0, 1], "matrix": matrix }));
    for writer in [flat, nested, by_matrix] {
        let mut scene = load(writer);
        let snapshot = scene.snapshot();
        let origin = snapshot.origin;
        assert_eq!(origin % 1024.0, Vec3::ZERO);
        assert!(origin.as_dvec3().distance(far) < 1024.0, "{origin}");
        for (n, there) in [far, far + step].into_iter().enumerate() {
            let found = place(&snapshot, n, Vec3::ZERO);
            assert!(found.distance(there) < 1e-4, "{found} {there}");
        }
        let apart = place(&snapshot, 1, Vec3::ZERO) - place(&snapshot, 0, Vec3::ZERO);
        assert!(apart.distance(step) < 1e-4, "{apart}");
        // Bounds are in world coordinates.
        let bounds = scene.bounds();
        assert!((bounds.min - far.as_vec3()).abs().max_element() <= 0.5, "{bounds:?}");
    }
}

/// A triangle shown as the instances of one node at `far`, displaced by `steps`.
fn instanced(far: DVec3, steps: &[Vec3]) -> Writer {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE);
    w.add("meshes", json!({ "primitives": [{ "attributes": { "POSITION": positions } }] }));
    let translations = w.vectors(steps);
    let extensions =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": translations } } });
    w.node(json!({ "mesh": 0, "translation": far.to_array(), "extensions": extensions }));
    w
}

/// Instances of a node in map coordinates keep their distances.
#[test]
fn instances_keep_their_digits() {
    let steps = [Vec3::ZERO, Vec3::new(0.011, 0.0, 0.003), Vec3::new(-0.25, 7.013, 40.002)];
    for far in [DVec3::new(1e6 + 0.37, 120.2, -0.61), DVec3::new(-1e6 - 0.02, 0.3, 1e6 + 0.3)] {
        let mut scene = load(instanced(far, &steps));
        let snapshot = scene.snapshot();
        assert!(snapshot.origin.as_dvec3().distance(far) < 1024.0, "{}", snapshot.origin);
        assert_eq!(snapshot.instances.len(), steps.len());
        for (n, step) in steps.iter().enumerate() {
            let found = place(&snapshot, n, Vec3::ZERO);
            let apart = found - place(&snapshot, 0, Vec3::ZERO);
            assert!(apart.distance(step.as_dvec3()) < 1e-4, "{apart} {step}");
            assert!(found.distance(far + step.as_dvec3()) < 1e-3, "{found}");
        }
    }
}

/// The origin is near a node's instances, not its own position, and not near a hidden node.
#[test]
fn the_origin_is_about_what_is_shown() {
    let far = Vec3::X * 1e6;
    let mut scene = load(instanced(DVec3::ZERO, &[far, far + Vec3::Y]));
    assert!(scene.snapshot().origin.distance(far) < 1024.0);
    assert!(scene.warnings().join("\n").contains("1000 km"), "{:?}", scene.warnings());

    let mut hidden = at(far.as_dvec3());
    hidden["extensions"] = json!({ "KHR_node_visibility": { "visible": false } });
    let mut scene = load(triangles(&[hidden.clone(), at(DVec3::ZERO), hidden]));
    assert_eq!(scene.snapshot().origin, Vec3::ZERO);
    assert!(!scene.warnings().join("\n").contains("km"), "{:?}", scene.warnings());
}

/// Vertices far from their mesh's origin keep their positions.
#[test]
fn vertices_keep_their_digits() {
    let far = Vec3::new(1_000_000.5, -3.0, 250_000.25);
    let corners = [far, far + Vec3::X, far + Vec3::Y];
    let mut w = Writer::default();
    let positions = w.vectors(&corners);
    w.add("meshes", json!({ "primitives": [{ "attributes": { "POSITION": positions } }] }));
    w.node(json!({ "mesh": 0, "scale": [0.5, 0.5, 0.5], "translation": [0.125, 0.0, 3.0] }));
    w.node(json!({ "mesh": 0, "scale": [-0.5, 0.5, 0.5], "translation": [1_000_001.0, 0.0, 0.0] }));
    let mut scene = load(w);
    let snapshot = scene.snapshot();
    let mesh = &snapshot.instances[0].mesh;
    assert!(mesh.primitives[0].vertices.positions.iter().all(|p| p.length() < 2048.0));
    for (n, (scale, moved)) in
        [(0.5, [0.125, 0.0, 3.0]), (-0.5, [1_000_001.0, 0.0, 0.0])].into_iter().enumerate()
    {
        for (corner, kept) in corners.iter().zip(&mesh.primitives[0].vertices.positions) {
            let scale = DVec3::new(scale, 0.5, 0.5);
            let expected = scale * corner.as_dvec3() + DVec3::from(moved);
            assert_eq!(place(&snapshot, n, *kept), expected);
        }
    }
}

/// A few distant strays do not move the origin away from the rest.
#[test]
fn strays_do_not_move_the_origin() {
    let near = [0.0, 1.0, 2.0].map(|x| at(DVec3::new(x, 0.0, 0.0)));
    let stray = [at(DVec3::new(3e7, 0.0, 0.0))];
    let mut scene = load(triangles(&[near.as_slice(), &stray].concat()));
    assert_eq!(scene.snapshot().origin, Vec3::ZERO);
    let warnings = scene.warnings().join("\n");
    assert!(warnings.contains("reaches 30000 km") && warnings.contains("150 m"), "{warnings}");

    let far = [0.0, 1.0, 2.0].map(|x| at(DVec3::new(x + 1e6, 0.0, 0.0)));
    let mut scene = load(triangles(&[far.as_slice(), &stray].concat()));
    assert!(scene.snapshot().origin.distance(Vec3::X * 1e6) < 1024.0);
}

#[test]
fn lost_digits_are_told_with_the_distance() {
    let of = |distance: f64| load(triangles(&[at(DVec3::X * distance)])).warnings().join("\n");
    assert!(!of(5e3).contains("origin"));
    for (distance, said, digits) in
        [(1e5, "100 km", "6.0 mm"), (1e6, "1000 km", "6 cm"), (2e7, "20000 km", "1 m")]
    {
        let warnings = of(distance);
        assert!(warnings.contains(said) && warnings.contains(digits), "{warnings}");
    }
}

/// Copies of a scene that follow its edits have the same transforms, and so do lights and cameras.
#[test]
fn edits_and_copies_are_placed_alike() {
    let far = DVec3::new(-2e6, 0.0, 3e5);
    let mut w = triangles(&[at(far), at(far + DVec3::Y)]);
    w.light(json!({ "type": "point" }), at(far + DVec3::Z));
    w.camera("camera", 0.7, at(far + 2.0 * DVec3::Z));
    let mut scene = load(w);
    let translation = Some(Vec3::new(-2e6, 5.0, 3e5));
    let transform = Transform { translation, ..Transform::default() };
    scene.apply(&Edit::MoveNode { node: NodeId(1), transform }).expect("an edit");
    let mut copy = scene.pristine(0.0);
    for edit in scene.edits_since_load() {
        copy.replay(&edit).expect("an edit");
    }
    assert_same(&mut scene, &mut copy);
    let snapshot = scene.snapshot();
    assert_eq!(snapshot.origin, copy.snapshot().origin);
    assert_eq!(place(&snapshot, 1, Vec3::ZERO), DVec3::new(-2e6, 5.0, 3e5));
    let light = snapshot.lights[0].position + snapshot.origin;
    assert!(light.as_dvec3().distance(far + DVec3::Z) < 0.2, "{light}");
    let eye = Vec3::from(scene.views()[0].view.world_from_camera.translation);
    assert!(eye.as_dvec3().distance(far + 2.0 * DVec3::Z) < 0.2, "{eye}");
}
