//! `lumencast render`: pictures, and going on with them.

mod common;

use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use common::{Folder, PATIENCE, Program, Serving, run};
use lumencast_picture::{Loaded, Picture, compare};
use serde_json::json;

/// Light is held by probes alone.
const PROBES_ALONE: [&str; 2] = ["--fields", "volume"];

fn linear(path: &Path) -> Picture {
    Loaded::read(path).expect("a picture").linear()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

/// Triangles without area, doubled, a thousand kilometres long and too thin for f32, all shining.
#[test]
fn odd_triangles_are_drawn_and_gathered_in_numbers() {
    let folder = Folder::new("render-odd");
    let mut corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].repeat(2);
    corners.extend([[1.0; 3]; 3]);
    corners.extend([[-5e5, -1.0, 5e5], [5e5, -1.0, 5e5], [0.0, -1.0, -5e5]]);
    corners.extend([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1e-30, 0.0]]);
    for (name, emission) in [("dim", 0.5), ("bright", 1e12)] {
        let scene = folder.triangles(name, &corners, emission);
        let exr = folder.0.join(format!("{name}.exr"));
        let mut arguments = vec!["render", &scene, "--size", "48x32", "--spp", "4"];
        arguments.extend(["--camera", "0,1,2,0,0,0", "-o", text(&exr)]);
        let ran = run(&arguments);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let picture = linear(&exr);
        let pixels = picture.pixels();
        assert!(pixels.iter().all(|v| v.is_finite() && v.min_element() >= 0.0), "{name}");
        assert!(pixels.iter().any(|v| v.max_element() >= 0.9 * emission), "{name}: the lamp shows");

        let ran = run(&["probe", &scene, "--at", "0,0,0", "--at", "0.2,0.2,0.5", "--json"]);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        // JSON has no NaN: it would be null.
        assert!(!ran.stdout.contains("null"), "{ran:?}");
    }
}

#[test]
fn parts_of_a_picture_add_up() {
    let folder = Folder::new("render-parts");
    let draw = |parts: &str| {
        let exr = folder.0.join(format!("{parts}.exr"));
        let png = folder.0.join(format!("{parts}.png"));
        let ran = run(&[
            "render",
            "cornell",
            "--size",
            "48x32",
            "--spp",
            "8",
            "--parts",
            parts,
            "-o",
            text(&exr),
            "-o",
            text(&png),
            "--json",
        ]);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let report = ran.json();
        assert_eq!((report["samples"].as_u64(), report["width"].as_u64()), (Some(8), Some(48)));
        assert!(report["noise_relative_rms"].as_f64().is_some_and(|noise| noise > 0.0));
        assert!(!folder.0.join(format!("{parts}.exr.part")).exists());
        assert_eq!(linear(&png).width(), 48);
        linear(&exr)
    };
    let (all, direct, indirect) = (draw("all"), draw("direct"), draw("indirect"));
    let sum = Picture::from_fn(48, 32, |x, y| {
        direct.pixel(x, y).expect("inside") + indirect.pixel(x, y).expect("inside")
    });
    let difference = |a: &Picture, b: &Picture| {
        let pairs = a.pixels().iter().zip(b.pixels());
        pairs.map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max)
    };
    assert!(all.pixels().iter().all(|v| v.is_finite()));
    assert!(difference(&all, &sum) < 1e-4 * lumencast_picture::luminance(all.pixels()[0]).max(1.0));
    assert!(difference(&all, &direct) > 1e-3, "there is indirect light");
}

#[test]
fn goes_on_after_an_interruption() {
    let folder = Folder::new("render-resume");
    let (picture, whole) = (folder.0.join("a.exr"), folder.0.join("b.exr"));
    let partial = folder.0.join("a.exr.part");
    let arguments = |path: &Path, spp: &str| -> Vec<String> {
        let all =
            ["render", "cornell", "--size", "64x48", "-o", text(path), "--spp", spp, "--json"];
        all.map(str::to_owned).to_vec()
    };
    let start = |path: &Path, spp: &str| {
        let arguments = arguments(path, spp);
        Program::start(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let finish = |path: &Path, spp: &str| {
        let arguments = arguments(path, spp);
        run(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
    };
    // However long it takes to load, there are samples at last.
    let began = Instant::now();
    for wait in [1, 2, 4, 8, 16] {
        let mut program = start(&picture, "1000000");
        thread::sleep(Duration::from_secs(wait));
        program.interrupt();
        assert_eq!(program.wait().code(), Some(130));
        if partial.exists() {
            break;
        }
    }
    assert!(partial.exists(), "nothing was kept in {:?}", began.elapsed());
    assert!(!picture.exists());

    let finished = |samples: &str| {
        let ran = finish(&picture, samples);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        assert!(!partial.exists());
        let report = ran.json();
        ["samples", "samples_taken_before"].map(|key| report[key].as_u64().expect("a number"))
    };
    // As many as were asked for, far more than there are, would take too long. That there are some is
    // enough for a picture; and it goes on from them where some more are asked for.
    let kept = std::fs::read(&partial).expect("what was kept");
    let [before, known] = finished("1");
    assert!(before > 1);
    assert_eq!(known, before);
    std::fs::write(&partial, kept).expect("put back");
    let [samples, known] = finished(&(before + 8).to_string());
    assert!(samples >= before + 8, "{samples}, {before} before");
    assert_eq!(known, before);

    let ran = finish(&whole, &samples.to_string());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let [resumed, at_once] = [&picture, &whole].map(|path| Loaded::read(path).expect("a picture"));
    let psnr = compare(&at_once, &resumed, None, 67.0).expect("same size").psnr;
    assert!(psnr > 35.0, "{psnr} dB apart after {samples} samples");
}

#[test]
fn a_partial_picture_of_something_else_is_not_used() {
    let folder = Folder::new("render-other");
    let picture = folder.0.join("a.png");
    std::fs::write(folder.0.join("a.png.part"), b"lumencast picture 1\nrubbish").expect("written");
    let ran = run(&["render", "cornell", "--size", "16x12", "--spp", "2", "-o", text(&picture)]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.stderr.contains("beginning anew"), "{ran:?}");
    assert!(picture.exists());
}

#[test]
fn says_what_is_wrong_before_it_begins() {
    let folder = Folder::new("render-wrong");
    let picture = folder.0.join("a.png");
    run(&["render", "cornell", "-o", "a.jpg"]).failed_saying(&["a.jpg", ".exr or .png"]);
    run(&["render", "cornell", "-o", "/no/such/folder/a.png"]).failed_saying(&["no such folder"]);
    run(&["render", "cornell", "-o", text(&picture), "--camera", "attic"])
        .failed_saying(&["attic", "0 ("]);
    run(&["render", "/no/such/scene.glb", "-o", text(&picture)]).failed_saying(&["scene.glb"]);
}

/// A few lumels bring a client's picture nearer to the reference than probes alone, and what is saved of
/// them can be looked at.
#[test]
fn lumels_are_baked_and_drawn() {
    let folder = Folder::new("render-lumels");
    let [light, picture, pages] = ["a.light", "a.exr", "pages"].map(|name| folder.0.join(name));
    let size = ["--size", "72x48", "--exposure", "1", "-o", text(&picture)];
    let draw = |how: &[&str]| {
        let ran = run(&[&["render", "cornell"], &size[..], how].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        Loaded::Linear(linear(&picture))
    };
    let reference = draw(&["--lighting", "reference", "--parts", "indirect", "--spp", "512"]);
    let nearness = |fields: &str| {
        let few = ["--samples", "256", "--lumel-samples", "64", "--lightmap", "128", "--json"];
        let bake = ["bake", "cornell", "-o", text(&light), "--fields", fields];
        let ran = run(&[&bake[..], &few].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let drawn = draw(&["--lighting", "indirect", "--light", text(&light)]);
        (ran.json(), compare(&reference, &drawn, None, 67.0).expect("of one size").psnr)
    };
    let (told, probes) = nearness("volume");
    assert_eq!((&told["pages"], &told["lumel_samples"]), (&0.into(), &json!(null)));
    let (told, both) = nearness("lightmap,volume");
    assert_eq!((&told["pages"], &told["lumel_samples"]), (&1.into(), &64.into()));
    assert!(both > probes + 1.0, "{both} dB, and {probes} dB by probes alone");

    // The same light, computed for the picture.
    let few = ["--probe-samples", "256", "--lumel-samples", "64", "--texel", "0.05"];
    let drawn = draw(&[&["--lighting", "indirect"], &few[..]].concat());
    let own = compare(&reference, &drawn, None, 67.0).expect("of one size").psnr;
    assert!(own > probes + 1.0, "{own} dB, and {probes} dB by probes alone");

    std::fs::create_dir(&pages).expect("a folder");
    let report = run(&["inspect", text(&light), "--pages", text(&pages), "--json"]).json();
    let field = &report["fields"][1];
    assert_eq!((&field["kind"], &field["page_size"]), (&"lightmap".into(), &128.into()));
    let told = &field["lightmap"];
    let of_scene = run(&["inspect", "cornell", "--charts", "--lightmap", "128", "--json"]).json();
    assert_eq!(told["charts"], of_scene["lightmap"]["charts"]);
    assert!((0.3..1.0).contains(&told["coverage"].as_f64().expect("a share")), "{told}");
    assert!(told["illuminance"]["mean"].as_f64() > Some(0.1), "{told}");
    let page = linear(&pages.join("field1-page0.exr"));
    assert_eq!([page.width(), page.height()], [128, 128]);
    assert!(pages.join("field1-page0.png").is_file());
}

/// A field is baked, a client's picture drawn under it, and both judged by the path tracer.
#[test]
fn a_clients_picture_is_near_the_reference() {
    let folder = Folder::new("render-field");
    let at = |name: &str| folder.0.join(name);
    let draw = |name: &str, arguments: &[&str]| {
        let exr = at(name);
        let mut all = vec!["render", "cornell", "--size", "72x48", "-o", text(&exr), "--json"];
        all.extend(arguments);
        let ran = run(&all);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        ran.json()
    };
    let light = at("cornell.light");
    let bake = ["bake", "cornell", "-o", text(&light), "--samples", "512", "--bounces", "3"];
    assert_eq!(run(&[&bake[..], &PROBES_ALONE].concat()).code, Some(0));
    draw("reference.exr", &["--spp", "128"]);
    let told = draw("field.exr", &["--lighting", "field", "--light", text(&light)]);
    assert_eq!((&told["probes"], &told["samples"]), (&512.into(), &8.into()));
    draw("direct.exr", &["--lighting", "direct"]);
    let few = ["--lighting", "indirect", "--probe-samples", "256"];
    draw("indirect.exr", &[&few[..], &PROBES_ALONE].concat());

    let reference = Loaded::read(at("reference.exr")).expect("a picture");
    let psnr = |name: &str| {
        let picture = Loaded::read(at(name)).expect("a picture");
        compare(&reference, &picture, None, 67.0).expect("of one size").psnr
    };
    assert!(psnr("field.exr") > 26.0, "{}", psnr("field.exr"));
    assert!(psnr("direct.exr") < 20.0, "without indirect light it is noticed");
    assert!(linear(&at("indirect.exr")).pixels().iter().any(|p| p.x > 0.1));

    draw("occluded.exr", &["--lighting", "field", "--light", text(&light), "--occlusion", "0.3"]);
    assert!(psnr("occluded.exr") > 25.0, "{}", psnr("occluded.exr"));
    let sum = |name: &str| linear(&at(name)).pixels().iter().map(|p| p.y).sum::<f32>();
    let left = sum("occluded.exr") / sum("field.exr");
    assert!((0.8..0.995).contains(&left), "{left}");

    let pair = at("pair.png");
    let ran = run(&[
        "render",
        "cornell",
        "--lighting",
        "direct",
        "--views",
        "stereo",
        "--size",
        "40x30",
        "--samples",
        "1",
        "-o",
        text(&pair),
    ]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let pair = linear(&pair);
    assert_eq!((pair.width(), pair.height()), (80, 30));
    assert_ne!(pair.pixel(15, 20), pair.pixel(55, 20), "the eyes stand apart");
}

/// Each picture of a grid is what a camera at its place shows by itself.
#[test]
fn tiles_are_what_single_cameras_show() {
    const SIZE: [u32; 2] = [40, 30];
    let folder = Folder::new("render-tiles");
    let draw = |name: &str, eye: [f32; 2], more: &[&str]| {
        let path = folder.0.join(name);
        let [x, y] = eye;
        let camera = format!("--camera={x},{y},3.6,{x},{y},0,0.7");
        let mut all = vec!["render", "cornell", "--lighting", "direct", "--size", "40x30"];
        all.extend(["--samples", "4", "--exposure", "1", "-o", text(&path), &camera]);
        all.extend(more);
        let ran = run(&all);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        linear(&path)
    };
    let grid = draw("grid.exr", [0.0, 1.0], &["--views", "3x2", "--view-spacing", "0.2"]);
    assert_eq!([grid.width(), grid.height()], [3 * SIZE[0], 2 * SIZE[1]]);
    // Row by row from the upper left.
    let eyes = [[-0.2, 1.1], [0.0, 1.1], [0.2, 1.1], [-0.2, 0.9], [0.0, 0.9], [0.2, 0.9]];
    let difference = |tile: u32, alone: &Picture| {
        let [left, top] = [tile % 3 * SIZE[0], tile / 3 * SIZE[1]];
        let differs = |i: &u32| {
            let [x, y] = [i % SIZE[0], i / SIZE[0]];
            let (here, there) = (grid.pixel(left + x, top + y), alone.pixel(x, y));
            here.zip(there).is_none_or(|(a, b)| (a - b).abs().max_element() > 0.02)
        };
        (0..SIZE[0] * SIZE[1]).filter(differs).count()
    };
    for (tile, eye) in (0..).zip(eyes) {
        let alone = draw("alone.exr", eye, &[]);
        let [own, next] = [difference(tile, &alone), difference((tile + 1) % 6, &alone)];
        // Where edges cross a pixel, its samples may fall to either side.
        assert!(own <= 6 && next > 60, "tile {tile}: {own} pixels differ, {next} of the next one");
    }
}

#[test]
fn what_cannot_be_drawn_is_said() {
    let folder = Folder::new("render-refused");
    let picture = folder.0.join("x.png");
    let render = |arguments: &[&str]| {
        let mut all = vec!["render", "cornell", "--size", "8x8", "-o", text(&picture)];
        all.extend(arguments);
        run(&all)
    };
    render(&["--lighting", "field", "--light", "nowhere.light"])
        .failed_saying(&["nowhere.light", "cannot read"]);
    let other = folder.0.join("other.light");
    std::fs::write(&other, b"LUMENCST is not all").expect("written");
    render(&["--lighting", "field", "--light", text(&other)]).failed_saying(&["no light file"]);
    render(&["--lighting", "field", "--parts", "direct"]).failed_saying(&["--lighting direct"]);
    for what in [["--views", "stereo"], ["--light", "nowhere.light"]] {
        render(&[&["--lighting", "reference"][..], &what].concat())
            .failed_saying(&[what[0], "--lighting field"]);
    }
    let behind = render(&["--lighting", "field", "--occlusion=-1"]);
    assert!(behind.code == Some(2) && behind.stderr.contains("metres"), "{behind:?}");
    assert!(!picture.exists());
}

/// A saved field brings the environment that it was computed under, unless another is given.
#[test]
fn saved_light_brings_its_environment() {
    let folder = Folder::new("render-environment");
    let [light, picture] = ["a.light", "a.exr"].map(|name| folder.0.join(name));
    let volume = ["--volume", "1x1x1@0,1,0:2,2,2", "--samples", "1", "--environment", "3,2,1"];
    let ran = run(&[&["bake", "cornell", "-o", text(&light)][..], &volume].concat());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let inspected = run(&["inspect", text(&light), "--json"]).json();
    assert_eq!((&inspected["edits"], &inspected["files"]), (&1.into(), &json!([])));
    let sky = |more: &[&str]| {
        let size = ["--size", "8x8", "--samples", "1", "--shadow-resolution", "64"];
        let away = ["--exposure", "1", "--camera=0,9,9,0,20,20,0.7"];
        let files = ["--light", text(&light), "-o", text(&picture)];
        let ran = run(&[&["render", "cornell"][..], &size, &away, &files, more].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        linear(&picture).pixel(4, 4).expect("a pixel").to_array()
    };
    assert_eq!(sky(&[]), [3.0, 2.0, 1.0]);
    assert_eq!(sky(&["--environment", "0.5,0.5,4"]), [0.5, 0.5, 4.0]);
}

/// Light of another scene that lies in the same place is told by its name; that a field is given says how
/// light is computed.
#[test]
fn light_of_another_scene_is_drawn_with_a_warning() {
    let folder = Folder::new("render-another");
    let [light, picture] = ["a.light", "a.png"].map(|name| folder.0.join(name));
    let bake = |scene: &str| {
        let volume = ["--volume", "1x1x1@0,1,0:2,2,2", "--samples", "1"];
        let ran = run(&[&["bake", scene, "-o", text(&light)][..], &volume].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
    };
    let render = || {
        let size = ["--size", "8x8", "--samples", "1", "--shadow-resolution", "64", "--json"];
        let files = ["--light", text(&light), "-o", text(&picture)];
        let ran = run(&[&["render", "cornell"][..], &size, &files].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        assert_eq!(ran.json()["probes"], 1);
        ran.stderr
    };
    bake("door");
    let said = render();
    assert!(
        ["warning", "\"door\"", "\"cornell\""].iter().all(|word| said.contains(word)),
        "{said}"
    );
    bake("cornell");
    assert!(!render().contains("warning"));
}

/// Light of a running server is what it is now, not what somebody saw long ago: lamps that are off at first
/// and go on while nobody looks are then as bright as in a bake of the same volume. Without a server that is
/// said.
#[test]
fn light_of_a_server_is_drawn() {
    /// Decibels that a quarter less light would not have.
    const ENOUGH: f64 = 28.0;
    /// What the scene has: candela, and cd/m².
    const LAMP: f32 = 4.0;
    const CEILING: [f32; 3] = [9.0, 7.2, 5.0];
    let folder = Folder::new("render-served");
    let [light, picture] = ["a.light", "a.exr"].map(|name| folder.0.join(name));
    let volume = ["--volume", "4x4x4"];
    let bake = ["bake", "cornell", "--samples", "16384", "--fit", "0", "-o", text(&light)];
    let ran = run(&[&bake[..], &volume, &PROBES_ALONE].concat());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let draw = |light: &str| {
        let size = ["--size", "48x32", "--samples", "1", "--shadow-resolution", "64"];
        let how = ["--lighting", "indirect", "--exposure", "1", "--light", light, "-o"];
        let ran = run(&[&["render", "cornell"], &size[..], &how, &[text(&picture)]].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        assert!(!ran.stderr.contains("warning"), "{ran:?}");
        Loaded::Linear(linear(&picture))
    };
    let baked = draw(text(&light));
    let lamp = |candela: f32| json!({ "edit": "set_light", "node": 4, "intensity": candela });
    let ceiling =
        |radiance: [f32; 3]| json!({ "edit": "set_material", "material": 3, "emissive": radiance });
    // The scene's sphere would go round.
    let still = json!({ "edit": "set_animation", "animation": 0, "playing": false });
    let edits = [
        (0.0, still),
        (0.0, lamp(0.0)),
        (0.0, ceiling([0.0; 3])),
        (4.0, lamp(LAMP)),
        (4.0, ceiling(CEILING)),
    ];
    let lines = edits.map(|(at, edit)| format!("{}\n", json!({ "at": at, "edit": edit })));
    let script = folder.0.join("lamps.jsonl");
    std::fs::write(&script, lines.concat()).expect("written");
    let how = ["--samples", "256", "--edits", text(&script)];
    let server = Serving::start("cornell", &[&volume[..], &PROBES_ALONE, &how].concat());
    let url = server.url();
    let nearness = |picture| compare(&baked, &picture, None, 67.0).expect("of one size").psnr;
    // The lamps go on at four seconds, and their light settles.
    let began = Instant::now();
    loop {
        let psnr = nearness(draw(&url));
        if psnr > ENOUGH {
            break;
        }
        assert!(began.elapsed() < PATIENCE, "{psnr}");
    }
    let dimmer = nearness(Loaded::Linear(baked.clone().linear().map(|p| p * 0.75)));
    assert!(dimmer < ENOUGH, "a quarter less light would be noticed: {dimmer}");
    drop(server);
    let out = ["-o", text(&picture)];
    run(&[&["render", "cornell", "--light", &url][..], &out].concat())
        .failed_saying(&["cannot connect"]);
}

/// A window that is wide leaves a field as it is; one that ends at band 1 leaves what is the same from all
/// sides, so that the room's ceiling and floor have light of one strength where a probe lights both.
#[test]
fn a_window_takes_bands_away() {
    let folder = Folder::new("render-window");
    let [light, picture] = ["a.light", "a.exr"].map(|name| folder.0.join(name));
    let volume = ["--volume", "1x1x1@0,1,0:2,2,2", "--samples", "512", "--fit", "0"];
    let bake = ["bake", "cornell", "-o", text(&light)];
    let ran = run(&[&bake[..], &volume, &PROBES_ALONE].concat());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let draw = |window: &[&str]| {
        let size = ["--size", "48x32", "--samples", "1", "--materials", "lambert"];
        let how = ["--lighting", "indirect", "--exposure", "1", "--light", text(&light)];
        let all = [&["render", "cornell", "-o", text(&picture)], &size[..], &how, window].concat();
        let ran = run(&all);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        linear(&picture)
    };
    // Of the box's white parts, which all have one albedo.
    let spread = |picture: &Picture| {
        let white = |p: &&glam::Vec3| p.min_element() > 0.5 * p.max_element() && p.x > 1e-3;
        let white: Vec<f32> = picture.pixels().iter().filter(white).map(|p| p.y).collect();
        assert!(white.len() > 200, "{}", white.len());
        let [least, most] = [f32::min, f32::max].map(|of| white.iter().copied().reduce(of));
        most.expect("white pixels") / least.expect("white pixels")
    };
    let [as_it_is, wide, narrow] = [&[][..], &["--window", "1000"], &["--window", "1"]].map(draw);
    let [as_it_is, wide, narrow] = [as_it_is, wide, narrow].map(|picture| spread(&picture));
    assert!((wide / as_it_is - 1.0).abs() < 0.01, "{wide}, {as_it_is}");
    assert!(as_it_is > 1.3 && narrow < 1.05, "{as_it_is}, {narrow}");
}
