//! Files that people have: what is said of them, and what is shown and served.

mod common;

use common::{Folder, Program, Ran, Serving, run};
use serde_json::{Value, json};

const LEFT_OUT: &str = "KHR_materials_iridescence";
const SKY: &str = "--environment sky:1000";

/// A grey triangle that nothing lights, of a material that is not read whole.
fn dark(folder: &Folder) -> String {
    scene(folder, |scene| {
        scene["extensionsUsed"] = json!([LEFT_OUT]);
        scene["materials"] = json!([{ "extensions": { LEFT_OUT: {} } }]);
        scene["meshes"][0]["primitives"][0]["material"] = 0.into();
    })
}

/// A triangle in two scenes of a file, as changed.
fn scene(folder: &Folder, change: impl FnOnce(&mut Value)) -> String {
    let corners = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
    let bytes: Vec<u8> = corners.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
    std::fs::create_dir_all(folder.0.join("the data")).expect("a folder");
    folder.file("the data/café 50%.bin", &bytes);
    let mut scene = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "uri": "the data\\caf%C3%A9%2050%25.bin", "byteLength": bytes.len() }],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
        "accessors": [{
            "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": corners.len(),
        }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "nodes": [{ "mesh": 0 }],
        "scenes": [{ "nodes": [0] }],
    });
    change(&mut scene);
    folder.file("scene.gltf", scene.to_string().as_bytes())
}

#[track_caller]
fn times(ran: &Ran, word: &str) -> usize {
    ran.stdout.matches(word).count() + ran.stderr.matches(word).count()
}

/// Every command says once what it leaves out, and that nothing gives light; not where one is given.
#[test]
fn what_is_left_out_is_said_once_by_every_command() {
    let folder = Folder::new("left-out");
    let path = dark(&folder);
    let [picture, light] =
        ["p.png", "l.light"].map(|name| folder.0.join(name).to_str().expect("text").to_owned());
    let small = ["--volume", "1x1x1", "--samples", "1", "--fit", "0"];
    for arguments in [
        &["inspect", &path][..],
        &["probe", &path, "--at", "0,1,0", "--samples", "1"],
        &["render", &path, "-o", &picture, "--spp", "1", "--size", "8x8", "--restart"],
        &[&["bake", &path, "-o", &light, "--json"][..], &small].concat(),
        &["bench", "rays", &path, "--rays", "64", "--rounds", "1"],
    ] {
        let ran = run(arguments);
        // No ray of the camera's meets two surfaces, of which `bench rays` has need.
        let done = if arguments[0] == "bench" { 1 } else { 0 };
        assert_eq!(ran.code, Some(done), "{ran:?}");
        assert_eq!((times(&ran, LEFT_OUT), times(&ran, SKY)), (1, 1), "{arguments:?}: {ran:?}");
        if arguments.contains(&"--json") {
            ran.json();
        }
        if arguments[0] != "inspect" {
            let lit = run(&[arguments, &["--environment", "sky:1000"]].concat());
            assert_eq!((times(&lit, LEFT_OUT), times(&lit, SKY)), (1, 0), "{arguments:?}: {lit:?}");
        }
    }
    let mut server =
        Program::start(&["serve", &path, "--listen", "127.0.0.1:0", "--volume", "1x1x1"]);
    let said = server.stderr_until(SKY);
    assert_eq!(said.matches(LEFT_OUT).count(), 1, "{said}");
}

#[test]
fn files_are_served_under_what_the_scene_calls_them() {
    let folder = Folder::new("served");
    let server = Serving::start(&dark(&folder), &["--volume", "1x1x1"]);
    let start: Value = serde_json::from_slice(&server.get("/lumencast.json").body).expect("JSON");
    assert_eq!(start["files"], json!(["scene.gltf", "the data/café 50%.bin"]));
    // As browsers ask, who write \ as / and encode all but %.
    for path in [
        "the%20data/caf%C3%A9%2050%25.bin",
        "the%20data/caf%C3%A9%2050%.bin",
        "the%20data//caf%C3%A9%2050%25.bin",
        "the%20data%5Ccaf%C3%A9%2050%25.bin",
        "./the%20data/caf%C3%A9%2050%25.bin%00",
    ] {
        let answer = server.get(&format!("/scene/{path}"));
        assert_eq!((answer.status, answer.body.len()), (200, 36), "{path}: {answer:?}");
    }
    folder.file("secret.bin", b"secret");
    for path in
        ["secret.bin", "the%20data%5C..%5Csecret.bin", "%5C%5Chost%5Csecret.bin", "caf%E9.bin"]
    {
        let answer = server.get(&format!("/scene/{path}"));
        assert!((400..500).contains(&answer.status), "{path}: {answer:?}");
    }
}

/// A `.light` file keeps the environment's picture, so that it is shown where there is no server.
#[test]
fn a_picture_of_the_environment_is_kept_with_the_light() {
    let folder = Folder::new("files-environment");
    let scene = scene(&folder, |_| {});
    let picture =
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x80\x80\x81\x40\x40\x40\x81";
    std::fs::create_dir(folder.0.join("sky")).expect("a folder");
    std::fs::write(folder.0.join("sky/clear day.hdr"), picture).expect("written");
    let light = folder.0.join("a.light");
    let light = light.to_str().expect("a name");
    let volume = ["--volume", "1x1x1@0,1,0:2,2,2", "--samples", "1"];
    let sky = ["--environment", "sky/./clear%20day.hdr"];
    let ran = run(&[&["bake", &scene, "-o", light][..], &volume, &sky].concat());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let report = run(&["inspect", light, "--json"]).json();
    assert_eq!(report["files"], json!([{ "name": "sky/clear day.hdr", "bytes": picture.len() }]));
    let words = run(&["inspect", light]).stdout;
    assert!(words.contains("name sky/clear day.hdr"), "{words}");
}

/// Of two scenes that which the file names; of a node with instances each of them.
#[test]
fn inspect_counts_what_is_shown() {
    let folder = Folder::new("shown");
    let path = scene(&folder, |scene| {
        let lights = json!([{ "type": "point" }, { "type": "point" }]);
        scene["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
        let light = |light: usize| json!({ "KHR_lights_punctual": { "light": light } });
        let instancing =
            json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 0 } } });
        scene["nodes"] = json!([
            { "mesh": 0 }, { "extensions": light(0) },
            { "mesh": 1, "extensions": instancing }, { "name": "shown", "extensions": light(1) },
        ]);
        let mesh = scene["meshes"][0].clone();
        scene["meshes"] = json!([mesh, { "name": "shown", "primitives": mesh["primitives"] }]);
        scene["scenes"] = json!([{ "nodes": [0, 1] }, { "nodes": [2, 3] }]);
        scene["scene"] = 1.into();
    });
    let report = run(&["inspect", &path, "--json"]).json();
    assert_eq!((&report["triangles"], &report["instances"]), (&json!(3), &json!(3)));
    for list in ["lights", "meshes"] {
        let [one] = &report[list].as_array().expect("a list")[..] else { panic!("{report}") };
        assert_eq!(one["name"], "shown", "{report}");
    }
    assert_eq!(report["lights"][0]["node"], 3);
    assert_eq!(report["meshes"][0]["mesh"], 1);
    let nodes: Vec<_> = report["nodes"].as_array().expect("a list").iter().collect();
    assert_eq!(nodes.iter().map(|n| n["node"].clone()).collect::<Vec<_>>(), [2, 3]);
}

/// Only rays tell where a default volume is, and `inspect` traces none.
#[test]
fn inspect_tells_of_a_default_volume() {
    let folder = Folder::new("default-volume");
    let path = dark(&folder);
    let report = run(&["inspect", &path, "--json"]).json();
    assert_eq!((&report["volumes"], &report["default_volume"]), (&json!([]), &json!(true)));
    let words = run(&["inspect", &path]).stdout;
    assert!(words.contains("volumes: none of its own; a default one"), "{words}");
    let report = run(&["inspect", "cornell", "--json"]).json();
    assert_eq!(report["default_volume"], false, "{report}");
    let words = run(&["inspect", "cornell"]).stdout;
    assert!(words.contains("volumes (") && !words.contains("default volume"), "{words}");
}

#[cfg(unix)]
#[test]
fn a_name_that_is_not_utf8_is_said_to_be_so() {
    use std::os::unix::ffi::OsStrExt as _;
    for command in ["inspect", "serve"] {
        let ran = std::process::Command::new(env!("CARGO_BIN_EXE_lumencast"))
            .arg(command)
            .arg(std::ffi::OsStr::from_bytes(b"caf\xE9.glb"))
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&ran.stderr);
        assert_eq!(ran.status.code(), Some(2), "{said}");
        assert!(said.contains("is not UTF-8; rename the file"), "{said}");
    }
}

/// The cases beside the repository, where they are.
#[test]
fn cases_from_outside() {
    let cases = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases");
    if !cases.is_dir() {
        eprintln!("skipped: there are no cases in {}", cases.display());
        return;
    }
    let probe = |name: &str| {
        let path = cases.join(name);
        let path = path.to_str().expect("text");
        let at = ["--at", "0,0.5,0", "--samples", "256", "--json"];
        let ran = run(&[&["probe", path][..], &at].concat());
        assert_eq!(ran.code, Some(0), "{name}: {ran:?}");
        ran.stdout
    };
    assert_eq!(probe("instanced.glb"), probe("instanced-flattened.glb"));
    let hidden = run(&["inspect", cases.join("hidden-node.glb").to_str().expect("text")]);
    assert_eq!(times(&hidden, SKY), 1, "{hidden:?}");
    for name in ["bom.gltf", "uris/ok.gltf", "uris/backslash.gltf", "uris/double.gltf"] {
        probe(name);
    }
    // Floors that are red by the third set of texture coordinates, and by a diffuse colour.
    for name in ["texcoord2.glb", "spec-gloss.glb"] {
        let red: Value = serde_json::from_str(&probe(name)).expect("JSON");
        let [r, g, b] = [0, 1, 2].map(|c| red["probes"][0]["sh"][0][c].as_f64().expect("a number"));
        assert!(r > 1.0 && g + b < 0.1 * r, "{red}");
    }
}

/// Where all moves, nothing has lumels: probes light it, and people are told.
#[test]
fn a_scene_without_still_surfaces_is_lit_by_probes() {
    let folder = Folder::new("all-moves");
    let moving = scene(&folder, |scene| {
        let times = "data:application/octet-stream;base64,AAAAAAAAgD8=";
        let more = [
            ("buffers", json!({ "uri": times, "byteLength": 8 })),
            ("bufferViews", json!({ "buffer": 1, "byteLength": 8 })),
            (
                "accessors",
                json!({
                    "bufferView": 1, "componentType": 5126, "type": "SCALAR", "count": 2,
                    "min": [0], "max": [1],
                }),
            ),
            (
                "accessors",
                json!({ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 2 }),
            ),
        ];
        for (list, one) in more {
            scene[list].as_array_mut().expect("a list").push(one);
        }
        scene["animations"] = json!([{
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
            "samplers": [{ "input": 1, "output": 2 }],
        }]);
    });
    let light = folder.0.join("moving.light").to_str().expect("text").to_owned();
    let few = ["--environment", "sky:1000", "--volume", "2x2x2", "--samples", "4"];
    let baked = run(&[&["bake", &moving, "-o", &light], &few[..]].concat());
    assert_eq!(baked.code, Some(0), "{baked:?}");
    assert!(baked.stderr.contains("no still surface"), "{baked:?}");
    let fields = &run(&["inspect", &light, "--json"]).json()["fields"];
    assert_eq!((fields[0]["kind"].as_str(), &fields[1]), (Some("volume"), &Value::Null));
    run(&["bake", &moving, "-o", &light, "--fields", "lightmap"])
        .failed_saying(&["nothing can hold the light", "--fields lightmap,volume"]);
    let server = Serving::start(&moving, &few);
    assert_eq!(server.ready["lumels"], Value::Null);
    server.wait_for_metric("lumencast_ticks_total", |n| n > 2.0);
}

#[test]
fn lumels_without_room_leave_all_to_probes() {
    let folder = Folder::new("no-room");
    let light = folder.0.join("small.light").to_str().expect("text").to_owned();
    let few = ["--lightmap", "64", "--volume", "2x2x2", "--samples", "4"];
    let baked = run(&[&["bake", "door", "-o", &light], &few[..]].concat());
    assert_eq!(baked.code, Some(0), "{baked:?}");
    assert!(baked.stderr.contains("warning: no surface has lumels"), "{baked:?}");
    let fields = &run(&["inspect", &light, "--json"]).json()["fields"];
    assert_eq!((fields[0]["kind"].as_str(), &fields[1]), (Some("volume"), &Value::Null));
}
