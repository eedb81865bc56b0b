//! Animation, morph targets and skins, compared with results computed by hand.

use std::sync::Arc;

use glam::{Quat, Vec3};
use serde_json::json;

use super::{TRIANGLE, load, triangle};
use crate::builtin::writer::Writer;
use crate::{Edit, NodeId, Playback, Scene};

fn animate(
    w: &mut Writer,
    node: usize,
    path: &str,
    interpolation: &str,
    kind: &str,
    values: &[f32],
) {
    w.animation(path, (node, path), interpolation, &[0.0, 2.0], (kind, values));
}

fn translation(scene: &Scene, node: usize) -> Vec3 {
    let info = scene.nodes().nth(node).expect("the node");
    info.transform.translation.expect("all parts are set")
}

#[test]
fn animations_play_in_a_loop_and_tell_when_something_moves() {
    let mut w = triangle();
    animate(&mut w, 0, "translation", "LINEAR", "VEC3", &[0., 0., 0., 4., 0., 0.]);
    let mut scene = load(w);
    assert!(scene.advance(0.5));
    assert_eq!((translation(&scene, 0).x, scene.version()), (1.0, 1));
    assert!(!scene.advance(0.0), "no time has passed");
    assert!(scene.advance(2.25), "by way of the end");
    assert_eq!(scene.version(), 2);
    // After 2.75 s of a loop of 2 s it is where it was after 0.75 s.
    assert!((translation(&scene, 0).x - 1.5).abs() < 1e-6);
    let world = scene.snapshot().instances[0].world_from_object;
    assert!((world.translation.x - 1.5).abs() < 1e-6);
    assert!(!scene.advance(f64::NAN) && !scene.advance(-1.0));
    assert_eq!(scene.time(), 2.75);
}

#[test]
fn a_snapshot_is_kept_until_something_changes() {
    let mut scene = load(triangle());
    let first = scene.snapshot();
    assert!(Arc::ptr_eq(&first, &scene.snapshot()));
    drop(first);
    scene.advance(1.0);
    assert_eq!((scene.snapshot().time, scene.snapshot().version), (1.0, 0));
}

#[test]
fn playback_is_paused_sought_and_turned_round() {
    let mut w = triangle();
    animate(&mut w, 0, "translation", "LINEAR", "VEC3", &[0., 0., 0., 4., 0., 0.]);
    let mut scene = load(w);
    let set = |scene: &mut Scene, playback: Playback| {
        scene.apply(&Edit::SetAnimation { animation: crate::AnimationId(0), playback }).map(|_| ())
    };
    scene.advance(0.25);
    set(&mut scene, Playback { playing: Some(false), ..Playback::default() }).expect("paused");
    assert!(!scene.advance(0.5));
    assert_eq!(translation(&scene, 0).x, 0.5);
    let back = Playback { playing: Some(true), time: Some(1.5), speed: Some(-2.0) };
    set(&mut scene, back).expect("sought");
    assert_eq!(translation(&scene, 0).x, 3.0);
    scene.advance(0.5);
    assert_eq!(translation(&scene, 0).x, 1.0);
    let nan = Playback { time: Some(f64::NAN), ..Playback::default() };
    set(&mut scene, nan).expect_err("not a time");
}

#[test]
fn morph_targets_displace_by_their_weights() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE);
    let up = w.vectors(&[Vec3::Z, Vec3::Z, Vec3::Z]);
    let aside = w.vectors(&[Vec3::X, Vec3::ZERO, Vec3::ZERO]);
    let primitive = json!({
        "attributes": { "POSITION": positions },
        "targets": [{ "POSITION": up }, { "POSITION": aside }],
    });
    w.add("meshes", json!({ "primitives": [primitive], "weights": [0.5, 0.0] }));
    w.node(json!({ "mesh": 0, "translation": [0.0, 0.0, 10.0] }));
    animate(&mut w, 0, "weights", "LINEAR", "SCALAR", &[0.5, 0.0, 0.5, 2.0]);
    let mut scene = load(w);
    scene.advance(0.5);
    let moved = scene.snapshot();
    let instance = &moved.instances[0];
    assert!(!instance.still, "it deforms");
    assert_eq!(instance.world_from_object.translation.z, 10.0);
    let vertices = instance.vertices(0);
    let want = [Vec3::new(0.5, 0.0, 0.5), Vec3::new(1.0, 0.0, 0.5), Vec3::new(0.0, 1.0, 0.5)];
    assert_eq!(vertices.positions, want);
    assert!(vertices.normals.iter().all(|n| *n == Vec3::Z));

    // Unchanged weights keep the same vertices; changed ones give new ones.
    let kept =
        |scene: &mut Scene| scene.snapshot().instances[0].deformation.clone().expect("deformed");
    let before = kept(&mut scene);
    let transform = crate::Transform { translation: Some(Vec3::ONE), ..Default::default() };
    scene.apply(&Edit::MoveNode { node: NodeId(0), transform }).expect("moved");
    assert!(Arc::ptr_eq(&before, &kept(&mut scene)));
    scene.advance(0.1);
    assert!(!Arc::ptr_eq(&before, &kept(&mut scene)));
}

/// The first of two joints stands still; the second, a metre up, turns about z. The upper vertex
/// follows the second joint, the right one each of them by half.
#[test]
fn skinned_vertices_follow_their_joints() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &[0., 0., 0., 1., 1., 0., 0., 2., 0.]);
    let normals = w.vectors(&[Vec3::Z, Vec3::Z, Vec3::X]);
    let joints_view = w.view(&[0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0]);
    let joints = w.add(
        "accessors",
        json!({ "bufferView": joints_view, "componentType": 5121, "type": "VEC4", "count": 3 }),
    );
    // Weights are normalised on reading.
    let weights = w.floats("VEC4", &[1., 0., 0., 0., 2., 2., 0., 0., 1., 0., 0., 0.]);
    let attributes = json!({ "POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights });
    w.add("meshes", json!({ "primitives": [{ "attributes": attributes }] }));
    let identity = glam::Mat4::IDENTITY.to_cols_array();
    let down = glam::Mat4::from_translation(Vec3::NEG_Y).to_cols_array();
    let inverse_bind = w.floats("MAT4", &[identity, down].concat());
    w.add("skins", json!({ "joints": [1, 2], "inverseBindMatrices": inverse_bind }));
    // The node's own transform does not count for a skinned mesh.
    w.node(
        json!({ "mesh": 0, "skin": 0, "translation": [100.0, 0.0, 0.0], "scale": [0.0, 0.0, 0.0] }),
    );
    w.node(json!({ "name": "root", "translation": [0.0, 0.0, 5.0], "children": [2] }));
    w.node(json!({ "name": "tip", "translation": [0.0, 1.0, 0.0] }));
    let turned = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2).to_array();
    animate(&mut w, 2, "rotation", "STEP", "VEC4", &[turned, [0., 0., 0., 1.]].concat());
    let mut scene = load(w);
    let snapshot = scene.snapshot();
    let instance = &snapshot.instances[0];
    assert_eq!(instance.world_from_object, glam::Affine3A::IDENTITY);
    let v = instance.vertices(0);
    // The tip turns (0, 2) about (0, 1) to (−1, 1). Half of the way from (1, 1) to (0, 2) is (0.5,
    // 1.5). The root moves all by z = 5.
    let want = [Vec3::new(0., 0., 5.), Vec3::new(0.5, 1.5, 5.), Vec3::new(-1., 1., 5.)];
    for (got, want) in v.positions.iter().zip(want) {
        assert!((*got - want).length() < 1e-6, "{got} {want}");
    }
    assert!((v.normals[2] - Vec3::Y).length() < 1e-6, "{}", v.normals[2]);
}

/// A skin below a mirrored node winds and faces as a rigid mesh there does.
#[test]
fn mirrored_skins_keep_their_front() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    let normals = w.vectors(&[Vec3::Z; 3]);
    let joints_view = w.view(&[0; 12]);
    let joints = w.add(
        "accessors",
        json!({ "bufferView": joints_view, "componentType": 5121, "type": "VEC4", "count": 3 }),
    );
    let weights = w.floats("VEC4", &[1., 0., 0., 0.].repeat(3));
    let rigid = json!({ "POSITION": positions, "NORMAL": normals });
    let skinned = json!({ "POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights });
    w.add("meshes", json!({ "primitives": [{ "attributes": skinned }] }));
    w.add("meshes", json!({ "primitives": [{ "attributes": rigid }] }));
    w.add("skins", json!({ "joints": [1] }));
    w.node(json!({ "mesh": 0, "skin": 0 }));
    w.node(json!({ "scale": [1.0, -2.0, 1.0], "mesh": 1 }));
    let snapshot = load(w).snapshot();
    let seen: Vec<_> = snapshot
        .instances
        .iter()
        .map(|instance| {
            let to_world = instance.world_from_object;
            let vertices = instance.vertices(0);
            let p = |i: usize| to_world.transform_point3(vertices.positions[i]);
            let winding = to_world.matrix3.determinant().signum();
            let face = winding * (p(1) - p(0)).cross(p(2) - p(0)).normalize();
            let normal =
                to_world.inverse().matrix3.transpose() * glam::Vec3A::from(vertices.normals[0]);
            (p(1), p(2), face, Vec3::from(normal).normalize())
        })
        .collect();
    assert_eq!(seen[0], seen[1]);
    assert_eq!(seen[0], (Vec3::X, Vec3::new(0.0, -2.0, 0.0), Vec3::Z, Vec3::Z));
}

#[test]
fn the_later_animation_of_a_node_wins() {
    let mut w = triangle();
    animate(&mut w, 0, "translation", "STEP", "VEC3", &[1., 0., 0., 1., 0., 0.]);
    animate(&mut w, 0, "translation", "STEP", "VEC3", &[2., 0., 0., 2., 0., 0.]);
    let mut scene = load(w);
    assert_eq!(translation(&scene, 0).x, 2.0);
    let pause = Playback { playing: Some(false), ..Playback::default() };
    let edit = Edit::SetAnimation { animation: crate::AnimationId(1), playback: pause };
    scene.apply(&edit).expect("paused");
    scene.advance(0.1);
    assert_eq!(translation(&scene, 0).x, 1.0, "the one that runs moves it");
}

/// What an animation moves is not still, with all below it, while it runs and while it stands; what
/// stands beside it is.
#[test]
fn what_may_move_is_not_still() {
    let mut w = triangle();
    let beside = w.node(json!({ "mesh": 0 }));
    let below = w.node(json!({ "mesh": 0 }));
    let between = w.node(json!({ "children": [below] }));
    let group = w.node(json!({ "children": [between] }));
    animate(&mut w, group, "translation", "STEP", "VEC3", &[1., 0., 0., 1., 0., 0.]);
    let mut scene = load(w);
    let stills = |scene: &mut Scene| -> Vec<(u32, bool)> {
        scene.snapshot().instances.iter().map(|i| (i.node.0, i.still)).collect()
    };
    let expected = [(0, true), (beside as u32, true), (below as u32, false)];
    assert_eq!(stills(&mut scene), expected);
    let pause = Playback { playing: Some(false), ..Playback::default() };
    let edit = Edit::SetAnimation { animation: crate::AnimationId(0), playback: pause };
    scene.apply(&edit).expect("paused");
    assert_eq!(stills(&mut scene), expected);
}

#[test]
fn what_shrinks_to_nothing_is_not_drawn() {
    let mut w = triangle();
    animate(&mut w, 0, "scale", "STEP", "VEC3", &[0., 0., 0., 1., 1., 1.]);
    let mut scene = load(w);
    assert!(scene.snapshot().instances.is_empty());
    assert!(scene.edits_since_load().is_empty());
}

#[test]
fn mirrored_and_nested_transforms() {
    let mut w = triangle();
    w.node(json!({ "children": [0], "scale": [-2.0, 1.0, 1.0], "translation": [1.0, 0.0, 0.0] }));
    let matrix = glam::Mat4::from_scale_rotation_translation(
        Vec3::new(1.0, 2.0, -3.0),
        Quat::from_rotation_x(0.4),
        Vec3::new(0.0, 0.0, 7.0),
    );
    w.node(json!({ "children": [1], "matrix": matrix.to_cols_array() }));
    let mut scene = load(w);
    let world = scene.snapshot().instances[0].world_from_object;
    let point = matrix.transform_point3(Vec3::new(1.0 - 2.0 * 0.5, 0.25, 0.0));
    let got = world.transform_point3(Vec3::new(0.5, 0.25, 0.0));
    assert!((got - point).length() < 1e-5, "{got} {point}");
    assert!(world.matrix3.determinant() > 0.0, "mirrored twice");
}
