//! `lumencast bench peers`: the published implementation's protocol, on a built-in scene with a
//! reference of our own.

mod common;

use std::fs;
use std::path::Path;

use common::{Folder, run};
use lumencast_picture::Loaded;
use lumencast_scene::{FileContents, Scene, SceneFile};
use serde_json::{Value, json};

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

/// The built-in Cornell box as the file that it is.
fn cornell() -> Vec<u8> {
    let scene = Scene::builtin("cornell").expect("a built-in scene");
    let SceneFile { contents, .. } = scene.files().remove(0);
    let FileContents::Bytes(bytes) = contents else { panic!("a file in memory") };
    bytes.to_vec()
}

#[test]
fn fields_are_judged_by_the_reference() {
    let folder = Folder::new("peers");
    let scenes = folder.0.join("scenes");
    let scene = scenes.join("cornell/CornellBoxPoint.glb");
    let references = folder.0.join("references");
    let pictures = folder.0.join("pictures");
    fs::create_dir_all(scene.parent().expect("a folder")).expect("made");
    fs::create_dir_all(&references).expect("made");
    fs::write(&scene, cornell()).expect("written");
    let bench = |more: &[&str]| {
        let mut all = vec!["bench", "peers", text(&scenes), "--references", text(&references)];
        all.extend(["--scene", "cornell", "--volume", "4x4x4", "--probe-samples", "512"]);
        all.extend(["--indirect-spp", "64"]);
        all.extend(more);
        run(&all)
    };
    bench(&[]).failed_saying(&["cornell.exr", "--tools"]);
    let reference = references.join("cornell.exr");
    let ran = run(&[
        "render",
        text(&scene),
        "--materials",
        "lambert",
        "--size",
        "320x180",
        "--spp",
        "32",
        "-o",
        text(&reference),
    ]);
    assert_eq!(ran.code, Some(0), "{ran:?}");

    let ran = bench(&["--fit", "16", "--lumel-samples", "16", "--json", "-o", text(&pictures)]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let report = ran.json();
    let table = &report["scenes"][0];
    assert_eq!(
        (&table["scene"], &table["fields"][0]["grid"]),
        (&json!("cornell"), &json!("4x4x4"))
    );
    let fits: Vec<&Value> = (0..2).map(|row| &table["fields"][row]["fit"]).collect();
    assert_eq!(fits, [&Value::Null, &json!(16)]);
    let psnr = |of: &Value| of["sharp"].as_f64().expect("a figure");
    let without = psnr(&table["without_indirect"]);
    for row in 0..2 {
        let field = &table["fields"][row];
        let with = psnr(&field["psnr"]);
        assert!(
            with > without + 3.0 && with < 60.0,
            "{with} with indirect light, {without} without"
        );
        assert!(field["faults"].as_array().is_some_and(|faults| faults.len() > 2), "{field}");
    }
    // Of the indirect part alone, after the filter: a probe cell of half a metre knows less than lumels.
    let indirect = |row: usize| table["fields"][row]["indirect"]["filtered"].as_f64().expect("dB");
    assert_eq!(table["fields"][2]["lumels"]["page_size"], 256);
    assert!(indirect(1) > 15.0 && indirect(2) > indirect(1) + 3.0, "{table}");
    for name in
        ["reference", "4x4x4-gathered", "4x4x4-lumels", "4x4x4-fitted", "4x4x4-fitted-difference"]
    {
        let path = pictures.join(format!("cornell-{name}.png"));
        assert_eq!(Loaded::read(&path).expect("a picture").linear().width(), 320);
    }
    let words = bench(&["--fit", "0", "--lumel-samples", "0"]).stdout;
    assert!(words.contains("published: 33.8 (35.1) dB") && !words.contains("fitted"), "{words}");
    let three = "three.js r187, LightMapper: 36.5 (38.9) dB, indirect part 34.3 (37.4) dB";
    assert!(words.contains(three) && !words.contains("a lumel every"), "{words}");
    run(&["bench", "peers", text(&folder.0), "--references", text(&references)])
        .failed_saying(&["CornellBoxPoint.glb", "not there"]);
}
