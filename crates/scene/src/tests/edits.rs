//! Edits: their effects, and refusals.

use glam::{Quat, Vec3, Vec4};
use serde_json::json;

use super::{assert_same, load, triangle};
use crate::{
    AlphaMode, AnimationId, Edit, Environment, InstanceSource, LightKind, LightSpec,
    MaterialChange, MaterialId, MeshId, NodeId, Playback, PunctualLight, Scene, Transform,
};

/// A triangle (node 0), a lamp (1), a spot light (2) and a group (3) with a triangle (4) in it. The
/// triangles have a masked material (0) and the default one (1).
fn scene() -> Scene {
    let mut w = triangle();
    w.light(json!({ "type": "point", "intensity": 2.0 }), json!({ "name": "lamp" }));
    let spot = json!({ "innerConeAngle": 0.2, "outerConeAngle": 0.4 });
    w.light(json!({ "type": "spot", "spot": spot }), json!({ "name": "spot" }));
    w.node(json!({ "name": "group", "children": [4] }));
    w.node(json!({ "mesh": 0 }));
    w.add("materials", json!({ "name": "net", "alphaMode": "MASK" }));
    w.animation(
        "turn",
        (4, "rotation"),
        "LINEAR",
        &[0.0, 1.0],
        ("VEC4", &[Quat::IDENTITY.to_array(), Quat::from_rotation_y(1.0).to_array()].concat()),
    );
    load(w)
}

fn light(kind: LightKind, intensity: f32) -> PunctualLight {
    PunctualLight { kind, color: Vec3::ONE, intensity, range: None }
}

fn at(translation: Vec3) -> Transform {
    Transform { translation: Some(translation), ..Transform::default() }
}

#[test]
fn nodes_are_moved_in_parts() {
    let mut scene = scene();
    let transform = Transform { rotation: Some(Quat::from_xyzw(0., 0., 0., 3.)), ..at(Vec3::X) };
    let edit = Edit::MoveNode { node: NodeId(3), transform };
    assert_eq!(scene.apply(&edit).expect("moved"), edit);
    let scaled = Transform { scale: Some(Vec3::splat(2.0)), ..Transform::default() };
    scene.apply(&Edit::MoveNode { node: NodeId(3), transform: scaled }).expect("scaled");
    let snapshot = scene.snapshot();
    let below = snapshot.instances.iter().find(|i| i.node == NodeId(4)).expect("the child");
    assert_eq!(below.world_from_object.transform_point3(Vec3::X), Vec3::new(3.0, 0.0, 0.0));
    assert_eq!(scene.version(), 2);
}

#[test]
fn added_nodes_get_the_next_numbers_whatever_the_edit_says() {
    let mut scene = scene();
    let add = |node| Edit::AddInstance {
        node,
        name: None,
        source: InstanceSource::Mesh(MeshId(0)),
        parent: Some(NodeId(3)),
        transform: at(Vec3::Y),
    };
    assert_eq!(scene.apply(&add(None)).expect("added"), add(Some(NodeId(5))));
    assert_eq!(scene.apply(&add(Some(NodeId(1 << 31)))).expect("added"), add(Some(NodeId(6))));
    scene.apply(&Edit::RemoveNode { node: NodeId(6) }).expect("removed");
    let lamp = Edit::AddLight {
        node: None,
        name: None,
        light: light(LightKind::Point { radius: 0.0 }, 3.0),
        parent: Some(NodeId(5)),
        transform: at(Vec3::Y),
    };
    let Edit::AddLight { node, .. } = scene.apply(&lamp).expect("added") else { unreachable!() };
    assert_eq!(node, Some(NodeId(7)), "numbers are never used twice");
    let placed = scene.lights().into_iter().find(|l| l.node == NodeId(7)).expect("the lamp");
    assert_eq!(placed.position, Vec3::new(0.0, 2.0, 0.0));
}

#[test]
fn removing_a_node_removes_all_below_it() {
    let mut scene = scene();
    assert_eq!(scene.snapshot().instances.len(), 2);
    scene.apply(&Edit::RemoveNode { node: NodeId(3) }).expect("removed");
    assert_eq!(scene.snapshot().instances.len(), 1);
    let gone = Edit::MoveNode { node: NodeId(4), transform: at(Vec3::X) };
    assert_eq!(scene.apply(&gone).expect_err("gone").to_string(), "node 4 does not exist");
    // The animation's node is gone, so nothing moves.
    assert!(!scene.advance(0.5));
}

#[test]
fn lights_change_and_go_out() {
    let mut scene = scene();
    let spec = LightSpec { intensity: Some(100_000.0), ..LightSpec::default() };
    scene.apply(&Edit::SetLight { node: NodeId(1), light: spec }).expect("set");
    assert_eq!(scene.snapshot().lights[0].light.intensity, 100_000.0);
    let dim = LightSpec { intensity: Some(1e-3), ..LightSpec::default() };
    scene.apply(&Edit::SetLight { node: NodeId(1), light: dim }).expect("set");
    assert_eq!(scene.snapshot().lights[0].light.intensity, 1e-3);
    let off = LightSpec { intensity: Some(0.0), ..LightSpec::default() };
    scene.apply(&Edit::SetLight { node: NodeId(1), light: off }).expect("set");
    assert_eq!(scene.snapshot().lights.len(), 1, "the spot light only");
    scene.apply(&Edit::RemoveLight { node: NodeId(2) }).expect("removed");
    assert!(scene.snapshot().lights.is_empty());
}

#[test]
fn lights_have_a_size() {
    let mut w = triangle();
    let with = |mut light: serde_json::Value, size| {
        light["extras"] = json!({ "lumencast": size, "other": 1 });
        light
    };
    w.light(with(json!({ "type": "point" }), json!({ "radius": 0.25 })), json!({}));
    w.light(with(json!({ "type": "spot" }), json!({ "radius": 0.5 })), json!({}));
    w.light(with(json!({ "type": "directional" }), json!({ "angle": 0.0093 })), json!({}));
    w.light(json!({ "type": "point", "extras": [1, 2] }), json!({}));
    let mut scene = load(w);
    let kinds = |scene: &Scene| scene.lights().iter().map(|l| l.light.kind).collect::<Vec<_>>();
    let outer = std::f32::consts::FRAC_PI_4;
    let spot = |radius| LightKind::Spot { inner: 0.0, outer, radius };
    let (point, sun) =
        (|radius| LightKind::Point { radius }, |angle| LightKind::Directional { angle });
    assert_eq!(kinds(&scene), [point(0.25), spot(0.5), sun(0.0093), point(0.0)]);
    let mut set = |node, light| {
        scene.apply(&Edit::SetLight { node: NodeId(node), light }).expect("set");
    };
    set(2, LightSpec { radius: Some(0.0), outer: Some(outer), ..LightSpec::default() });
    set(3, LightSpec { angle: Some(0.02), ..LightSpec::default() });
    set(4, LightSpec { radius: Some(1.0), ..LightSpec::default() });
    assert_eq!(kinds(&scene), [point(0.25), spot(0.0), sun(0.02), point(1.0)]);
}

#[test]
fn lights_shine_along_their_nodes_whatever_the_scale() {
    let mut scene = scene();
    let rotation = Some(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2));
    let transform = Transform { rotation, scale: Some(Vec3::new(5.0, -5.0, 0.1)), ..at(Vec3::ONE) };
    scene.apply(&Edit::MoveNode { node: NodeId(2), transform }).expect("moved");
    let spot = scene.lights()[1];
    assert!((spot.direction - Vec3::NEG_X).length() < 1e-6, "{}", spot.direction);
    assert_eq!((spot.position, spot.light.intensity), (Vec3::ONE, 1.0));
}

#[test]
fn materials_change() {
    let mut scene = scene();
    let before = scene.snapshot();
    let change = MaterialChange {
        base_color: Some(Vec4::new(1.0, 0.0, 0.0, 1.0)),
        emissive: Some(Vec3::splat(5.0)),
        ..MaterialChange::default()
    };
    scene.apply(&Edit::SetMaterial { material: MaterialId(0), change }).expect("changed");
    let after = scene.snapshot();
    assert_eq!(after.materials[0].emissive, Vec3::splat(5.0));
    assert_eq!(after.materials[0].base_color.x, 1.0);
    assert_eq!(before.materials[0].emissive, Vec3::ZERO, "earlier snapshots stay as they are");
}

#[test]
fn every_factor_of_a_material_changes_and_is_told_to_late_joiners() {
    let mut scene = scene();
    let change = MaterialChange {
        base_color: Some(Vec4::new(0.1, 0.2, 0.3, 0.4)),
        metallic: Some(0.5),
        roughness: Some(0.6),
        emissive: Some(Vec3::new(1.0, 2.0, 3.0)),
        transmission: Some(0.7),
        ior: Some(1.33),
        specular: Some(0.8),
        specular_color: Some(Vec3::new(0.9, 1.0, 2.0)),
        normal_scale: Some(-0.25),
        alpha_cutoff: Some(0.35),
    };
    let edit = Edit::SetMaterial { material: MaterialId(0), change };
    scene.apply(&edit).expect("changed");
    let m = &scene.snapshot().materials[0];
    assert_eq!(m.base_color, Vec4::new(0.1, 0.2, 0.3, 0.4));
    assert_eq!((m.metallic, m.roughness, m.emissive), (0.5, 0.6, Vec3::new(1.0, 2.0, 3.0)));
    assert_eq!((m.transmission, m.ior, m.specular), (0.7, 1.33, 0.8));
    assert_eq!((m.specular_color, m.normal_scale), (Vec3::new(0.9, 1.0, 2.0), -0.25));
    assert_eq!(m.alpha_mode, AlphaMode::Mask(0.35));
    assert_eq!(scene.edits_since_load(), [edit]);
}

#[test]
fn factors_at_the_ends_of_their_ranges_are_taken() {
    let plain = MaterialChange::default();
    for change in [
        MaterialChange { transmission: Some(0.0), specular: Some(0.0), ior: Some(0.0), ..plain },
        MaterialChange { transmission: Some(1.0), specular: Some(1.0), ior: Some(1.0), ..plain },
        MaterialChange { specular_color: Some(Vec3::ZERO), alpha_cutoff: Some(0.0), ..plain },
        MaterialChange { specular_color: Some(Vec3::splat(1e9)), ..plain },
        MaterialChange { alpha_cutoff: Some(1.5), normal_scale: Some(0.0), ..plain },
    ] {
        scene().apply(&Edit::SetMaterial { material: MaterialId(0), change }).expect("in range");
    }
}

/// Every kind of senseless edit, with a part of the expected reason.
fn senseless() -> Vec<(Edit, &'static str)> {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let go = |node: u32, transform| Edit::MoveNode { node: NodeId(node), transform };
    let none = Transform::default();
    let scale = |s: Vec3| Transform { scale: Some(s), ..none };
    let turn = |q: [f32; 4]| Transform { rotation: Some(Quat::from_array(q)), ..none };
    let set = |node: u32, light| Edit::SetLight { node: NodeId(node), light };
    let spec = LightSpec::default();
    let add =
        |light| Edit::AddLight { node: None, name: None, light, parent: None, transform: none };
    let paint = |change| Edit::SetMaterial { material: MaterialId(0), change };
    let paint_opaque = |change| Edit::SetMaterial { material: MaterialId(1), change };
    let plain = MaterialChange::default();
    let instance = |source, parent: Option<u32>| Edit::AddInstance {
        node: None,
        name: None,
        source,
        parent: parent.map(NodeId),
        transform: none,
    };
    let sky = |v: f32| Edit::SetEnvironment {
        environment: Environment::Constant { radiance: Vec3::splat(v) },
    };
    let play =
        |animation, playback| Edit::SetAnimation { animation: AnimationId(animation), playback };
    let spot = |inner, outer| light(LightKind::Spot { inner, outer, radius: 0.0 }, 1.0);
    let outside = InstanceSource::File("../other.glb".into());
    vec![
        (go(999, none), "node 999 does not exist"),
        (go(3, at(Vec3::splat(nan))), "node 3 \"group\": its translation"),
        (go(3, at(Vec3::new(inf, 0., 0.))), "translation"),
        (go(3, at(Vec3::splat(1e30))), "translation"),
        (go(3, turn([0.; 4])), "rotation"),
        (go(3, turn([nan, 0., 0., 1.])), "rotation"),
        (go(3, scale(Vec3::new(1., 0., 1.))), "scale"),
        (go(3, scale(Vec3::splat(1e-20))), "flatten"),
        (Edit::RemoveNode { node: NodeId(77) }, "node 77 does not exist"),
        (set(0, spec), "node 0 \"leaf\" carries no light"),
        (set(1, LightSpec { intensity: Some(-1.0), ..spec }), "node 1 \"lamp\": its intensity"),
        (set(1, LightSpec { intensity: Some(nan), ..spec }), "intensity"),
        (set(1, LightSpec { color: Some(Vec3::new(0., -1., 0.)), ..spec }), "colour"),
        (set(1, LightSpec { range: Some(0.0), ..spec }), "range"),
        (set(1, LightSpec { inner: Some(0.1), ..spec }), "only spot lights"),
        (set(2, LightSpec { inner: Some(0.5), ..spec }), "cones"),
        (set(2, LightSpec { outer: Some(2.0), ..spec }), "cones"),
        (set(1, LightSpec { radius: Some(-0.1), ..spec }), "node 1 \"lamp\": its radius is -0.1"),
        (set(1, LightSpec { radius: Some(nan), ..spec }), "radius"),
        (set(2, LightSpec { radius: Some(inf), ..spec }), "radius"),
        (set(1, LightSpec { angle: Some(0.1), ..spec }), "only directional lights"),
        (Edit::RemoveLight { node: NodeId(0) }, "carries no light"),
        (add(light(LightKind::Point { radius: 1e10 }, 1.0)), "radius"),
        (add(light(LightKind::Directional { angle: nan }, 1.0)), "angle"),
        (add(light(LightKind::Directional { angle: -0.1 }, 1.0)), "angle"),
        (add(light(LightKind::Directional { angle: 3.2 }, 1.0)), "its angle is 3.2; 0 to π"),
        (add(light(LightKind::Point { radius: 0.0 }, inf)), "intensity"),
        (add(spot(0.5, 0.4)), "cones"),
        (paint(MaterialChange { base_color: Some(Vec4::splat(1.5)), ..plain }), "0 to 1"),
        (paint(MaterialChange { roughness: Some(-0.1), ..plain }), "0 to 1"),
        (paint(MaterialChange { emissive: Some(Vec3::splat(-1.0)), ..plain }), "emission"),
        (
            paint(MaterialChange { transmission: Some(1.1), roughness: Some(0.5), ..plain }),
            "material 0 \"net\": its transmission is 0 to 1",
        ),
        (paint(MaterialChange { transmission: Some(nan), ..plain }), "transmission"),
        (
            paint(MaterialChange { ior: Some(0.9), ..plain }),
            "its ior is finite and 1 or more, or 0",
        ),
        (paint(MaterialChange { ior: Some(-1.0), ..plain }), "ior"),
        (paint(MaterialChange { ior: Some(inf), ..plain }), "ior"),
        (paint(MaterialChange { specular: Some(-0.1), ..plain }), "specular strength is 0 to 1"),
        (paint(MaterialChange { specular: Some(nan), ..plain }), "specular strength"),
        (
            paint(MaterialChange { specular_color: Some(Vec3::new(0., 0., -0.1)), ..plain }),
            "its specular colour are 0 to 1e9",
        ),
        (
            paint(MaterialChange { specular_color: Some(Vec3::new(inf, 0., 0.)), ..plain }),
            "specular colour",
        ),
        (
            paint(MaterialChange { specular_color: Some(Vec3::new(0., nan, 0.)), ..plain }),
            "specular colour",
        ),
        (paint(MaterialChange { normal_scale: Some(inf), ..plain }), "its normal scale is finite"),
        (paint(MaterialChange { normal_scale: Some(nan), ..plain }), "normal scale"),
        (
            paint(MaterialChange { alpha_cutoff: Some(-0.1), ..plain }),
            "its alpha cutoff is finite and 0 or more",
        ),
        (paint(MaterialChange { alpha_cutoff: Some(inf), ..plain }), "alpha cutoff"),
        (
            paint_opaque(MaterialChange { alpha_cutoff: Some(0.5), metallic: Some(0.0), ..plain }),
            "only masked materials have an alpha cutoff",
        ),
        (Edit::SetMaterial { material: MaterialId(9), change: plain }, "material 9 does not"),
        (instance(InstanceSource::Mesh(MeshId(9)), None), "mesh 9 does not exist"),
        (instance(InstanceSource::Mesh(MeshId(0)), Some(50)), "node 50 does not exist"),
        (instance(outside, None), "only files in the scene's own folder"),
        (play(5, Playback::default()), "animation 5 does not exist"),
        (play(0, Playback { speed: Some(f64::INFINITY), ..Playback::default() }), "animation 0"),
        (sky(-1.0), "environment"),
        (sky(nan), "environment"),
    ]
}

#[test]
fn senseless_edits_are_refused_with_a_reason_and_change_nothing() {
    let (mut edited, mut untouched) = (scene(), scene());
    for (edit, reason) in senseless() {
        let error = edited.apply(&edit).expect_err(reason).to_string();
        assert!(error.contains(reason), "{edit:?}: {error:?} without {reason:?}");
        assert_same(&mut edited, &mut untouched);
        assert_eq!(edited.version(), 0);
        assert!(edited.edits_since_load().is_empty());
    }
}

#[test]
fn a_move_that_puts_a_child_out_of_the_world_is_refused() {
    let mut scene = scene();
    let far = Edit::MoveNode { node: NodeId(4), transform: at(Vec3::splat(1e9)) };
    scene.apply(&far).expect("far, but in the world");
    let transform = Transform { scale: Some(Vec3::splat(1e9)), ..Transform::default() };
    let error = scene.apply(&Edit::MoveNode { node: NodeId(3), transform }).expect_err("too far");
    assert!(error.to_string().contains("node 4 out of the world"), "{error}");
}

#[test]
fn a_replica_takes_numbers_as_they_are_and_none_twice() {
    let mut scene = scene();
    let add = |node: Option<u32>| Edit::AddInstance {
        name: None,
        node: node.map(NodeId),
        source: InstanceSource::Mesh(MeshId(0)),
        parent: None,
        transform: Transform::default(),
    };
    scene.replay(&add(Some(20))).expect("a gap is possible");
    for (number, reason) in [(Some(20), "taken"), (Some(7), "taken"), (None, "no number")] {
        let error = scene.replay(&add(number)).expect_err(reason).to_string();
        assert!(error.contains(reason), "{error}");
    }
}
