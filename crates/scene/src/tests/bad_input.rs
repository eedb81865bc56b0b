//! Broken files, by accident or on purpose. Each gives an error that says what is wrong. None
//! causes a panic, or an allocation that its size does not warrant.

use serde_json::{Value, json};

use super::{TRIANGLE, fault, fault_of, load, triangle};
use crate::builtin::writer::{Writer, container};
use crate::{Fault, Scene};

/// A file with one of everything.
fn rich() -> Vec<u8> {
    let mut w = triangle();
    let positions = w.floats("VEC3", &TRIANGLE);
    let weights = w.floats("VEC4", &[1., 0., 0., 0.].repeat(3));
    let joints = w.view(&[0; 12]);
    let joints = w.add(
        "accessors",
        json!({ "bufferView": joints, "componentType": 5121, "type": "VEC4", "count": 3 }),
    );
    let matrices = w.floats("MAT4", &glam::Mat4::IDENTITY.to_cols_array());
    let attributes = json!({
        "POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights,
        "JOINTS_1": joints, "WEIGHTS_1": weights,
    });
    let primitive = json!({ "attributes": attributes, "targets": [{ "POSITION": positions }] });
    w.add("meshes", json!({ "primitives": [primitive] }));
    w.add("skins", json!({ "joints": [0], "inverseBindMatrices": matrices }));
    w.node(json!({ "mesh": 1, "skin": 0 }));
    w.animation("a", (1, "weights"), "LINEAR", &[0.0, 1.0], ("SCALAR", &[0.0, 1.0]));
    w.animation("b", (0, "rotation"), "CUBICSPLINE", &[0.0, 1.0], ("VEC4", &[0.5; 24]));
    let size = json!({ "lumencast": { "radius": 0.1 } });
    w.light(json!({ "type": "spot", "range": 3.0, "extras": size }), json!({ "name": "lamp" }));
    w.camera("camera", 1.0, json!({}));
    let image = w.view(&png(2, 2));
    w.add("images", json!({ "bufferView": image, "mimeType": "image/png" }));
    w.add("textures", json!({ "source": 0 }));
    let texture = json!({ "index": 0, "texCoord": 2 });
    w.add("materials", json!({ "pbrMetallicRoughness": { "baseColorTexture": texture } }));
    let turns = w.floats("VEC4", &[0.0, 0.0, 0.0, 1.0].repeat(3));
    let places = json!({ "TRANSLATION": positions, "ROTATION": turns, "SCALE": positions });
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": places } });
    w.node(json!({ "mesh": 0, "extensions": instancing }));
    w.node(json!({ "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": false } } }));
    w.finish(
        json!({ "lumencast": { "environment": { "type": "constant", "radiance": [1, 1, 1] } } }),
    )
}

/// A PNG that declares this size. It is complete for 2 × 2.
pub(super) fn png(width: u32, height: u32) -> Vec<u8> {
    // The data are two rows of a filter byte and two grey texels.
    stored_png(width, height, 8, &[0, 10, 20, 0, 30, 40])
}

/// A grey PNG of `depth` bits a texel whose rows are stored, not compressed.
fn stored_png(width: u32, height: u32, depth: u8, rows: &[u8]) -> Vec<u8> {
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut header = Vec::new();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([depth, 0, 0, 0, 0]);
    let mut data = vec![0x78, 1];
    let mut blocks = rows.chunks(0xffff).peekable();
    while let Some(block) = blocks.next() {
        let length = block.len() as u16;
        data.push(u8::from(blocks.peek().is_none()));
        data.extend(length.to_le_bytes());
        data.extend((!length).to_le_bytes());
        data.extend(block);
    }
    let (a, b) = rows.iter().fold((1u32, 0u32), |(a, b), byte| {
        let a = (a + u32::from(*byte)) % 65_521;
        (a, (b + a) % 65_521)
    });
    data.extend((b << 16 | a).to_be_bytes());
    for (kind, body) in [(b"IHDR", header), (b"IDAT", data), (b"IEND", Vec::new())] {
        png.extend((body.len() as u32).to_be_bytes());
        let checked = [&kind[..], &body].concat();
        png.extend(&checked);
        png.extend(crc(&checked).to_be_bytes());
    }
    png
}

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(
            crc ^ u32::from(*byte),
            |c, _| if c & 1 == 1 { c >> 1 ^ 0xEDB8_8320 } else { c >> 1 },
        )
    })
}

/// Loads a file and, where that succeeds, uses the scene.
fn exercise(glb: Vec<u8>) {
    if let Ok(mut scene) = Scene::from_glb("test", glb) {
        scene.snapshot();
        scene.advance(0.4);
        let snapshot = scene.snapshot();
        let sound = |p: &crate::Primitive| {
            let n = p.vertices.positions.len();
            p.triangles.iter().flatten().all(|i| (*i as usize) < n)
                && p.vertices.normals.len() == n
                && p.vertices.positions.iter().all(|p| p.is_finite())
        };
        assert!(snapshot.instances.iter().flat_map(|i| &i.mesh.primitives).all(sound));
        scene.edits_since_load();
    }
}

#[test]
fn the_sound_file_loads() {
    let scene = Scene::from_glb("test", rich()).expect("a sound file");
    assert_eq!(scene.warnings(), [""; 0]);
    let texture = scene.materials()[0].base_color_texture.as_ref().expect("a texture");
    assert_eq!(texture.image.texels[3], [40, 40, 40, 255]);
}

#[test]
fn cut_off_anywhere_it_is_refused() {
    let whole = rich();
    for length in (0..whole.len()).step_by(3) {
        let error = Scene::from_glb("test", whole[..length].to_vec()).expect_err("cut off");
        assert!(!error.to_string().is_empty());
    }
}

#[test]
fn damaged_anywhere_it_does_no_harm() {
    let whole = rich();
    let mut state = 1u64;
    let mut random = |n: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 33) as usize % n
    };
    for round in 0..6000 {
        let mut damaged = whole.clone();
        for _ in 0..=round % 4 {
            let at = random(damaged.len());
            // Digits are replaced by digits, so that the JSON often stays valid.
            damaged[at] = match damaged[at] {
                b'0'..=b'9' => b'0' + random(10) as u8,
                _ => random(256) as u8,
            };
        }
        exercise(damaged);
    }
}

/// Replaces every number of the JSON by other values, one at a time.
#[test]
fn any_number_may_be_absurd() {
    let whole = rich();
    let json_length = u32::from_le_bytes([whole[12], whole[13], whole[14], whole[15]]) as usize;
    let text = std::str::from_utf8(&whole[20..20 + json_length]).expect("JSON").to_owned();
    let binary = &whole[20 + json_length + 8..];
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        if !bytes[at].is_ascii_digit()
            || bytes[at - 1] == b'.'
            || bytes[at - 1].is_ascii_alphanumeric()
        {
            at += 1;
            continue;
        }
        let end = at + bytes[at..].iter().take_while(|b| b".0123456789eE-".contains(b)).count();
        for absurd in ["-1", "7", "4294967295", "18446744073709551615", "1e38", "1e300"] {
            exercise(container(&format!("{}{absurd}{}", &text[..at], &text[end..]), binary));
        }
        at = end;
    }
}

#[test]
fn huge_counts_are_refused_before_memory_is_asked_for() {
    for (accessor, reason) in [
        (json!({ "bufferView": 0, "count": 1u64 << 60 }), "more vertices"),
        (json!({ "bufferView": 0, "count": 4 }), "do not fit into bufferView 0"),
        (json!({ "count": 4_000_000_000u64 }), "exceed the limit"),
        (json!({ "bufferView": 0, "byteOffset": u64::MAX, "count": 1 }), "do not fit"),
        (json!({ "bufferView": 9, "count": 1 }), "bufferView 9"),
    ] {
        let mut w = triangle();
        let mut accessor = accessor;
        accessor["componentType"] = 5126.into();
        accessor["type"] = "VEC3".into();
        let index = w.add("accessors", accessor);
        let primitive = json!({ "attributes": { "POSITION": index } });
        w.add("meshes", json!({ "name": "huge", "primitives": [primitive] }));
        let fault = fault(w);
        assert!(
            fault.contains("mesh 1 \"huge\", primitive 0") && fault.contains(reason),
            "{fault}"
        );
    }
}

/// Many primitives may name the same buffer, and all their triangles count.
#[test]
fn triangles_named_again_and_again_are_counted() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE.repeat(20_000));
    let indices: Vec<[u32; 3]> = (0..40_000).map(|i| [i, i + 1, i + 2]).collect();
    let indices = w.indices(&indices);
    let primitive = json!({ "attributes": { "POSITION": positions }, "indices": indices });
    let primitives = vec![primitive; 100_000];
    w.add("meshes", json!({ "primitives": primitives }));
    w.node(json!({ "mesh": 0 }));
    let fault = fault(w);
    assert!(fault.contains("exceed the limit"), "{fault}");
}

/// A file with a bad number in an attribute of a triangle, in a mesh of its own.
pub(super) fn bent(attribute: &str, bad: f32) -> Vec<u8> {
    let mut w = triangle();
    let (kind, mut numbers) = match attribute {
        "TEXCOORD_0" | "TEXCOORD_1" => ("VEC2", vec![0.5; 6]),
        "COLOR_0" => ("VEC3", vec![0.5; 9]),
        "WEIGHTS_0" => ("VEC4", vec![0.5; 12]),
        "NORMAL" => ("VEC3", [0.0, 0.0, 1.0].repeat(3)),
        "TANGENT" => ("VEC4", [1.0, 0.0, 0.0, 1.0].repeat(3)),
        _ => ("VEC3", TRIANGLE.to_vec()),
    };
    numbers[4] = bad;
    let mut attributes = json!({ "POSITION": 0, "NORMAL": w.vectors(&[glam::Vec3::Z; 3]) });
    if attribute == "WEIGHTS_0" {
        let view = w.view(&[0; 12]);
        let joints =
            json!({ "bufferView": view, "componentType": 5121, "type": "VEC4", "count": 3 });
        attributes["JOINTS_0"] = w.add("accessors", joints).into();
    }
    attributes[attribute] = w.floats(kind, &numbers).into();
    w.add("meshes", json!({ "name": "bent", "primitives": [{ "attributes": attributes }] }));
    // JSON has no NaN, so the accessor's bounds are removed.
    without_bounds(w)
}

#[test]
fn triangles_without_a_place_are_refused_by_mesh() {
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let fault = fault_of(bent("POSITION", bad));
        let said = fault.contains("mesh 1 \"bent\", primitive 0") && fault.contains("not finite");
        assert!(said, "{fault}");
    }
    let mut w = triangle();
    let target = w.floats("VEC3", &[0., 0., 0., 1., f32::NAN, 0., 0., 1., 0.]);
    let primitive = json!({ "attributes": { "POSITION": 0 }, "targets": [{ "POSITION": target }] });
    w.add("meshes", json!({ "name": "bent", "primitives": [primitive] }));
    let fault = fault_of(without_bounds(w));
    assert!(fault.contains("\"bent\", primitive 0: morph target 0: POSITION"), "{fault}");
}

pub(super) fn without_bounds(w: Writer) -> Vec<u8> {
    let glb = w.finish(Value::Null);
    let json_length = u32::from_le_bytes([glb[12], glb[13], glb[14], glb[15]]) as usize;
    let mut json: Value = serde_json::from_slice(&glb[20..20 + json_length]).expect("JSON");
    for accessor in json["accessors"].as_array_mut().expect("accessors") {
        accessor.as_object_mut().expect("an object").retain(|key, _| key != "min" && key != "max");
    }
    container(&json.to_string(), &glb[20 + json_length + 8..])
}

#[test]
fn indices_past_the_vertices_are_refused() {
    let mut w = triangle();
    let positions = w.floats("VEC3", &TRIANGLE);
    let indices = w.indices(&[[0, 1, 3]]);
    let primitive = json!({ "attributes": { "POSITION": positions }, "indices": indices });
    w.add("meshes", json!({ "primitives": [primitive] }));
    assert!(fault(w).contains("index 3 of 3 vertices does not exist"));
}

#[test]
fn trees_that_are_none_are_refused() {
    for (children, reason) in [
        (vec![json!([1]), json!([2]), json!([1])], "node 1 is a child of node"),
        (vec![json!([1]), json!([]), json!([2])], "circle"),
        (vec![json!([1]), json!([]), json!([3]), json!([2])], "circle"),
        (vec![json!([1]), json!([0])], "circle"),
        (vec![json!([99])], "child node 99"),
    ] {
        let mut w = triangle();
        for children in children {
            w.node(json!({ "children": children.as_array().map(|c| {
                c.iter().map(|i| i.as_u64().unwrap_or(0) + 1).collect::<Vec<_>>()
            }) }));
        }
        let fault = fault_of(w.finish_as(json!({ "nodes": [0] })));
        let reason = reason.replace("node 1", "node 2").replace("99", "100");
        assert!(fault.contains(&reason), "{fault:?} without {reason:?}");
    }
}

#[test]
fn image_bombs_are_refused() {
    for (width, height, reasons) in [
        (60_000, 60_000, &["60000 × 60000", "16384 × 16384", "scale it down"][..]),
        (16_385, 1, &["16385 × 1 ", "scale it down"]),
        (0, 2, &["decoded"]),
    ] {
        let mut w = triangle();
        show_image(&mut w, &png(width, height));
        let fault = fault(w);
        assert!(fault.contains("\"wall\""), "{fault}");
        assert!(reasons.iter().all(|reason| fault.contains(reason)), "{fault}");
    }
    // Each image is within bounds, but together they are too many.
    let mut w = triangle();
    for _ in 0..3 {
        show_image(&mut w, &png(16_000, 16_000));
    }
    let fault = fault(w);
    assert!(fault.contains("exceed the limit") || fault.contains("decoded"), "{fault}");
}

/// A material that shows an image named "wall".
fn show_image(w: &mut Writer, png: &[u8]) {
    let view = w.view(png);
    let image = w.add("images", json!({ "name": "wall", "bufferView": view }));
    let texture = w.add("textures", json!({ "source": image }));
    w.add("materials", json!({ "emissiveTexture": { "index": texture } }));
}

#[test]
fn the_smallest_and_the_largest_image_load() {
    for side in [1u32, 16_384] {
        // A texel is one bit; all are white except the last.
        let row = [&[0][..], &vec![0xff; side.div_ceil(8) as usize]].concat();
        let mut rows = row.repeat(side as usize);
        *rows.last_mut().expect("a row") = 0xfe << ((8 - side % 8) % 8);
        let mut w = triangle();
        show_image(&mut w, &stored_png(side, side, 1, &rows));
        let scene = load(w);
        let texture = scene.materials()[0].emissive_texture.as_ref().expect("a texture");
        let image = &texture.image;
        assert_eq!((image.width, image.height), (side, side));
        assert_eq!(image.texels.len(), side as usize * side as usize);
        assert_eq!(image.texels.last(), Some(&[0, 0, 0, 255]));
        assert!(side == 1 || image.texels[0] == [255; 4]);
    }
}

/// A million nodes that show one mesh are allowed; one more is not.
#[test]
fn a_million_nodes() {
    const MILLION: usize = 1_000_000;
    let file = |count: usize| {
        let glb = triangle().finish(Value::Null);
        let json_length = u32::from_le_bytes([glb[12], glb[13], glb[14], glb[15]]) as usize;
        let mut json: Value = serde_json::from_slice(&glb[20..20 + json_length]).expect("JSON");
        let nodes: Vec<_> =
            (0..count).map(|i| format!(r#"{{"mesh":0,"translation":[{i},0,0]}}"#)).collect();
        json["nodes"] = "NODES".into();
        json["scenes"][0]["nodes"] = (0..count).collect::<Vec<_>>().into();
        let text = json.to_string().replace("\"NODES\"", &format!("[{}]", nodes.join(",")));
        container(&text, &glb[20 + json_length + 8..])
    };
    let mut scene = Scene::from_glb("test", file(MILLION)).expect("within the limits");
    let snapshot = scene.snapshot();
    assert_eq!(snapshot.instances.len(), MILLION);
    let mesh = &snapshot.instances[0].mesh;
    assert!(snapshot.instances.iter().all(|i| std::sync::Arc::ptr_eq(&i.mesh, mesh)));
    let fault = fault_of(file(MILLION + 1));
    assert!(fault.contains("nodes exceed the limit of 1000000"), "{fault}");
}

#[test]
fn missing_pictures_are_named() {
    let mut w = triangle();
    w.add("images", json!({ "uri": "wall.png" }));
    w.add("textures", json!({ "source": 0 }));
    w.add("materials", json!({ "emissiveTexture": { "index": 0 } }));
    let folder = super::Folder::new("missing");
    let path = folder.write("scene.glb", w.finish(Value::Null));
    let error = Scene::load(&path).expect_err("a missing picture").to_string();
    assert!(error.contains("\"wall.png\"") && error.contains("scene.glb"), "{error}");
}

#[test]
fn unknown_required_extensions_are_named() {
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_texture_basisu"] {
        let mut w = triangle();
        w.add("extensionsRequired", name.into());
        let glb = w.finish(Value::Null);
        let error = Scene::from_glb("test", glb).expect_err("an unknown extension");
        assert!(matches!(&error.fault, Fault::UnknownExtension(unknown) if unknown == name));
        assert!(error.to_string().contains(&format!("unknown required extension {name}")));
    }
    let mut w = triangle();
    w.add("extensionsUsed", "KHR_materials_iridescence".into());
    let scene = super::load(w);
    assert!(scene.warnings()[0].contains("KHR_materials_iridescence"));
}

#[test]
fn scenes_without_triangles_or_light() {
    let mut w = Writer::default();
    w.node(json!({ "name": "empty" }));
    assert!(fault(w).contains("has no triangles"));
    // A mesh that no node of the scene shows does not count.
    let glb = triangle().finish_as(json!({ "nodes": [] }));
    assert!(fault_of(glb).contains("has no triangles"));
    assert!(load(triangle()).is_dark());
}

#[test]
fn what_is_no_gltf_is_refused() {
    for (bytes, reason) in [
        (&b""[..], "not valid glTF"),
        (b"hello", "not valid glTF"),
        (b"{}", "version"),
        (b"glTF\x01\0\0\0\x0c\0\0\0", "version 1"),
        (b"glTF\x02\0\0\0\xff\xff\xff\xff", "cut off"),
        (b"glTF\x02\0\0\0\x0c\0\0\0", "no JSON chunk"),
        (b"{\"asset\":{\"version\":\"1.0\"}}", "version"),
        (b"[[[[[[[[", "not valid glTF"),
    ] {
        let fault = fault_of(bytes.to_vec());
        assert!(fault.contains(reason), "{fault:?} without {reason:?}");
    }
    let deep = format!("{}{}", "{\"extras\":".repeat(100_000), "}".repeat(100_000));
    assert!(fault_of(deep.into_bytes()).contains("not valid glTF"));
}

#[test]
fn lights_and_cameras_out_of_range_are_refused() {
    for (light, reason) in [
        (json!({ "type": "point", "intensity": -1.0 }), "light 0: its intensity"),
        (json!({ "type": "point", "color": [0.0, -1.0, 0.0] }), "light 0: its colour"),
        (
            json!({ "type": "point", "color": [0.0, 1e7, 0.0], "intensity": 1e7 }),
            "light 0: its colour",
        ),
        (json!({ "type": "spot", "spot": { "outerConeAngle": 3.0 } }), "light 0: its cones"),
        (json!({ "type": "area" }), "light 0: unknown type"),
        (
            json!({ "type": "point", "extras": { "lumencast": { "radius": -1.0 } } }),
            "light 0: its radius is -1",
        ),
        (
            json!({ "type": "point", "extras": { "lumencast": { "angle": 0.1 } } }),
            "light 0: only directional lights have an angle",
        ),
        (
            json!({ "type": "directional", "extras": { "lumencast": { "radius": 0.1 } } }),
            "light 0: only point and spot lights have a radius",
        ),
        (
            json!({ "type": "directional", "extras": { "lumencast": { "angle": "wide" } } }),
            "light 0: extras.lumencast: invalid type",
        ),
    ] {
        let mut w = triangle();
        w.light(light, json!({}));
        let fault = fault(w);
        assert!(fault.contains(reason), "{fault:?} without {reason:?}");
    }
    let mut w = triangle();
    w.camera("wide", 4.0, json!({}));
    assert!(fault(w).contains("camera 0 \"wide\""));
}
