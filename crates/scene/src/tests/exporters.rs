//! Features that exporters write besides plain glTF: instances, hidden nodes, many joints for each
//! vertex.

use glam::{Affine3A, Quat, Vec3};
use serde_json::{Value, json};

use super::{TRIANGLE, assert_same, fault, fault_of, load, triangle};
use crate::builtin::writer::Writer;
use crate::{Edit, NodeId, Scene, Snapshot, Transform};

/// A triangle's node (0) with instances, in a group (1).
fn instanced(attributes: impl FnOnce(&mut Writer) -> Value) -> Writer {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE);
    w.add("meshes", json!({ "primitives": [{ "attributes": { "POSITION": positions } }] }));
    let attributes = attributes(&mut w);
    let extensions = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    w.node(json!({ "mesh": 0, "translation": [0.0, 5.0, 0.0], "extensions": extensions }));
    w.node(json!({ "name": "group", "children": [0] }));
    w
}

/// Adds an accessor of integers.
fn integers(w: &mut Writer, code: u32, kind: &str, count: usize, bytes: &[u8]) -> usize {
    let view = w.view(bytes);
    let accessor = json!({
        "bufferView": view, "componentType": code, "type": kind, "count": count, "normalized": true,
    });
    w.add("accessors", accessor)
}

fn places(snapshot: &Snapshot) -> Vec<Affine3A> {
    snapshot.instances.iter().map(|i| i.world_from_object).collect()
}

fn assert_near(found: &[Affine3A], expected: &[Affine3A]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.abs_diff_eq(*expected, 1e-4), "{found} for {expected}");
    }
}

#[test]
fn a_nodes_instances_stand_where_their_attributes_say() {
    let turn = Quat::from_rotation_z(1.0);
    let w = instanced(|w| {
        let places = w.vectors(&[Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]);
        let identity = Quat::IDENTITY.to_array();
        let turns = [identity, turn.to_array(), identity].concat();
        let turns = w.floats("VEC4", &turns);
        let sizes = w.vectors(&[Vec3::ONE, Vec3::ONE, Vec3::new(1.0, 2.0, -3.0)]);
        json!({ "TRANSLATION": places, "ROTATION": turns, "SCALE": sizes, "_ID": places })
    });
    let mut scene = load(w);
    assert!(!scene.warnings().iter().any(|w| w.contains("EXT_mesh_gpu_instancing")));
    let up = Affine3A::from_translation(5.0 * Vec3::Y);
    let size = Vec3::new(1.0, 2.0, -3.0);
    let expected = [
        up,
        up * Affine3A::from_rotation_translation(turn, Vec3::X),
        up * Affine3A::from_scale_rotation_translation(size, Quat::IDENTITY, 2.0 * Vec3::X),
    ];
    let snapshot = scene.snapshot();
    assert_near(&places(&snapshot), &expected);
    assert!(snapshot.instances.iter().all(|i| i.node == NodeId(0)));
    assert_eq!(snapshot.instances.iter().map(|i| i.copy).collect::<Vec<_>>(), [0, 1, 2]);
    assert!(scene.bounds().max.abs_diff_eq(Vec3::new(3.0, 7.0, 0.0), 1e-4));

    // Moving the node or its parent moves all instances; removing it removes them.
    let joiner = scene.pristine(0.0);
    for (node, by) in [(NodeId(0), Vec3::new(0.0, 5.0, 1.0)), (NodeId(1), Vec3::X)] {
        let transform = Transform { translation: Some(by), ..Transform::default() };
        scene.apply(&Edit::MoveNode { node, transform }).expect("moved");
    }
    let by = Affine3A::from_translation(Vec3::new(1.0, 0.0, 1.0));
    assert_near(&places(&scene.snapshot()), &expected.map(|place| by * place));
    let mut joined = joiner;
    for edit in scene.edits_since_load() {
        joined.replay(&edit).expect("an own edit");
    }
    assert_same(&mut scene, &mut joined);
    scene.apply(&Edit::RemoveNode { node: NodeId(0) }).expect("removed");
    assert!(scene.snapshot().instances.is_empty());
}

/// Rotations may be normalised bytes or shorts.
#[test]
fn instances_are_turned_by_small_integers() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let bytes: Vec<u8> = [0.0, 0.0, half, half].map(|v: f32| (v * 127.0) as i8 as u8).to_vec();
    let shorts: Vec<u8> = [0.0, 0.0, half, half]
        .iter()
        .flat_map(|v: &f32| ((v * 32_767.0) as i16).to_le_bytes())
        .collect();
    for (code, bytes, within) in [(5120, bytes, 0.02), (5122, shorts, 1e-3)] {
        let w = instanced(|w| json!({ "ROTATION": integers(w, code, "VEC4", 1, &bytes) }));
        let turned = load(w).snapshot().instances[0].world_from_object.transform_vector3(Vec3::X);
        assert!((turned - Vec3::Y).length() < within, "{code}: {turned}");
    }
}

#[test]
fn instances_share_a_deformation() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE);
    let up = w.vectors(&[Vec3::Z; 3]);
    let primitive =
        json!({ "attributes": { "POSITION": positions }, "targets": [{ "POSITION": up }] });
    w.add("meshes", json!({ "primitives": [primitive], "weights": [0.5] }));
    let places = w.vectors(&[Vec3::ZERO, Vec3::X]);
    let extensions =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
    w.node(json!({ "mesh": 0, "extensions": extensions }));
    let snapshot = load(w).snapshot();
    let [a, b] = &snapshot.instances[..] else { panic!("{snapshot:?}") };
    let [a, b] = [a, b].map(|i| i.deformation.as_ref().expect("morphed"));
    assert!(std::sync::Arc::ptr_eq(a, b));
    assert_eq!(a.vertices()[0].positions[0].z, 0.5);
}

#[test]
fn faulty_instances_are_refused_by_name() {
    let here = "node 0: EXT_mesh_gpu_instancing: ";
    let of = |attributes: fn(&mut Writer) -> Value| {
        // JSON has no NaN, so the accessor's bounds are removed.
        fault_of(super::bad_input::without_bounds(instanced(attributes)))
    };
    for (attributes, reason) in [
        (
            (|w| {
                let [one, two] = [&[Vec3::X][..], &[Vec3::X; 2]].map(|v| w.vectors(v));
                json!({ "TRANSLATION": one, "SCALE": two })
            }) as fn(&mut Writer) -> Value,
            "SCALE has 2 elements, TRANSLATION 1",
        ),
        (|_| json!({ "TRANSLATION": 99 }), "TRANSLATION: accessor 99 of"),
        (
            |w| json!({ "TRANSLATION": w.floats("VEC3", &[0.0, f32::NAN, 0.0]) }),
            "the transform of instance 0 is not finite",
        ),
        (
            |w| json!({ "SCALE": w.floats("VEC3", &[1.0, 1.0, 1.0, 1.0, 1e12, 1.0]) }),
            "the transform of instance 1 is not finite or over 1e9",
        ),
        (
            |w| json!({ "ROTATION": w.floats("VEC4", &[0.0; 4]) }),
            "the ROTATION of instance 0 is not a quaternion",
        ),
        (|w| json!({ "ROTATION": w.floats("VEC3", &[0.0; 3]) }), "4 components are needed"),
    ] {
        let fault = of(attributes);
        assert!(fault.contains(&format!("{here}{reason}")) || fault.contains(reason), "{fault}");
        assert!(fault.contains(here), "{fault}");
    }
}

/// An accessor without a buffer costs no bytes, however many elements it declares.
#[test]
fn instances_are_counted() {
    let of = |count: usize| {
        instanced(|w| {
            let accessor = json!({ "componentType": 5126, "type": "VEC3", "count": count });
            json!({ "TRANSLATION": w.add("accessors", accessor) })
        })
    };
    assert_eq!(load(of(1000)).snapshot().instances.len(), 1000);
    let fault = fault(of(999_999));
    assert!(fault.contains("nodes and their instances exceed the limit of 1000000"), "{fault}");
    let folder = super::Folder::new("instances");
    let path = folder.write("scene.glb", of(400_000).finish(Value::Null));
    folder.write("more.glb", of(400_000).finish(Value::Null));
    let mut scene = Scene::load(&path).expect("within the limits");
    let add = Edit::AddInstance {
        node: None,
        name: None,
        source: crate::InstanceSource::File("more.glb".into()),
        parent: None,
        transform: Transform::default(),
    };
    let Ok(Edit::AddInstance { node: Some(node), .. }) = scene.apply(&add) else {
        panic!("not added")
    };
    let refusal = scene.apply(&add).expect_err("too many").to_string();
    assert!(refusal.contains("1000000 nodes and instances"), "{refusal}");
    scene.apply(&Edit::RemoveNode { node }).expect("removed");
    scene.apply(&add).expect("there is room again");
}

/// A lamp (0) and a triangle (1) below a hidden group (2), with a camera (3) and a triangle (4)
/// beside it.
fn hidden(visible: &Value) -> Writer {
    let mut w = Writer::default();
    w.light(json!({ "type": "point" }), json!({ "name": "lamp" }));
    let positions = w.floats("VEC3", &TRIANGLE);
    w.add("meshes", json!({ "primitives": [{ "attributes": { "POSITION": positions } }] }));
    w.node(json!({ "mesh": 0, "translation": [50.0, 0.0, 0.0] }));
    let extensions = json!({ "KHR_node_visibility": visible });
    w.node(json!({ "name": "group", "children": [0, 1, 3], "extensions": extensions }));
    w.camera("eye", 1.0, json!({}));
    w.node(json!({ "mesh": 0 }));
    w
}

#[test]
fn hidden_nodes_hide_what_is_below_them() {
    let mut scene = load(hidden(&json!({ "visible": false })));
    let snapshot = scene.snapshot();
    let shown: Vec<_> = snapshot.instances.iter().map(|i| i.node).collect();
    assert_eq!((shown, snapshot.lights.len()), (vec![NodeId(4)], 0));
    assert_eq!(scene.bounds().max.x, 1.0);
    assert_eq!(scene.cameras().len(), 1, "a view shows nothing of itself");
    let drawn: Vec<_> = scene.drawn_nodes().map(|n| n.id).collect();
    assert_eq!(drawn, [NodeId(4)]);
    // Nodes that edits add below it are hidden as well.
    let add = Edit::AddInstance {
        node: None,
        name: None,
        source: crate::InstanceSource::Mesh(crate::MeshId(0)),
        parent: Some(NodeId(2)),
        transform: Transform::default(),
    };
    scene.apply(&add).expect("added");
    assert_eq!(scene.snapshot().instances.len(), 1);
    assert!(scene.pristine(0.0).snapshot().lights.is_empty());
    for visible in [json!({ "visible": true }), json!({})] {
        let snapshot = load(hidden(&visible)).snapshot();
        assert_eq!((snapshot.instances.len(), snapshot.lights.len()), (2, 1));
    }
}

#[test]
fn a_scene_of_hidden_nodes_alone_is_refused() {
    let glb = hidden(&json!({ "visible": false })).finish_as(json!({ "nodes": [2] }));
    assert!(fault_of(glb).contains("hidden nodes are not drawn"));
}

/// Only the scene that the file names is drawn; nodes of its other scene are not.
#[test]
fn nodes_of_another_scene_are_not_drawn() {
    let mut w = triangle();
    w.light(json!({ "type": "point" }), json!({ "name": "lamp" }));
    let glb = w.finish_as(json!({ "nodes": [0] }));
    let scene = Scene::from_glb("test", glb).expect("a sound file");
    assert_eq!((scene.nodes().count(), scene.drawn_nodes().count()), (2, 1));
}

/// A vertex with eight joints, each a metre above the one before. Its weights move it up by half
/// the mean height of joints 4 to 7.
#[test]
fn vertices_hang_on_all_their_joints() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE);
    let set = |w: &mut Writer, first: u8| {
        let joints: Vec<u8> = (0..3).flat_map(|_| first..first + 4).collect();
        let view = w.view(&joints);
        w.add(
            "accessors",
            json!({ "bufferView": view, "componentType": 5121, "type": "VEC4", "count": 3 }),
        )
    };
    let joints = [set(&mut w, 0), set(&mut w, 4)];
    let weights = [[1.0, 0.0, 0.0, 0.0], [0.25; 4]].map(|set| w.floats("VEC4", &set.repeat(3)));
    let unused = w.floats("VEC4", &[0.0; 12]);
    let attributes = json!({
        "POSITION": positions, "JOINTS_0": joints[0], "WEIGHTS_0": weights[0],
        "JOINTS_1": joints[1], "WEIGHTS_1": weights[1],
        "JOINTS_2": joints[1], "WEIGHTS_2": unused,
    });
    w.add("meshes", json!({ "primitives": [{ "attributes": attributes }] }));
    w.add("skins", json!({ "joints": (1..9).collect::<Vec<_>>() }));
    w.node(json!({ "mesh": 0, "skin": 0 }));
    for joint in 0..8 {
        w.node(json!({ "translation": [0.0, joint, 0.0] }));
    }
    let mut scene = load(w);
    assert_eq!(scene.warnings().iter().filter(|w| w.contains("joint")).count(), 0);
    let snapshot = scene.snapshot();
    let instance = &snapshot.instances[0];
    assert_eq!(instance.mesh.primitives[0].influence_sets(), 2, "none without weight");
    for (found, rest) in instance.vertices(0).positions.iter().zip(TRIANGLE.as_chunks::<3>().0) {
        let expected = Vec3::from(*rest) + 2.75 * Vec3::Y;
        assert!((*found - expected).length() < 1e-6, "{found} for {expected}");
    }
}

/// Joint indices are checked in every set.
#[test]
fn joints_of_later_sets_are_the_skins() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE);
    let [near, far] = [[0u8; 12], [9; 12]].map(|joints| {
        let view = w.view(&joints);
        w.add(
            "accessors",
            json!({ "bufferView": view, "componentType": 5121, "type": "VEC4", "count": 3 }),
        )
    });
    let weights = w.floats("VEC4", &[0.25; 12]);
    let attributes = json!({
        "POSITION": positions, "JOINTS_0": near, "WEIGHTS_0": weights,
        "JOINTS_1": far, "WEIGHTS_1": weights,
    });
    w.add("meshes", json!({ "primitives": [{ "attributes": attributes }] }));
    w.add("skins", json!({ "joints": [0] }));
    w.node(json!({ "mesh": 0, "skin": 0 }));
    assert!(fault(w).contains("names joints that its skin 0 of 1 lacks"));
}

/// A quad's material may read any two sets. Of three sets, the last is ignored with a warning that
/// names it.
#[test]
fn later_texture_coordinates_are_read() {
    let of = |textures: &[(&str, usize)]| {
        let mut w = Writer::default();
        let positions = w.floats("VEC3", &TRIANGLE);
        let mut attributes = json!({ "POSITION": positions });
        for set in 0..5 {
            let uv = w.floats("VEC2", &[set as f32; 6]);
            attributes[format!("TEXCOORD_{set}")] = uv.into();
        }
        let mut material = json!({});
        for (kind, set) in textures {
            material[kind] = json!({ "index": 0, "texCoord": set });
        }
        let image = w.view(&super::bad_input::png(2, 2));
        w.add("images", json!({ "bufferView": image }));
        w.add("textures", json!({ "source": 0 }));
        w.add("materials", material);
        w.add("meshes", json!({ "primitives": [{ "attributes": attributes, "material": 0 }] }));
        w.node(json!({ "mesh": 0 }));
        load(w)
    };
    let read = |scene: &Scene, texture: &Option<crate::TextureRef>| {
        let place = texture.as_ref().expect("a texture").tex_coord;
        scene.meshes()[0].primitives[0].uv[place][0].x
    };
    for sets in [[0, 1], [1, 0], [2, 2], [0, 2], [2, 0], [1, 4], [4, 3]] {
        let scene = of(&[("emissiveTexture", sets[0]), ("occlusionTexture", sets[1])]);
        let material = &scene.materials()[0];
        let found = [&material.emissive_texture, &material.occlusion_texture]
            .map(|texture| read(&scene, texture) as usize);
        assert_eq!((found, scene.warnings().len()), (sets, 0), "{:?}", scene.warnings());
    }
    let three = [("normalTexture", 4), ("occlusionTexture", 0), ("emissiveTexture", 2)];
    let scene = of(&three);
    let [warning] = scene.warnings() else { panic!("{:?}", scene.warnings()) };
    assert!(warning.contains("material 0: texture 0 is left out: it uses TEXCOORD_2"), "{warning}");
    assert_eq!(read(&scene, &scene.materials()[0].normal_texture), 4.0);
}

/// Specular-glossiness is expressed as metallic-roughness. Where the picture's alpha is 102/255,
/// glossiness is 0.5 · 0.4.
#[test]
fn specular_glossiness_is_read() {
    let of = |gloss: Value| {
        let mut w = triangle();
        let picture = image::RgbaImage::from_pixel(2, 2, image::Rgba([200, 100, 50, 102]));
        let mut png = std::io::Cursor::new(Vec::new());
        image::DynamicImage::from(picture)
            .write_to(&mut png, image::ImageFormat::Png)
            .expect("encodes");
        for png in [png.into_inner(), super::bad_input::png(2, 2)] {
            let view = w.view(&png);
            let source = w.add("images", json!({ "bufferView": view }));
            w.add("textures", json!({ "source": source }));
        }
        w.add("extensionsUsed", "KHR_materials_pbrSpecularGlossiness".into());
        let beside = json!({ "baseColorTexture": { "index": 1 }, "metallicFactor": 1.0 });
        let extensions = json!({ "KHR_materials_pbrSpecularGlossiness": gloss });
        w.add("materials", json!({ "pbrMetallicRoughness": beside, "extensions": extensions }));
        let scene = load(w);
        assert_eq!(scene.warnings(), [""; 0]);
        scene.materials()[0].clone()
    };
    let plain = of(json!({
        "diffuseFactor": [1.0, 0.0, 0.5, 0.25], "specularFactor": [0.0, 0.5, 1.0], "glossinessFactor": 0.25,
    }));
    assert_eq!(plain.base_color.to_array(), [1.0, 0.0, 0.5, 0.25]);
    assert_eq!((plain.metallic, plain.roughness, plain.ior), (0.0, 0.75, 0.0));
    assert_eq!((plain.specular, plain.specular_color), (1.0, Vec3::new(0.0, 0.5, 1.0)));
    assert!(plain.base_color_texture.is_none() && plain.metallic_roughness_texture.is_none());

    let textured = of(json!({
        "glossinessFactor": 0.5, "specularGlossinessTexture": { "index": 0 },
        "diffuseTexture": { "index": 1 },
    }));
    let texel = |texture: &Option<crate::TextureRef>| {
        texture.as_ref().map(|texture| texture.image.texels[0])
    };
    assert_eq!(texel(&textured.base_color_texture), Some([10, 10, 10, 255]));
    assert_eq!(texel(&textured.specular_color_texture), Some([200, 100, 50, 102]));
    assert_eq!(texel(&textured.metallic_roughness_texture), Some([0, 204, 0, 255]));
    assert_eq!(textured.roughness, 1.0);
    // Where alpha is 1 everywhere, no texture is needed.
    let even = of(json!({ "specularGlossinessTexture": { "index": 1 } }));
    assert!(even.metallic_roughness_texture.is_none() && even.roughness == 0.0);
}
