//! Triangles, accessors and materials.

use glam::{Vec2, Vec3, Vec4};
use serde_json::{Value, json};

use super::{TRIANGLE, fault, load, triangle};
use crate::builtin::writer::Writer;
use crate::{AlphaMode, Filter, Primitive, Wrap};

/// The primitive of a file that has one.
fn primitive(w: Writer) -> Primitive {
    load(w).meshes()[0].primitives[0].clone()
}

/// Adds a mesh of one primitive, and a node that shows it.
fn show(w: &mut Writer, primitive: Value) {
    w.add("meshes", json!({ "name": "shape", "primitives": [primitive] }));
    w.node(json!({ "mesh": 0 }));
}

/// Five points of a zigzag: (0,0) (0,1) (1,0) (1,1) (2,0), z = 0.
fn zigzag(w: &mut Writer) -> usize {
    let points: Vec<Vec3> =
        (0..5).map(|i| Vec3::new((i / 2) as f32, (i % 2) as f32, 0.0)).collect();
    w.vectors(&points)
}

fn facing(primitive: &Primitive) -> Vec<f32> {
    let p = &primitive.vertices.positions;
    let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).z.signum();
    primitive.triangles.iter().map(|t| normal(t.map(|i| p[i as usize]))).collect()
}

#[test]
fn strips_face_one_way() {
    let mut w = Writer::default();
    let positions = zigzag(&mut w);
    show(&mut w, json!({ "mode": 5, "attributes": { "POSITION": positions } }));
    let strip = primitive(w);
    assert_eq!(facing(&strip), [-1.0; 3]);
    assert!(strip.vertices.normals.iter().all(|n| *n == Vec3::NEG_Z), "flat normals");
}

#[test]
fn fans_share_their_first_vertex() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    let normals = w.vectors(&[Vec3::Z; 4]);
    let attributes = json!({ "POSITION": positions, "NORMAL": normals });
    show(&mut w, json!({ "mode": 6, "attributes": attributes }));
    let fan = primitive(w);
    assert_eq!(fan.triangles, [[1, 2, 0], [2, 3, 0]]);
    assert_eq!(facing(&fan), [1.0; 2]);
}

#[test]
fn points_and_lines_are_left_out_with_a_warning() {
    let mut w = triangle();
    let positions = w.floats("VEC3", &TRIANGLE);
    let points = json!({ "mode": 0, "attributes": { "POSITION": positions } });
    w.add("meshes", json!({ "primitives": [points] }));
    w.node(json!({ "mesh": 1 }));
    let mut scene = load(w);
    assert!(scene.warnings()[0].contains("mesh 1, primitive 0: points and lines"));
    assert_eq!(scene.snapshot().instances.len(), 1);
}

/// What charts name by number: the file's triangles and vertices, also where some are of no use.
#[test]
fn triangles_and_primitives_keep_their_numbers() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 2., 0., 0.]);
    let normals = w.vectors(&[Vec3::Z; 4]);
    let triangles = [[0, 1, 1], [0, 1, 3], [3, 1, 2]];
    let indices = w.indices(&triangles);
    let points = json!({ "mode": 0, "attributes": { "POSITION": positions } });
    let smooth = json!({ "POSITION": positions, "NORMAL": normals });
    let primitives = json!([
        points,
        { "indices": indices, "attributes": smooth },
        { "indices": indices, "attributes": { "POSITION": positions } },
    ]);
    w.add("meshes", json!({ "primitives": primitives }));
    w.node(json!({ "mesh": 0 }));
    let scene = load(w);
    let [points, smooth, flat] = &scene.meshes()[0].primitives[..] else {
        panic!("other primitives")
    };
    assert!(points.triangles.is_empty());
    assert_eq!(smooth.triangles, triangles);
    assert_eq!(flat.triangles, [[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
    for primitive in [smooth, flat] {
        let sources = primitive.triangles.iter().map(|t| t.map(|v| primitive.source(v)));
        assert!(sources.eq(triangles));
        assert!(primitive.vertices.normals.iter().all(|normal| normal.is_normalized()));
    }
}

#[test]
fn sparse_accessors_replace_elements() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE);
    let (indices, values) = (w.view(&[2, 0]), w.view(&7f32.to_le_bytes().repeat(3)));
    let mut sparse = |view: Option<usize>| {
        let mut accessor = json!({
            "componentType": 5126, "type": "VEC3", "count": 3,
            "sparse": {
                "count": 1, "indices": { "bufferView": indices, "componentType": 5123 },
                "values": { "bufferView": values },
            },
        });
        if let Some(view) = view {
            accessor["bufferView"] = view.into();
        }
        w.add("accessors", accessor)
    };
    // One accessor is sparse over a buffer. The other is sparse over zeros, for displacements.
    let (over_buffer, over_zeros) = (sparse(Some(0)), sparse(None));
    assert_eq!(positions, 0);
    let primitive_json = json!({
        "attributes": { "POSITION": over_buffer, "NORMAL": positions },
        "targets": [{ "POSITION": over_zeros }],
    });
    show(&mut w, primitive_json);
    let p = primitive(w);
    assert_eq!(p.vertices.positions, [Vec3::ZERO, Vec3::X, Vec3::splat(7.0)]);
    assert_eq!(p.morph_targets[0].positions, [Vec3::ZERO, Vec3::ZERO, Vec3::splat(7.0)]);
}

#[test]
fn quantised_and_interleaved_attributes() {
    let mut w = Writer::default();
    // Each vertex has 12 bytes: an i16 position padded to 8 bytes, then normalised u16 texture
    // coordinates.
    let mut bytes = Vec::new();
    for ([x, y], [u, v]) in
        [([0i16, 0], [0u16, 0]), ([-3, 0], [65_535, 0]), ([0, -200], [0, 32_767])]
    {
        [x, y, 5, 0].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
        [u, v].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
    }
    let view = w.view(&bytes);
    // The writer's views have no stride; this view has one.
    let strided = json!({ "buffer": 0, "byteOffset": 0, "byteLength": 36, "byteStride": 12 });
    assert_eq!((view, w.add("bufferViews", strided)), (0, 1));
    let position = w.add(
        "accessors",
        json!({ "bufferView": 1, "componentType": 5122, "type": "VEC3", "count": 3 }),
    );
    let uv = w.add(
        "accessors",
        json!({ "bufferView": 1, "byteOffset": 8, "componentType": 5123, "normalized": true,
                "type": "VEC2", "count": 3 }),
    );
    w.add("extensionsRequired", json!("KHR_mesh_quantization"));
    show(&mut w, json!({ "attributes": { "POSITION": position, "TEXCOORD_0": uv } }));
    let p = primitive(w);
    assert_eq!(
        p.vertices.positions,
        [Vec3::new(0., 0., 5.), Vec3::new(-3., 0., 5.), Vec3::new(0., -200., 5.)]
    );
    let close = |a: Vec2, b: Vec2| (a - b).length() < 1e-4;
    assert!(close(p.uv[0][1], Vec2::X) && close(p.uv[0][2], Vec2::new(0.0, 0.5)), "{:?}", p.uv[0]);
}

#[test]
fn normals_are_made_sound() {
    let mut w = Writer::default();
    let positions = w.floats("VEC3", &TRIANGLE);
    let normals = w.vectors(&[Vec3::new(0.0, 3.0, 4.0), Vec3::ZERO, Vec3::Z]);
    show(&mut w, json!({ "attributes": { "POSITION": positions, "NORMAL": normals } }));
    assert_eq!(primitive(w).vertices.normals, [Vec3::new(0.0, 0.6, 0.8), Vec3::Z, Vec3::Z]);
}

/// A PNG of one texel as a data URI.
const TEXEL: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==";

/// Two adjacent quads with a normal map share an edge. The texture of the second one is mirrored in
/// u.
#[test]
fn tangents_follow_the_texture_and_its_mirroring() {
    let mut w = Writer::default();
    let points = [[0., 0.], [1., 0.], [2., 0.], [0., 1.], [1., 1.], [2., 1.]];
    let positions: Vec<Vec3> = points.iter().map(|[x, y]| Vec3::new(*x, *y, 0.0)).collect();
    // u grows towards the middle and shrinks beyond it; v grows downwards.
    let uv: Vec<f32> =
        points.iter().flat_map(|[x, y]: &[f32; 2]| [1.0 - (x - 1.0).abs(), 1.0 - y]).collect();
    let attributes = json!({
        "POSITION": w.vectors(&positions), "NORMAL": w.vectors(&[Vec3::Z; 6]),
        "TEXCOORD_0": w.floats("VEC2", &uv),
    });
    let triangles = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]];
    let indices = w.indices(&triangles);
    w.add("images", json!({ "uri": TEXEL }));
    w.add("textures", json!({ "source": 0 }));
    w.add("materials", json!({ "normalTexture": { "index": 0 } }));
    show(&mut w, json!({ "attributes": attributes, "indices": indices, "material": 0 }));
    let p = primitive(w);
    assert_eq!(p.vertices.positions.len(), 8, "the shared edge is split");
    let sources = p.triangles.iter().map(|triangle| triangle.map(|vertex| p.source(vertex)));
    assert!(sources.eq(triangles), "by the file's numbers");
    let corner_tangents = |t: usize| p.triangles[t].map(|i| p.vertices.tangents[i as usize]);
    for (triangle, tangent) in [(0, Vec4::new(1., 0., 0., 1.)), (3, Vec4::new(-1., 0., 0., -1.))] {
        for t in corner_tangents(triangle) {
            assert!((t - tangent).length() < 1e-5, "triangle {triangle}: {t}");
            // The bitangent points up the image, which is also up the shape.
            let bitangent = Vec3::Z.cross(t.truncate()) * t.w;
            assert!((bitangent - Vec3::Y).length() < 1e-5, "{bitangent}");
        }
    }
}

/// Primitives that share vertices have their own tangents where their normal maps are placed
/// differently.
#[test]
fn tangents_are_of_a_primitive_and_its_normal_map() {
    let mut w = Writer::default();
    let uv: Vec<f32> = vec![0.0, 1.0, 1.0, 1.0, 0.0, 0.0];
    let attributes = json!({
        "POSITION": w.floats("VEC3", &TRIANGLE), "NORMAL": w.vectors(&[Vec3::Z; 3]),
        "TEXCOORD_0": w.floats("VEC2", &uv),
    });
    w.add("images", json!({ "uri": TEXEL }));
    w.add("textures", json!({ "source": 0 }));
    let half_pi = std::f32::consts::FRAC_PI_2;
    let transforms = [
        json!({}),
        // This image is rotated clockwise, so its u runs down the shape.
        json!({ "rotation": half_pi }),
        json!({ "scale": [-2.0, 2.0] }),
        json!({ "scale": [2.0, -2.0], "rotation": half_pi, "offset": [1e6, 3.0] }),
    ];
    let mut primitives = Vec::new();
    for transform in transforms {
        let extensions = json!({ "KHR_texture_transform": transform });
        let map = json!({ "index": 0, "extensions": extensions });
        let material = w.add("materials", json!({ "normalTexture": map }));
        primitives.push(json!({ "attributes": attributes, "material": material }));
    }
    w.add("meshes", json!({ "primitives": primitives }));
    w.node(json!({ "mesh": 0 }));
    let scene = load(w);
    let tangents = scene.meshes()[0].primitives.iter().map(|p| p.vertices.tangents.clone());
    let expected = [[1., 0., 1.], [0., -1., 1.], [-1., 0., -1.], [0., 1., -1.]];
    for (found, [x, y, w]) in tangents.zip(expected) {
        let expected = Vec4::new(x, y, 0.0, w);
        assert!(found.iter().all(|t| t.distance(expected) < 1e-5), "{found:?}, not {expected}");
    }
}

#[test]
fn materials_with_their_extensions() {
    let mut w = triangle();
    w.add("images", json!({ "uri": TEXEL }));
    w.add("samplers", json!({ "magFilter": 9728, "wrapS": 33071, "wrapT": 33648 }));
    w.add("textures", json!({ "source": 0, "sampler": 0 }));
    let transform =
        json!({ "offset": [0.25, 0.5], "rotation": 0.5, "scale": [2.0, 3.0], "texCoord": 1 });
    w.add(
        "materials",
        json!({
            "name": "glow",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.6,
                "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": transform } },
            },
            "occlusionTexture": {
                "index": 0, "strength": 0.9, "extensions": { "KHR_texture_transform": transform },
            },
            "emissiveFactor": [1.0, 0.5, 0.0], "alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": true,
            "extensions": {
                "KHR_materials_emissive_strength": { "emissiveStrength": 100000.0 },
                "KHR_materials_ior": { "ior": 1.33 }, "KHR_materials_unlit": {},
                "KHR_materials_transmission": { "transmissionFactor": 0.7 },
                "KHR_materials_specular": { "specularFactor": 0.8, "specularColorFactor": [1.0, 0.9, 2.0] },
            },
        }),
    );
    let scene = load(w);
    let m = &scene.materials()[0];
    assert_eq!(scene.materials().len(), 2, "the default material has a number of its own");
    assert_eq!(scene.meshes()[0].primitives[0].material.0, 1);
    assert_eq!(m.base_color, Vec4::new(0.1, 0.2, 0.3, 0.4));
    assert_eq!((m.metallic, m.roughness, m.ior, m.transmission), (0.5, 0.6, 1.33, 0.7));
    assert_eq!(m.emissive, Vec3::new(1e5, 5e4, 0.0));
    assert_eq!(m.alpha_mode, AlphaMode::Mask(0.3));
    assert_eq!((m.specular, m.specular_color), (0.8, Vec3::new(1.0, 0.9, 2.0)));
    assert!(m.double_sided && m.unlit);
    let texture = m.base_color_texture.as_ref().expect("a texture");
    assert_eq!((texture.tex_coord, texture.filter), (1, Filter::Nearest));
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(texture.image.texels.len(), 1);
    // KHR_texture_transform is offset + rotation · (scale · uv), counter-clockwise with v down.
    let (sin, cos) = 0.5f32.sin_cos();
    let (u, v) = (2.0 * 0.3, 3.0 * 0.7);
    let want = Vec2::new(0.25 + cos * u + sin * v, 0.5 - sin * u + cos * v);
    let got = texture.texture_from_mesh.transform_point2(Vec2::new(0.3, 0.7));
    assert!((got - want).length() < 1e-6, "{got} {want}");
    let occlusion = m.occlusion_texture.as_ref().expect("a texture");
    assert_eq!((m.occlusion_strength, occlusion.tex_coord), (0.9, 1));
    assert_eq!(occlusion.texture_from_mesh, texture.texture_from_mesh);
}

#[test]
fn the_strength_of_occlusion_is_a_share() {
    let texture = json!({ "index": 0 });
    let with = |strength: f32| json!({ "index": 0, "strength": strength });
    for (texture, strength) in [(texture, 1.0), (with(1.5), 1.0), (with(-0.5), 0.0)] {
        let mut w = triangle();
        w.add("images", json!({ "uri": TEXEL }));
        w.add("textures", json!({ "source": 0 }));
        w.add("materials", json!({ "occlusionTexture": texture }));
        let scene = load(w);
        let m = &scene.materials()[0];
        assert!(m.occlusion_texture.is_some());
        assert_eq!(m.occlusion_strength, strength);
    }
}

#[test]
fn senseless_materials_are_refused_by_name() {
    for (material, reason) in [
        (json!({ "emissiveFactor": [-1.0, 0.0, 0.0] }), "emission"),
        (json!({ "emissiveFactor": [1e13, 0.0, 0.0] }), "emission"),
        (json!({ "alphaMode": "GLASS" }), "GLASS"),
        (json!({ "extensions": { "KHR_materials_ior": { "ior": 0.5 } } }), "refraction"),
        (json!({ "emissiveTexture": { "index": 3 } }), "texture 3"),
        (json!({ "occlusionTexture": { "index": 4 } }), "texture 4"),
    ] {
        let mut w = triangle();
        let mut material = material;
        material["name"] = "odd".into();
        w.add("materials", material);
        let fault = fault(w);
        assert!(fault.contains("material 0 \"odd\"") && fault.contains(reason), "{fault}");
    }
}
