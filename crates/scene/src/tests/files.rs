//! Files around a scene: buffers, pictures and settings. None outside its folder is read.

use glam::{UVec3, Vec3};
use lumencast_light::Order;
use serde_json::{Value, json};

use super::{Folder, TRIANGLE, triangle};
use crate::{Edit, Environment, FileContents, InstanceSource, LightmapSpec, Scene, Transform};

/// A .gltf whose buffer is at a URI.
fn gltf(uri: &str) -> String {
    json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": uri }],
    })
    .to_string()
}

fn triangle_bytes() -> Vec<u8> {
    TRIANGLE.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A Radiance picture of 4 × 2 texels with a common exponent, the first of which is (1, 2, 0.5).
fn hdr() -> Vec<u8> {
    let mut file = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".to_vec();
    file.extend([64, 128, 32, 130]);
    file.extend([0, 0, 0, 0].repeat(7));
    file
}

#[test]
fn a_gltf_with_its_files() {
    let folder = Folder::new("gltf");
    folder.write("the data/buffer.bin", triangle_bytes());
    let path = folder.write("My Scene.gltf", gltf("the%20data/buffer.bin"));
    let scene = Scene::load(&path).expect("the scene");
    assert_eq!((scene.name(), scene.root_file()), ("my-scene", "My Scene.gltf"));
    let names: Vec<_> = scene.files().into_iter().map(|f| f.name).collect();
    assert_eq!(names, ["My Scene.gltf", "the data/buffer.bin"]);
    let FileContents::Path(on_disk) = &scene.files()[1].contents else { panic!("not on disk") };
    assert_eq!(std::fs::read(on_disk).expect("readable"), triangle_bytes());
}

/// All these URIs lead to the same file, and clients get its one name.
#[test]
fn uris_as_programs_write_them() {
    let folder = Folder::new("uris");
    folder.write("data/café 50%.bin", triangle_bytes());
    for uri in [
        "data/caf%C3%A9%2050%25.bin",
        "data/café 50%.bin",
        "data\\caf%C3%A9%2050%25.bin",
        "data//café%2050%25.bin",
        ".\\data\\\\café 50%.bin",
        "data%5Ccaf%c3%a9 50%25.bin",
        "data/café 50%.bin\0\0",
    ] {
        let scene = Scene::load(&folder.write("scene.gltf", gltf(uri))).expect(uri);
        let names: Vec<_> = scene.files().into_iter().map(|f| f.name).collect();
        assert_eq!(names, ["scene.gltf", "data/café 50%.bin"], "{uri}");
    }
    let marked = [&b"\xEF\xBB\xBF"[..], gltf("data/café 50%.bin").as_bytes()].concat();
    Scene::load(&folder.write("marked.gltf", marked)).expect("a byte-order mark");
}

/// The name is at fault here, not where it leads.
#[test]
fn names_that_no_file_has() {
    let folder = Folder::new("names");
    for (uri, reason) in
        [("caf%E9.bin", "is not UTF-8 once decoded"), ("a%00b.bin", "holds a NUL character")]
    {
        let path = folder.write("scene.gltf", gltf(uri));
        let error = Scene::load(&path).expect_err(uri).to_string();
        assert!(error.contains(reason) && error.contains(uri), "{error}");
    }
}

/// The scene's own file may have any name.
#[cfg(unix)]
#[test]
fn a_scene_whose_name_is_not_utf8() {
    use std::os::unix::ffi::OsStrExt as _;
    let folder = Folder::new("latin");
    let path = folder.0.join(std::ffi::OsStr::from_bytes(b"caf\xE9.glb"));
    if std::fs::write(&path, triangle().finish(Value::Null)).is_err() {
        // Some file systems accept UTF-8 only.
        return;
    }
    let scene = Scene::load(&path).expect("the scene");
    assert_eq!((scene.name(), scene.root_file()), ("caf-", "caf\u{fffd}.glb"));
    let FileContents::Path(on_disk) = &scene.files()[0].contents else { panic!("not on disk") };
    assert!(on_disk.exists());
}

#[test]
fn only_files_in_the_scenes_folder_are_read() {
    let folder = Folder::new("escape");
    folder.write("secret.bin", triangle_bytes());
    let path = |uri: &str| folder.write("inner/scene.gltf", gltf(uri));
    #[cfg(unix)]
    {
        std::fs::create_dir_all(folder.0.join("inner")).expect("a folder");
        let (secret, link) = (folder.0.join("secret.bin"), folder.0.join("inner/link.bin"));
        std::os::unix::fs::symlink(secret, link).expect("a link");
        let error = Scene::load(&path("link.bin")).expect_err("a link outwards").to_string();
        assert!(error.contains("only files in the scene's own folder"), "{error}");
    }
    let absolute = folder.0.join("secret.bin").display().to_string();
    for uri in [
        "../secret.bin",
        "..%2fsecret.bin",
        "a/../../secret.bin",
        "..\\secret.bin",
        "a%5C..%5C..%5Csecret.bin",
        "//host/secret.bin",
        "C:\\secret.bin",
        &absolute,
        "http://a/b.bin",
    ] {
        let error = Scene::load(&path(uri)).expect_err(uri).to_string();
        assert!(error.contains("only files in the scene's own folder"), "{uri}: {error}");
    }
    let missing = Scene::load(&path("none.bin")).expect_err("a missing file").to_string();
    assert!(missing.contains("buffer") || missing.contains("none.bin"), "{missing}");
    assert!(missing.contains("put it beside the scene"), "{missing}");
}

#[test]
fn added_files_have_names_of_their_own_folder() {
    let folder = Folder::new("added");
    let path = folder.write("scene.glb", triangle().finish(Value::Null));
    folder.write("models/chair.gltf", gltf("chair.bin"));
    folder.write("models/chair.bin", triangle_bytes());
    let mut scene = Scene::load(&path).expect("the scene");
    let add = |file: &str| Edit::AddInstance {
        node: None,
        name: None,
        source: InstanceSource::File(file.into()),
        parent: None,
        transform: Transform::default(),
    };
    for file in ["../scene.glb", "/etc/passwd", "models/none.glb", "models/chair.bin"] {
        scene.apply(&add(file)).expect_err(file);
    }
    assert_eq!((scene.files().len(), scene.version()), (1, 0));
    scene.apply(&add("models/chair.gltf")).expect("added");
    let names: Vec<_> = scene.files().into_iter().map(|f| f.name).collect();
    assert_eq!(names, ["scene.glb", "models/chair.gltf", "models/chair.bin"]);
    assert_eq!(scene.snapshot().instances.len(), 2);
    assert!(Scene::builtin("cornell").expect("built in").apply(&add("scene.glb")).is_err());
}

#[test]
fn settings_in_extras_and_beside_the_scene() {
    let folder = Folder::new("settings");
    let extras = json!({ "lumencast": {
        "environment": { "type": "constant", "radiance": [1.0, 2.0, 3.0] },
        "volumes": [{ "center": [0, 0, 0], "size": [1, 2, 3], "resolution": [4, 5, 6], "order": 3 }],
        "lightmap": { "size": 512 },
    }});
    let path = folder.write("scene.glb", triangle().finish(extras));
    let scene = Scene::load(&path).expect("the scene");
    let volume = scene.volumes()[0];
    assert_eq!((volume.grid.resolution, volume.order), (UVec3::new(4, 5, 6), Order::L3));
    assert_eq!(*scene.environment(), Environment::Constant { radiance: Vec3::new(1., 2., 3.) });
    assert_eq!(scene.lightmap(), Some(LightmapSpec::Size(512)));
    assert_eq!(scene.pristine(0.0).lightmap(), scene.lightmap());
    assert!(scene.edits_since_load().is_empty(), "clients read the extras themselves");

    folder.write("light/sky.hdr", hdr());
    let toml = "[environment]\ntype = \"image\"\nuri = \"light/sky.hdr\"\nintensity = 2.0\n\
                [[volume]]\ncenter = [0.0, 1.0, 0.0]\nsize = [2.0, 2.0, 2.0]\nresolution = [8, 8, 8]\n";
    folder.write("scene.lumencast.toml", toml);
    let scene = Scene::load(&path).expect("the scene");
    assert_eq!(scene.volumes().len(), 1);
    assert_eq!(
        (scene.volumes()[0].grid.resolution, scene.volumes()[0].order),
        (UVec3::splat(8), Order::L2)
    );
    assert_eq!(scene.lightmap(), Some(LightmapSpec::Size(512)), "what the file says stays");
    let Environment::Image { image: Some(image), intensity, .. } = scene.environment() else {
        panic!("no picture: {:?}", scene.environment())
    };
    assert_eq!((image.width, image.height, *intensity), (4, 2, 2.0));
    assert_eq!((image.texels[0], image.texels[1]), (Vec3::new(1.0, 2.0, 0.5), Vec3::ZERO));
    assert!(scene.files().iter().any(|f| f.name == "light/sky.hdr"));
    let told = scene.edits_since_load();
    assert!(matches!(&told[..], [Edit::SetEnvironment { .. }]), "{told:?}");
}

#[test]
fn an_environment_from_openexr() {
    let folder = Folder::new("exr");
    let path = folder.write("scene.glb", triangle().finish(Value::Null));
    // One texel is brighter than half floats can hold, and one is invalid.
    let texels = image::Rgb32FImage::from_fn(4, 2, |x, y| match (x, y) {
        (0, 0) => image::Rgb([100_000.0, 2.0, 1e-3]),
        (1, 0) => image::Rgb([f32::NAN, -1.0, 0.5]),
        _ => image::Rgb([1.0; 3]),
    });
    let mut exr = std::io::Cursor::new(Vec::new());
    image::DynamicImage::from(texels)
        .write_to(&mut exr, image::ImageFormat::OpenExr)
        .expect("encodes");
    folder.write("sky.exr", exr.into_inner());
    folder.write("scene.lumencast.toml", "[environment]\ntype = \"image\"\nuri = \"sky.exr\"\n");
    let scene = Scene::load(&path).expect("the scene");
    let Environment::Image { image: Some(image), .. } = scene.environment() else {
        panic!("no picture: {:?}", scene.environment())
    };
    assert_eq!((image.width, image.height), (4, 2));
    assert_eq!(image.texels[0], Vec3::new(100_000.0, 2.0, 1e-3));
    assert_eq!(image.texels[1], Vec3::new(0.0, 0.0, 0.5));
    assert!(
        scene.warnings().iter().any(|w| w.contains("sky.exr: 1 texel")),
        "{:?}",
        scene.warnings()
    );
}

#[test]
fn textures_in_every_format() {
    let texel = |x: u32, y: u32| image::Rgba([200 - 8 * x as u8, 40 + 8 * y as u8, 90, 255]);
    let picture = image::RgbaImage::from_fn(16, 16, texel);
    // JPEG is lossy, so a smooth picture may differ by a few steps.
    for (format, kind, within) in [
        (image::ImageFormat::Png, "image/png", 0),
        (image::ImageFormat::WebP, "image/webp", 0),
        (image::ImageFormat::Jpeg, "image/jpeg", 12),
    ] {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let source = image::DynamicImage::from(picture.clone());
        let source = if within > 0 { source.to_rgb8().into() } else { source };
        source.write_to(&mut bytes, format).expect("encodes");
        let mut w = triangle();
        let view = w.view(bytes.get_ref());
        w.add("images", json!({ "bufferView": view, "mimeType": kind }));
        w.add(
            "textures",
            match format {
                image::ImageFormat::WebP => {
                    json!({ "extensions": { "EXT_texture_webp": { "source": 0 } } })
                }
                _ => json!({ "source": 0 }),
            },
        );
        let pbr = json!({ "baseColorTexture": { "index": 0 } });
        w.add("materials", json!({ "pbrMetallicRoughness": pbr }));
        let scene = Scene::from_glb("formats", w.finish(Value::Null)).expect(kind);
        let texture = scene.materials()[0].base_color_texture.as_ref().expect("a texture");
        assert_eq!((texture.image.width, texture.image.height), (16, 16));
        for (expected, read) in picture.pixels().zip(texture.image.texels.iter()) {
            let apart = expected.0.iter().zip(read).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(apart <= Some(within), "{kind}: {expected:?} {read:?}");
        }
    }
}

#[test]
fn senseless_settings_name_their_file() {
    let folder = Folder::new("odd-settings");
    let path = folder.write("scene.glb", triangle().finish(Value::Null));
    for (toml, reason) in [
        (
            "[[volume]]\ncenter = [0.0, 0.0, 0.0]\nsize = [0.0, 1.0, 1.0]\nresolution = [1, 1, 1]",
            "size",
        ),
        (
            "[[volume]]\ncenter = [0.0, 0.0, 0.0]\nsize = [1.0, 1.0, 1.0]\nresolution = [1, 1, 99999]",
            "give it fewer",
        ),
        ("[environment]\ntype = \"constant\"\nradiance = [nan, 0.0, 0.0]", "cd/m²"),
        ("[environment]\ntype = \"image\"\nuri = \"none.hdr\"", "none.hdr"),
        ("[environment]\ntype = \"image\"\nuri = \"scene.glb\"", ".hdr or .exr"),
        ("[environment", "TOML"),
        ("[lightmap]\nsize = 500", "a multiple of 16"),
        ("[lightmap]\nsize = 1048576", "64 to 4096"),
        ("[lightmap]\ntexel = 0.0", "more than 0"),
        ("[lightmap]\ncells = 4", "TOML"),
    ] {
        folder.write("scene.lumencast.toml", toml);
        let error = Scene::load(&path).expect_err(reason).to_string();
        assert!(error.contains("scene.lumencast.toml") && error.contains(reason), "{error}");
    }
}

#[test]
fn unknown_names_tell_what_there_is() {
    let error = Scene::open("no such scene").expect_err("no scene").to_string();
    assert!(error.contains("cornell, door, tomb"), "{error}");
    assert!(Scene::open("cornell").is_ok());
    assert!(Scene::load(&std::env::temp_dir()).is_err(), "a folder is no scene");
}
