//! Where output goes: files that are whole or as they were, standard output that fails, names that would
//! steer a terminal.

#![cfg(target_os = "linux")]

mod common;

use std::fs::{self, OpenOptions};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use common::{Folder, Serving, run, run_with};
use serde_json::{Value, json};

/// So much work that a test which does it does not end in time.
const ENDLESS: &str = "10000000";

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

fn files(folder: &Folder) -> Vec<PathBuf> {
    let entries = fs::read_dir(&folder.0).expect("a folder");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files
}

/// Runs the program with its files limited to 512 bytes or a little more, as on a full disk: `signal` says
/// whether it is killed at the limit or told.
fn run_on_a_full_disk(arguments: &[&str], signal: bool) -> Output {
    let trap = if signal { "" } else { "trap '' XFSZ; " };
    Command::new("sh")
        .args(["-c", &format!("ulimit -c 0; ulimit -f 1; {trap}exec \"$0\" \"$@\"")])
        .arg(env!("CARGO_BIN_EXE_lumencast"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("a shell")
}

#[test]
fn a_full_disk_and_a_crash_leave_the_old_file() {
    let bake = ["bake", "cornell", "--volume", "6x6x6", "--samples", "1"];
    let render = ["render", "cornell", "--size", "64x64", "--spp", "1"];
    for (command, name) in [(&bake[..], "a.light"), (&render, "a.png"), (&render, "a.exr")] {
        let folder = Folder::new("full");
        let path = folder.file(name, b"what was there");
        let arguments = [command, &["-o", &path]].concat();
        let ran = run_on_a_full_disk(&arguments, false);
        let said = String::from_utf8_lossy(&ran.stderr);
        assert_eq!(ran.status.code(), Some(1), "{name}: {ran:?}");
        assert!(said.contains(&format!("cannot write {path}")), "{said}");
        assert_eq!(files(&folder), [Path::new(&path)], "nothing is left beside it");
        let ran = run_on_a_full_disk(&arguments, true);
        assert_eq!(ran.status.code(), None, "{name}: killed, {ran:?}");
        assert_eq!(fs::read(&path).expect("still there"), b"what was there", "{name}");

        assert_eq!(run(&arguments).code, Some(0), "{name}");
        assert!(fs::metadata(&path).expect("replaced").len() > 512, "{name}");
    }
}

#[test]
fn part_of_a_key_is_not_left() {
    let folder = Folder::new("part-of-key");
    let key = folder.0.join("key.jwk");
    let limited = "ulimit -f 0; trap '' XFSZ; exec \"$0\" token a --generate --token-key \"$1\"";
    let ran = Command::new("sh")
        .args(["-c", limited, env!("CARGO_BIN_EXE_lumencast"), text(&key)])
        .output()
        .expect("a shell");
    assert_eq!(ran.status.code(), Some(1), "{ran:?}");
    assert!(String::from_utf8_lossy(&ran.stderr).contains("key.jwk"), "{ran:?}");
    assert_eq!(files(&folder), [] as [PathBuf; 0]);
}

#[test]
fn devices_and_links_are_written_to_and_stay() {
    let folder = Folder::new("devices");
    let small = ["bake", "cornell", "--volume", "1x1x1", "--samples", "1", "-o"];
    let bake = |path: &str| run(&[&small[..], &[path]].concat());
    bake("/dev/full").failed_saying(&["cannot write /dev/full", "No space left"]);
    assert_eq!(bake("/dev/null").code, Some(0));
    let full = folder.0.join("full.png");
    std::os::unix::fs::symlink("/dev/full", &full).expect("a link");
    run(&["render", "cornell", "--size", "8x8", "--spp", "1", "-o", text(&full)])
        .failed_saying(&["full.png", "No space left"]);
    assert!(Path::new("/dev/full").exists());

    let (there, link) = (folder.file("there.light", b""), folder.0.join("link.light"));
    std::os::unix::fs::symlink(&there, &link).expect("a link");
    assert_eq!(bake(text(&link)).code, Some(0));
    assert!(link.is_symlink());
    assert!(fs::read(&there).expect("a file").starts_with(b"LUMENCST"));
}

#[test]
fn what_is_read_is_not_written_over() {
    let folder = Folder::new("apart");
    let scene = folder.triangles("room", &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 1.0);
    let buffer = folder.0.join("room.bin");
    let settings = folder.file("room.lumencast.toml", b"");
    let (hard, soft) = (folder.0.join("hard.light"), folder.0.join("soft.light"));
    fs::hard_link(&buffer, &hard).expect("a link");
    std::os::unix::fs::symlink(&scene, &soft).expect("a link");
    let around = folder.0.join("../").join(folder.0.file_name().expect("a name")).join("room.bin");
    let whole = fs::read(&buffer).expect("a buffer");
    for path in [&scene, text(&buffer), &settings, text(&hard), text(&soft), text(&around)] {
        run(&["bake", &scene, "--samples", ENDLESS, "-o", path])
            .failed_saying(&[path, "which is read"]);
    }
    assert_eq!(fs::read(&buffer).expect("a buffer"), whole);

    let light = folder.0.join("a.light");
    let ran = run(&["bake", &scene, "--samples", "1", "--volume", "1x1x1", "-o", text(&light)]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let picture = folder.0.join("light.png");
    fs::hard_link(&light, &picture).expect("a link");
    run(&["render", &scene, "--light", text(&light), "-o", text(&picture)])
        .failed_saying(&["light.png", "which is read"]);
    run(&["compare", "reference.png", text(&picture), "-o", text(&picture)])
        .failed_saying(&["light.png", "which is read"]);
}

#[test]
fn places_that_take_no_files_are_refused_before_the_work() {
    for arguments in [
        &["bake", "cornell", "--samples", ENDLESS, "-o", "/proc/never.light"][..],
        &["render", "cornell", "--spp", ENDLESS, "-o", "/proc/never.png"],
        &["compare", "a.png", "b.png", "-o", "/proc/never.png"],
        &["view", "cornell", "--screenshot", "/proc/never.png"],
        &["bench", "quality", "cornell", "--document", "/proc/never.md"],
    ] {
        run(arguments).failed_saying(&["cannot write /proc/never."]);
    }
    run(&["bench", "quality", "cornell", "-o", "/proc"]).failed_saying(&["cannot write /proc"]);
}

fn onto(stdout: &str, stderr: Stdio, arguments: &[&str]) -> Output {
    let stdout = OpenOptions::new().write(true).open(stdout).expect("a device");
    Command::new(env!("CARGO_BIN_EXE_lumencast"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(stdout)
        .stderr(stderr)
        .output()
        .expect("the program starts")
}

#[test]
fn output_that_cannot_be_printed_is_an_error() {
    let folder = Folder::new("unprinted");
    let [light, picture, key] = ["a.light", "a.exr", "key"].map(|name| folder.0.join(name));
    let [light, picture, key] = [&light, &picture, &key].map(|path| text(path));
    let small = ["--size", "8x8", "--spp", "1"];
    for arguments in [
        &["--help"][..],
        &["--version"],
        &["help", "bake"],
        &["inspect", "cornell"],
        &["inspect", "cornell", "--json"],
        &["doctor"],
        &["doctor", "--json"],
        &["probe", "cornell", "--at", "0,1,0", "--samples", "16"],
        &["bake", "cornell", "--volume", "1x1x1", "--samples", "1", "-o", light],
        &[&["render", "cornell", "-o", picture], &small[..]].concat(),
        &["compare", picture, picture],
        &["token", "cornell", "--token-key", key, "--generate"],
        &["completions", "bash"],
        &["man"],
        &["serve", "cornell", "--listen", "127.0.0.1:0", "--volume", "1x1x1"],
        &["serve", "cornell", "--listen", "127.0.0.1:0", "--volume", "1x1x1", "--json"],
        &["bench", "tick", "cornell", "--volume", "1x1x1", "--seconds", "0.1"],
    ] {
        let ran = onto("/dev/full", Stdio::piped(), arguments);
        let said = String::from_utf8_lossy(&ran.stderr);
        assert_eq!(ran.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(said.contains("error: cannot write to standard output: No space"), "{said}");
        assert_eq!(said.lines().count(), 1, "{arguments:?}: {said}");
    }
}

/// Messages are lost then, and nothing else is.
#[test]
fn standard_error_that_fails_changes_nothing() {
    let full = || OpenOptions::new().write(true).open("/dev/full").expect("a device");
    for (arguments, code) in
        [(&["inspect", "no/such.glb"][..], 1), (&["paint"], 2), (&["inspect", "cornell"], 0)]
    {
        let ran = onto("/dev/null", full().into(), arguments);
        assert_eq!(ran.status.code(), Some(code), "{arguments:?}");
    }
}

/// What would retitle a window, colour text, go back to a line's beginning, or turn it round.
const HOSTILE: &str = "\u{1b}]0;title\u{7}\u{9b}31m\r\u{7f}\u{202e}\u{2066}\u{85}\nerror: lie";

fn steers(c: char) -> bool {
    c != '\n' && c.is_control() || "\u{202e}\u{2066}".contains(c)
}

/// A scene in which everything that has a name has that one.
fn hostile(folder: &Folder, stem: &str) -> String {
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let path = folder.triangles(stem, &corners, 1.0);
    let mut scene: Value =
        serde_json::from_slice(&fs::read(&path).expect("a scene")).expect("JSON");
    scene["cameras"] =
        json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }]);
    scene["nodes"][0]["camera"] = json!(0);
    scene["animations"] = json!([{ "channels": [], "samplers": [] }]);
    scene["extensions"]["KHR_lights_punctual"]["lights"][0]["name"] = json!(HOSTILE);
    scene["extensionsUsed"] = json!(["KHR_lights_punctual", HOSTILE]);
    for list in ["scenes", "nodes", "meshes", "materials", "cameras", "animations"] {
        for thing in scene[list].as_array_mut().into_iter().flatten() {
            thing["name"] = json!(HOSTILE);
        }
    }
    fs::write(&path, scene.to_string()).expect("a scene");
    path
}

#[test]
fn names_steer_no_terminal() {
    let folder = Folder::new("hostile");
    let scene = hostile(&folder, "room");
    let odd = hostile(&folder, &HOSTILE.replace('\n', ""));
    let [light, picture] = ["a.light", "a.png"].map(|name| folder.0.join(name));
    let small = ["--size", "8x8", "--spp", "1"];
    let mut broken: Value =
        serde_json::from_slice(&fs::read(&scene).expect("a scene")).expect("JSON");
    broken["meshes"][0]["primitives"][0]["indices"] = json!(7);
    let broken = folder.file("broken.gltf", broken.to_string().as_bytes());
    let required = json!({ "asset": { "version": "2.0" }, "extensionsRequired": [HOSTILE] });
    let required = folder.file("required.gltf", required.to_string().as_bytes());
    let toml = folder.triangles("toml", &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 1.0);
    folder.file("toml.lumencast.toml", format!("[environment]\ntype = \"{HOSTILE}\"").as_bytes());
    let mut shown = 0;
    for scene in [&scene, &odd, &broken, &required, &toml] {
        for arguments in [
            &["inspect", scene][..],
            &["inspect", scene, "--json"],
            &["probe", scene, "--at", "0,0,1", "--samples", "16"],
            &["bake", scene, "--volume", "1x1x1", "--samples", "1", "-o", text(&light)],
            &["inspect", text(&light)],
            &[&["render", scene, "-o", text(&picture)], &small[..]].concat(),
            &[&["render", scene, "--camera", "no such", "-o", text(&picture)], &small[..]].concat(),
        ] {
            let ran = run_with(arguments, &[("RUST_LOG", "debug")]);
            for output in [&ran.stdout, &ran.stderr] {
                assert!(!output.contains(steers), "{arguments:?}: {output:?}");
                assert!(!output.lines().any(|line| line.starts_with("error: lie")), "{output:?}");
                shown += usize::from(output.contains("0;title"));
            }
        }
    }
    assert!(shown >= 10, "names are shown all the same: {shown}");

    let server = Serving::start(&scene, &["--volume", "1x1x1"]);
    for arguments in [&["inspect", &server.url()][..], &["inspect", &server.url(), "--json"]] {
        let ran = run(arguments);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        assert!(ran.stdout.contains("0;title"), "its light's name is shown: {ran:?}");
        assert!(!(ran.stdout + &ran.stderr).contains(steers));
    }
}
