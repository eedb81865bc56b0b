//! The commands that run to their end: what they print, and how they fail.

mod common;

use common::{Folder, run, run_with};
use glam::Vec3;
use lumencast_picture::{Loaded, Picture, ToneMap};
use serde_json::{Value, json};

#[test]
fn help_shows_examples_and_the_version_is_told() {
    for arguments in [
        &["--help"][..],
        &["serve", "--help"],
        &["view", "--help"],
        &["bake", "--help"],
        &["inspect", "--help"],
        &["probe", "--help"],
        &["compare", "--help"],
        &["doctor", "--help"],
        &["token", "--help"],
        &["completions", "--help"],
        &["man", "--help"],
        &["render", "--help"],
        &["bench", "tick", "--help"],
        &["bench", "rays", "--help"],
        &["bench", "paths", "--help"],
        &["bench", "quality", "--help"],
        &["bench", "peers", "--help"],
    ] {
        let ran = run(arguments);
        assert_eq!(ran.code, Some(0), "{arguments:?}: {ran:?}");
        assert!(ran.stdout.contains("Example"), "{arguments:?}");
    }
    assert!(run(&["--version"]).stdout.contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn wrong_usage_exits_with_2() {
    for arguments in [
        &["paint"][..],
        &["serve"],
        &["serve", "cornell", "--volume", "8x8"],
        &["serve", "cornell", "--samples", "0"],
        &["serve", "cornell", "--rate", "nan"],
        &["serve", "cornell", "--ratio", "2"],
        &["serve", "cornell", "--clients", "0"],
        &["probe", "cornell"],
        &["probe", "cornell", "--at", "0,0"],
        &["probe", "cornell", "--at", "0,0,0", "--order", "5"],
        &["serve", "cornell", "--tls-cert", "cert.pem"],
        &["render", "cornell"],
        &["render", "cornell", "-o", "x.png", "--size", "0x3"],
        &["render", "cornell", "-o", "x.png", "--size", "1280"],
        &["render", "cornell", "-o", "x.png", "--spp", "0"],
        &["render", "cornell", "-o", "x.png", "--camera", "0,0,0,0,0,0"],
        &["render", "cornell", "-o", "x.png", "--exposure", "-1"],
        &["render", "cornell", "-o", "x.png", "--time", "nan"],
        &["compare", "a.exr"],
        &["compare", "a.exr", "b.exr", "--exposure", "-1"],
        &["compare", "a.exr", "b.exr", "--ppd", "0"],
    ] {
        let ran = run(arguments);
        assert_eq!(ran.code, Some(2), "{arguments:?}: {ran:?}");
        assert!(ran.stdout.is_empty() && !ran.stderr.is_empty(), "{arguments:?}");
    }
}

#[test]
fn a_folder_is_no_scene_and_no_output() {
    let folder = Folder::new("no-scene");
    let path = folder.0.to_str().expect("text");
    run(&["serve", path]).failed_saying(&[path, "not a regular file"]);
    run(&["bake", "cornell", "-o", path]).failed_saying(&[path, "is a folder"]);
}

/// A machine on which no driver for graphics is installed: the message names what to install.
#[test]
fn without_an_adapter_it_says_what_to_install() {
    let folder = Folder::new("no-adapter");
    let path = folder.0.join("picture.png");
    let path = path.to_str().expect("text");
    let small = ["--size", "8x8", "-o", path];
    let no_driver = [("VK_DRIVER_FILES", "/dev/null"), ("VK_ICD_FILENAMES", "/dev/null")];
    for lighting in ["none", "direct"] {
        let arguments = [&["render", "cornell", "--lighting", lighting][..], &small].concat();
        run_with(&arguments, &no_driver).failed_saying(&[
            "no graphics adapter",
            "Install",
            "mesa-vulkan-drivers",
        ]);
        assert!(!folder.0.join("picture.png").exists());
    }
    let traced = [&["render", "cornell", "--lighting", "reference", "--spp", "1"][..], &small];
    assert_eq!(run_with(&traced.concat(), &no_driver).code, Some(0), "needs none");
}

#[test]
fn a_missing_scene_is_named() {
    for command in ["serve", "bake", "inspect", "probe"] {
        let mut arguments = vec![command, "no/such/scene.glb"];
        match command {
            "bake" => arguments.extend(["-o", "never.light"]),
            "probe" => arguments.extend(["--at", "0,0,0"]),
            _ => {}
        }
        run(&arguments).failed_saying(&["no/such/scene.glb"]);
    }
}

#[test]
fn bad_scenes_are_refused_by_name() {
    let folder = Folder::new("bad-scenes");
    for (name, contents) in [
        ("empty.glb", &b""[..]),
        ("rubbish.glb", b"glTF\x02\x00\x00\x00\xff\xff\xff\xff rubbish"),
        ("rubbish.gltf", b"{\"asset\": "),
        ("nothing.gltf", br#"{"asset": {"version": "2.0"}}"#),
        (
            "unknown.gltf",
            br#"{"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_from_the_future"]}"#,
        ),
    ] {
        let path = folder.file(name, contents);
        run(&["inspect", &path]).failed_saying(&[name]);
        run(&["probe", &path, "--at", "0,0,0"]).failed_saying(&[name]);
    }
    let path = folder.0.join("unknown.gltf");
    run(&["inspect", path.to_str().expect("text")]).failed_saying(&["KHR_from_the_future"]);
}

#[test]
fn vertices_that_are_no_numbers_are_refused_by_mesh() {
    let folder = Folder::new("no-numbers");
    let path = folder.triangles("bent", &[[0.0; 3], [1.0, f32::NAN, 0.0], [0.0, 1.0, 0.0]], 1.0);
    let picture = folder.0.join("never.png");
    for arguments in [
        &["inspect", &path][..],
        &["probe", &path, "--at", "0,0,0"],
        &["render", &path, "-o", picture.to_str().expect("text")],
        &["serve", &path, "--listen", "127.0.0.1:0"],
    ] {
        run(arguments).failed_saying(&["bent.gltf", "mesh 0 \"odd\"", "POSITION", "not finite"]);
    }
    assert!(!picture.exists());
}

#[test]
fn an_address_for_all_needs_a_word_on_who_may_edit() {
    run(&["serve", "cornell", "--listen", "0.0.0.0:0"]).failed_saying(&["--token-key", "--open"]);
}

#[test]
fn a_script_that_is_none_is_named() {
    let folder = Folder::new("bad-script");
    let path = folder.file("edits.jsonl", b"{\"at\": 0, \"edit\": {\"edit\": \"explode\"}}\n");
    run(&["serve", "cornell", "--listen", "127.0.0.1:0", "--edits", &path])
        .failed_saying(&["edits.jsonl"]);
    run(&["serve", "cornell", "--listen", "127.0.0.1:0", "--edits", "no/such.jsonl"])
        .failed_saying(&["no/such.jsonl"]);
}

#[test]
fn doctor_prints_json_only() {
    let ran = run(&["doctor", "--json"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let report = ran.json();
    assert!(report["processor"]["cores"].as_u64().is_some_and(|n| n > 0));
    assert!(report["programs"].as_array().is_some_and(|p| !p.is_empty()));
    // Set-up installs a software adapter at least.
    for adapter in report["adapters"].as_array().expect("adapters") {
        assert!(adapter["name"].as_str().is_some_and(|name| !name.is_empty()), "{adapter}");
        assert!(adapter["largest_buffer_bytes"].as_u64().is_some_and(|n| n > 0), "{adapter}");
    }
    assert_ne!(report["adapters"], json!([]), "cargo xtask setup installs a software adapter");
    assert!(run(&["doctor"]).stdout.contains("processor"));
}

#[test]
fn probe_prints_coefficients_with_their_errors() {
    let ran = run(&[
        "probe",
        "cornell",
        "--at",
        "0,1,0",
        "--at",
        "-0.5,0.5,0.25",
        "--order",
        "3",
        "--samples",
        "1024",
        "--bounces",
        "2",
        "--materials",
        "lambert",
        "--json",
    ]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let report = ran.json();
    let probes = report["probes"].as_array().expect("probes");
    assert_eq!(probes.len(), 2);
    for probe in probes {
        for key in ["sh", "standard_error"] {
            let values = probe[key].as_array().expect(key);
            assert_eq!(values.len(), 16, "{key}");
            assert!(values.iter().flat_map(|v| v.as_array().expect("rgb")).all(Value::is_number));
        }
        let c0 = probe["sh"][0][0].as_f64().expect("a number");
        let error = probe["standard_error"][0][0].as_f64().expect("a number");
        assert!(c0 > 0.0 && error > 0.0 && error < 0.2 * c0, "{c0} ± {error}");
    }
    assert!(report["probes"][1]["at"][0].as_f64().is_some_and(|x| (x + 0.5).abs() < 1e-6));
}

#[test]
fn pictures_are_compared() {
    let folder = Folder::new("compare");
    let path = |name: &str| folder.0.join(name).to_str().expect("text").to_owned();
    let picture = Picture::from_fn(24, 16, |x, y| Vec3::new(x as f32, y as f32, 5.0) * 10.0);
    let write = |name: &str, picture: &Picture| {
        picture.write_exr(path(name)).expect("written");
        path(name)
    };
    let reference = write("reference.exr", &picture);
    let darker = write("darker.exr", &picture.map(|p| p * 0.8));

    let same = run(&["compare", &reference, &reference, "--json"]).json();
    for key in ["psnr", "psnr_unclamped"] {
        assert_eq!(same[key], Value::Null, "infinite");
    }
    for key in ["flip", "flip_hdr", "mse", "relative_mse"] {
        assert_eq!(same[key], 0.0, "{key}");
    }
    assert_eq!((&same["ssim"], &same["width"]), (&json!(1.0), &json!(24)));
    let exposure = same["exposure"].as_f64().expect("a number");
    assert!((1.0 / 250.0..1.0 / 100.0).contains(&exposure), "{exposure}");

    let difference = path("difference.png");
    let ran = run(&["compare", &reference, &darker, "--json", "-o", &difference]);
    let off = ran.json();
    assert!((10.0..40.0).contains(&off["psnr"].as_f64().expect("a number")), "{off}");
    assert!((0.01..0.5).contains(&off["flip_hdr"].as_f64().expect("a number")), "{off}");
    let map = Loaded::read(&difference).expect("a PNG");
    assert_eq!((map.stored().width(), map.stored().height()), (24, 16));
    assert!(map.stored().pixels().iter().any(|p| p.x > 0.2), "errors are seen");
    let text = run(&["compare", &reference, &reference]).stdout;
    assert!(text.contains("PSNR          inf dB") && text.contains("HDR-FLIP"), "{text}");

    // A PNG of the same light: what differs is its rounding.
    let png = path("picture.png");
    picture.write_png(&png, ToneMap::Srgb, exposure as f32).expect("written");
    let mixed = run(&["compare", &reference, &png, "--json"]).json();
    assert!(mixed["psnr"].as_f64().is_some_and(|psnr| psnr > 45.0), "{mixed}");
    assert_eq!((&mixed["flip_hdr"], &mixed["ppd"]), (&Value::Null, &off["ppd"]));
    let coded = run(&["compare", &png, &png, "--json", "--exposure", "3"]).json();
    assert_eq!(coded["exposure"], 1.0);
}

#[test]
fn pictures_that_cannot_be_compared_are_refused() {
    let folder = Folder::new("compare-bad");
    let path = |name: &str| folder.0.join(name).to_str().expect("text").to_owned();
    let write = |name: &str, width: u32, value: f32| {
        let picture = Picture::from_fn(width, 12, |x, _| Vec3::splat(x as f32 * value));
        picture.write_exr(path(name)).expect("written");
        path(name)
    };
    let (good, wide) = (write("good.exr", 20, 1.0), write("wide.exr", 21, 1.0));
    run(&["compare", &good, &wide]).failed_saying(&["20 × 12", "21 × 12", "wide.exr"]);
    let bad = write("bad.exr", 20, f32::NAN);
    run(&["compare", &good, &bad]).failed_saying(&["bad.exr", "240 pixels", "column 0, row 0"]);
    run(&["compare", &good, "no/such.exr"]).failed_saying(&["no/such.exr"]);
    let words = folder.file("words.png", b"no picture");
    run(&["compare", &words, &good]).failed_saying(&["words.png"]);
    run(&["compare", &good, &good, "-o", &path("map.exr")]).failed_saying(&["map.exr", "PNG"]);
    run(&["compare", &good, &good, "-o", "/no/such/map.png"]).failed_saying(&["/no/such/map.png"]);
}

#[test]
fn charts_of_a_scene_can_be_inspected() {
    let cache = Folder::new("charts");
    let inspect = |arguments: &[&str]| {
        let arguments = [&["inspect", "cornell", "--charts"], arguments].concat();
        run_with(&arguments, &[("XDG_CACHE_HOME", cache.0.to_str().expect("text"))])
    };
    let report = inspect(&["--json"]).json();
    let lightmap = &report["lightmap"];
    assert_eq!((&lightmap["pages"], &lightmap["page_size"]), (&json!(1), &json!(256)));
    assert!(lightmap["coverage"].as_f64().is_some_and(|share| (0.5..1.0).contains(&share)));
    let kept = cache.0.join("lumencast/charts");
    assert_eq!(kept.read_dir().expect("charts are kept").count(), 4);
    let finer = &inspect(&["--texel", "0.01", "--json"]).json()["lightmap"];
    assert!(finer["texel"].as_f64().is_some_and(|texel| (texel - 0.01).abs() < 1e-6));
    assert!(finer["lumels"].as_u64() > lightmap["lumels"].as_u64());
    let words = inspect(&["--lightmap", "128"]).stdout;
    assert!(words.contains("lightmap: ") && words.contains("page size 128"), "{words}");
    for (arguments, word) in [
        (&["--lightmap", "100"][..], "multiple of 16"),
        (&["--texel", "0"], "more than 0"),
        (&["--texel", "1", "--lightmap", "128"], "cannot be used with"),
    ] {
        let ran = inspect(arguments);
        assert_eq!(ran.code, Some(2), "{ran:?}");
        assert!(ran.stderr.contains(word), "{ran:?}");
    }
}

#[test]
fn bench_lightmap_judges_the_light_of_lumels() {
    let cache = Folder::new("lumels");
    let bench = |arguments: &[&str]| {
        let arguments = [&["bench", "lightmap"], arguments].concat();
        run_with(&arguments, &[("XDG_CACHE_HOME", cache.0.to_str().expect("text"))])
    };
    let few = ["cornell", "--samples", "16", "--reference-noise", "35"];
    let report = bench(&[&few[..], &["--json"]].concat()).json();
    let [gathered, filtered] =
        ["gathered", "filtered"].map(|what| report["irradiance_db"][what].as_f64().expect(what));
    assert!(gathered > 20.0 && filtered > gathered + 2.0, "{gathered} {filtered}");
    assert!(report["reference"]["noise_db"].as_f64().is_some_and(|noise| noise >= 35.0));
    let bytes = report["bytes_a_lumel"].as_f64().expect("a number");
    assert!((44.0..120.0).contains(&bytes), "{bytes}");
    let of_pages = report["bytes_a_lumel_of_pages"].as_f64().expect("a number");
    assert!((16.0..bytes).contains(&of_pages), "{of_pages}");
    assert_eq!(report["coded"].as_array().map(Vec::len), Some(10));
    assert!(report["poison_codes"].as_f64().is_some_and(|codes| codes <= 1.0), "{report}");
    let words = bench(&few).stdout;
    assert!(words.contains("irradiance: ") && words.contains("1 × 256²"), "{words}");
    let alone = cache.triangles("alone", &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 0.0);
    bench(&[&alone, "--samples", "1"]).failed_saying(&["no light arrives"]);
}

#[test]
fn what_was_baked_can_be_inspected() {
    let folder = Folder::new("bake");
    let path = folder.0.join("cornell.light").to_str().expect("text").to_owned();
    let baked = run(&[
        "bake",
        "cornell",
        "-o",
        &path,
        "--volume",
        "4x3x5",
        "--order",
        "1",
        "--samples",
        "128",
        "--json",
    ]);
    assert_eq!(baked.code, Some(0), "{baked:?}");
    let bytes = std::fs::read(&path).expect("the file");
    assert_eq!(&bytes[..8], b"LUMENCST");
    assert_eq!(baked.json()["bytes"], bytes.len());

    let inspected = run(&["inspect", &path, "--json"]);
    assert_eq!(inspected.code, Some(0), "{inspected:?}");
    let report = inspected.json();
    assert_eq!(report["scene"]["name"], "cornell");
    let field = &report["fields"][0];
    assert_eq!((&field["probes"], &field["order"]), (&60.into(), &1.into()));
    assert_eq!(field["source"], "cpu path tracing, fitted to surfaces, baked, 128 samples");
    assert_eq!(field["epoch"], report["epoch"]);
    let words = run(&["inspect", &path]).stdout;
    assert!(
        words.contains("source cpu path tracing, fitted to surfaces, baked, 128 samples"),
        "{words}"
    );
    let [min, mean, max] = ["min", "mean", "max"].map(|k| field["c0"][k].as_f64().expect(k));
    // A fit may leave a probe in the dark a little below nothing.
    assert!(-0.01 * mean <= min && min < mean && mean < max, "{min} {mean} {max}");
    // The brightest luminance is at most the brightest channel's, and at least a tenth of it.
    let scale = field["scale_log2"].as_f64().expect("a scale").exp2();
    assert!((0.025..2.0).contains(&(max / scale)), "{max} at a scale of {scale}");

    let plain = folder.0.join("plain.light").to_str().expect("text").to_owned();
    let few = ["--volume", "4x3x5", "--order", "1", "--samples", "128", "--fit", "0"];
    let ran = run(&[&["bake", "cornell", "-o", &plain], &few[..]].concat());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let plain = run(&["inspect", &plain, "--json"]).json();
    assert_eq!(plain["fields"][0]["source"], "cpu path tracing, baked, 128 samples");
    assert_ne!(plain["fields"][0]["c0"], field["c0"], "a fit changes light");

    let cut = folder.file("cut.light", &bytes[..bytes.len() - 7]);
    run(&["inspect", &cut]).failed_saying(&["cut.light"]);
    let unwritable = "/no/such/folder/x.light";
    run(&["bake", "cornell", "-o", unwritable, "--samples", "1", "--volume", "1x1x1"])
        .failed_saying(&[unwritable]);
}

/// Refused before memory is asked for, and before anything is computed or written.
#[test]
fn volumes_beyond_the_limits_are_refused_in_words() {
    let folder = Folder::new("large-volumes");
    let path = folder.0.join("large.light");
    let bake = |volumes: &[&str]| {
        let mut arguments =
            vec!["bake", "cornell", "-o", path.to_str().expect("text"), "--samples", "10000000"];
        arguments.extend(volumes.iter().flat_map(|volume| ["--volume", *volume]));
        run(&arguments)
    };
    for huge in ["100000x100000x100000", "4294967295x4294967295x4294967295", "65537x1x1"] {
        let words = ["--volume", huge, "1 to 65536", "give it fewer"];
        bake(&[huge]).failed_saying(&words);
        run(&["serve", "cornell", "--listen", "127.0.0.1:0", "--volume", huge])
            .failed_saying(&words);
        run(&["bench", "tick", "cornell", "--volume", huge]).failed_saying(&words);
    }
    bake(&["8x8x8@0,0,0:1e30,1,1"]).failed_saying(&["--volume", "size"]);
    // Each small enough, but not together; and as many regions as no catalog holds.
    bake(&["64x32x32"; 9]).failed_saying(&["volume 8", "589824", "524288", "fewer cells"]);
    bake(&["65536x1x1"]).failed_saying(&["volume 0", "6554 regions", "4096", "fewer cells"]);
    bake(&["1x1x1"; 257]).failed_saying(&["257", "256", "fewer volumes"]);
    bake(&["1x1x9000"]).failed_saying(&["265 fields", "256", "fewer cells along z"]);
    assert!(!path.exists());
}

#[test]
fn volumes_too_deep_for_browsers_are_baked_in_pieces() {
    let folder = Folder::new("deep");
    let path = folder.0.join("deep.light").to_str().expect("text").to_owned();
    let baked = run(&[
        "bake",
        "cornell",
        "-o",
        &path,
        "--fields",
        "volume",
        "--volume",
        "1x2x35",
        "--samples",
        "1",
        "--json",
    ]);
    assert_eq!(baked.code, Some(0), "{baked:?}");
    assert_eq!((&baked.json()["fields"], &baked.json()["probes"]), (&2.into(), &70.into()));
    let fields = run(&["inspect", &path, "--json"]).json()["fields"].clone();
    let resolutions = [0, 1].map(|field| fields[field]["grid"]["resolution"].clone());
    assert_eq!(resolutions, [json!([1, 2, 17]), json!([1, 2, 18])]);
}

#[test]
fn inspect_tells_what_is_in_a_scene() {
    let ran = run(&["inspect", "cornell", "--json"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let report = ran.json();
    assert!(report["triangles"].as_u64().is_some_and(|n| (3_000..6_000).contains(&n)), "{report}");
    for key in ["nodes", "meshes", "lights", "cameras", "volumes"] {
        assert!(report[key].as_array().is_some_and(|a| !a.is_empty()), "{key}");
    }
}

#[test]
fn tokens_come_from_a_key() {
    let folder = Folder::new("token");
    let key = folder.0.join("key.jwk").to_str().expect("text").to_owned();
    run(&["token", "cornell", "--token-key", &key]).failed_saying(&["key.jwk", "--generate"]);
    let ran = run(&["token", "cornell", "--token-key", &key, "--generate"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(ran.stdout.trim().split('.').count(), 3, "a JWT");
    run(&["token", "cornell", "--token-key", &key, "--generate"]).failed_saying(&["exists"]);
}

#[test]
fn bench_prints_figures() {
    let ran = run(&[
        "bench",
        "tick",
        "cornell",
        "--volume",
        "2x2x2",
        "--seconds",
        "0.4",
        "--samples",
        "1..8",
        "--json",
    ]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let figures = ran.json();
    assert_eq!(figures["ticks"], 10);
    for pointer in ["/tick_ms/median", "/samples_a_second", "/fields/0/bytes_an_update"] {
        let value = figures.pointer(pointer).and_then(Value::as_f64);
        assert!(value.is_some_and(|v| v > 0.0), "{pointer}: {figures}");
    }
}

#[test]
fn bench_rays_and_paths_print_figures() {
    for levels in ["1", "2"] {
        let few = ["--rays", "2000", "--rounds", "2", "--levels", levels, "--json"];
        let ran = run(&[&["bench", "rays", "cornell"], few.as_slice()].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let figures = ran.json();
        assert_eq!(figures["levels"].to_string(), levels);
        for pointer in [
            "/triangles",
            "/hits/closest",
            "/closest_a_second/median",
            "/any_a_second/median",
            "/build_ms/median",
            "/top_level_ms/median",
            "/bytes_a_triangle",
        ] {
            let value = figures.pointer(pointer).and_then(Value::as_f64);
            assert!(value.is_some_and(|v| v > 0.0), "{pointer}: {figures}");
        }
    }
    let ran = run(&["bench", "paths", "cornell", "--size", "32x24", "--rounds", "2", "--json"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let figures = ran.json();
    for pointer in ["/samples", "/paths_a_second/median", "/segments_a_second/median"] {
        let value = figures.pointer(pointer).and_then(Value::as_f64);
        assert!(value.is_some_and(|v| v > 0.0), "{pointer}: {figures}");
    }
    run(&["bench", "rays", "cornell", "--camera", "0,50,0,0,99,0"]).failed_saying(&["--camera"]);
}

#[test]
#[cfg(unix)]
fn ends_quietly_when_nobody_reads_on() {
    for arguments in
        [&["inspect", "cornell"][..], &["inspect", "cornell", "--json"], &["doctor"], &["--help"]]
    {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let ran = std::process::Command::new(env!("CARGO_BIN_EXE_lumencast"))
            .args(arguments)
            .stdout(writer)
            .output()
            .expect("the program starts");
        assert_eq!(ran.status.code(), Some(141), "{arguments:?}");
        assert_eq!(String::from_utf8_lossy(&ran.stderr), "", "{arguments:?}");
    }
}

/// Commands that fail by what the system says: files that are not there, or are no files.
#[test]
fn errors_say_each_cause_once() {
    let folder = Folder::new("causes");
    let here = |name: &str| folder.0.join(name).to_str().expect("text").to_owned();
    let [none, light, picture, out] = ["none", "none.light", "none.png", "out.png"].map(here);
    let broken = folder.file("broken.png", b"\x89PNG\r\n\x1a\nno more");
    let script = folder.file("script.jsonl", b"{\"at\": 0, \"edit\": {\"edit\": \"explode\"}}\n");
    let toml = folder.triangles("toml", &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 1.0);
    folder.file("toml.lumencast.toml", b"[environment]\ntype = \"cellar\"\n");
    let words = folder.file("words.light", b"no light");
    let free = ["serve", "cornell", "--listen", "127.0.0.1:0", "--volume", "1x1x1"];
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let taken = taken.local_addr().expect("an address").to_string();
    for arguments in [
        &["inspect", &none][..],
        &["inspect", &light],
        &["inspect", &words],
        &["inspect", &toml],
        &["inspect", "http://127.0.0.1:9/x"],
        &["compare", &picture, &picture],
        &["compare", &broken, &broken],
        &["render", "cornell", "--light", &light, "-o", &out],
        &["render", "cornell", "--light", &words, "-o", &out],
        &["render", &none, "-o", &out],
        &["view", &none, "--screenshot", &out],
        &["bake", "cornell", "-o", "/proc/none"],
        &["token", "a", "--token-key", &words],
        &["serve", "cornell", "--listen", &taken, "--volume", "1x1x1"],
        &[&free[..], &["--edits", &script]].concat(),
        &[&free[..], &["--edits", &none]].concat(),
        &[&free[..], &["--token-key", &none]].concat(),
        &[&free[..], &["--page", &none]].concat(),
        &[&free[..], &["--tls-cert", &none, "--tls-key", &none]].concat(),
    ] {
        let ran = run(arguments);
        assert_eq!(ran.code, Some(1), "{arguments:?}: {ran:?}");
        let begin = ran.stderr.rfind("error: ").unwrap_or_else(|| panic!("{arguments:?}: {ran:?}"));
        let error = ran.stderr[begin..].trim_end();
        let parts: Vec<&str> = error.split(": ").collect();
        for (i, part) in parts.iter().enumerate() {
            assert!(!parts[..i].contains(part), "{part:?} twice: {error}");
        }
        assert!(error.matches("(os error").count() <= 1, "{error}");
    }
}

#[test]
fn shells_complete_commands_and_man_shows_them() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let ran = run(&["completions", shell]);
        assert_eq!(ran.code, Some(0), "{shell}: {ran:?}");
        for word in ["lumencast", "bake", "environment"] {
            assert!(ran.stdout.contains(word), "{shell}: {word}");
        }
    }
    assert_eq!(run(&["completions", "abacus"]).code, Some(2));
    let page = run(&["man"]).stdout;
    assert!(page.contains(".TH") && page.contains("lumencast\\-bake"), "{page}");

    let folder = Folder::new("man");
    let ran = run(&["man", "-o", folder.0.join("man1").to_str().expect("text")]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let page = |name: &str| std::fs::read_to_string(folder.0.join("man1").join(name));
    for (name, word) in [
        ("lumencast.1", "bench"),
        ("lumencast-bake.1", "samples"),
        ("lumencast-bench-tick.1", "seconds"),
    ] {
        let page = page(name).unwrap_or_else(|error| panic!("{name}: {error}; {ran:?}"));
        assert!(page.contains(".TH") && page.contains(word), "{name}");
    }
    for name in ["lumencast.1", "lumencast-bench.1"] {
        assert!(
            !page(name).expect("a page").contains("help(1)"),
            "{name} names a page that is not there"
        );
    }
}
