//! `lumencast view`: pictures without a display, and a window on a display without a screen.

mod common;

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};

use common::{Folder, Program, Serving, run, run_with};
use lumencast_picture::Loaded;

/// An X server without a screen, until it is dropped. `cargo xtask test` installs it.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn new() -> Self {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb (Debian: apt-get install xvfb)");
        let mut number = String::new();
        let stdout = server.stdout.take().expect("its output");
        BufReader::new(stdout).read_line(&mut number).expect("the number of its display");
        Self { server, name: format!(":{}", number.trim()) }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Pixels of a picture that are red and green: light that came from the walls.
fn colored(picture: &std::path::Path) -> (usize, usize) {
    let picture = Loaded::read(picture).expect("a picture").linear();
    assert_eq!((picture.width(), picture.height()), (320, 200));
    let count = |more: usize, less: usize| {
        picture.pixels().iter().filter(|p| p[more] > 0.02 && p[more] > 2.0 * p[less]).count()
    };
    (count(0, 1), count(1, 0))
}

const NOWHERE: [(&str, &str); 2] = [("DISPLAY", ""), ("WAYLAND_DISPLAY", "")];

#[test]
fn a_window_opens_and_shows_a_picture() {
    let display = Display::new();
    let environment = [
        ("DISPLAY", display.name.as_str()),
        ("WAYLAND_DISPLAY", ""),
        ("RUST_LOG", "lumencast_window=debug"),
    ];
    let small = ["view", "cornell", "--volume", "1x1x1", "--size", "320x200"];
    Program::start_with(&small, &environment).wait_for("the window shows a picture");
}

/// From a saved field, from a server in the same program, and from another server.
#[test]
fn pictures_of_a_field_and_a_server_need_no_display() {
    let folder = Folder::new("view");
    let [field, probes] = ["lumels", "probes"].map(|name| {
        let path = folder.0.join(format!("{name}.light"));
        path.to_str().expect("text").to_owned()
    });
    let bake = ["bake", "cornell", "--volume", "3x3x3", "--samples", "64", "-o"];
    for own in [&[&*field][..], &[&probes, "--fields", "volume"]] {
        let baked = run(&[&bake[..], own].concat());
        assert_eq!(baked.code, Some(0), "{baked:?}");
    }
    let server = Serving::start("cornell", &["--volume", "3x3x3"]);
    let url = format!("http://{}/cornell", server.address);
    for (name, what) in [
        ("saved", &["cornell", "--light", &field][..]),
        ("probes", &["cornell", "--light", &probes]),
        ("here", &["cornell", "--volume", "3x3x3", "--lightmap", "128"]),
        ("here by probes", &["cornell", "--volume", "3x3x3", "--fields", "volume"]),
        ("server", &[&url]),
    ] {
        let picture = folder.0.join(format!("{name}.png"));
        let shot = picture.to_str().expect("text");
        let own = ["--size", "320x200", "--multisampling", "1", "--screenshot", shot];
        let arguments: Vec<&str> =
            ["view"].into_iter().chain(what.iter().copied()).chain(own).collect();
        let ran = run_with(&arguments, &NOWHERE);
        assert_eq!(ran.code, Some(0), "{name}: {ran:?}");
        let (red, green) = colored(&picture);
        assert!(red > 1000 && green > 1000, "{name}: {red} red and {green} green pixels");
    }
    // Lumels take the place of probes on what stands still.
    let shown = |name: &str| {
        let picture = Loaded::read(folder.0.join(format!("{name}.png"))).expect("a picture");
        picture.linear().pixels().to_vec()
    };
    let [saved, probes] = ["saved", "probes"].map(shown);
    let both = saved.iter().zip(&probes);
    let others = both.filter(|(a, b)| (0..3).any(|k| (a[k] - b[k]).abs() > 0.02)).count();
    assert!(others > 2000, "{others} pixels differ");
    // All that lies above the ball stands still.
    let upper = 320 * 100;
    let off = |name: &str| -> f32 {
        shown(name).iter().zip(&saved).take(upper).map(|(a, b)| (*a - *b).abs().element_sum()).sum()
    };
    for (lumels, probes) in [("here", "here by probes"), ("server", "probes")] {
        let (near, far) = (off(lumels), off(probes));
        assert!(near < 0.5 * far, "{lumels}: {near}, and {far} by probes");
    }
}

/// The edit that puts a scene under a picture reads it after the scene was loaded.
#[test]
fn files_of_a_servers_edits_are_there() {
    let folder = Folder::new("view-environment");
    let scene = folder.triangles("lit", &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 1.0);
    let sky = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x80\x80\x81\x40\x40\x40\x81";
    folder.file("sky.hdr", sky);
    let volume = ["--volume", "1x1x1@0,1,0:2,2,2", "--environment", "sky.hdr"];
    let server = Serving::start(&scene, &volume);
    let picture = folder.0.join("lit.png");
    let shot = ["--size", "64x48", "--screenshot", picture.to_str().expect("text")];
    let ran = run_with(&[&["view", &server.url()][..], &shot].concat(), &NOWHERE);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(!ran.stderr.contains("cannot be followed"), "{ran:?}");
}

#[test]
fn says_what_is_missing() {
    let folder = Folder::new("view-missing");
    let ran = run_with(&["view", "cornell", "--volume", "1x1x1"], &NOWHERE);
    ran.failed_saying(&["DISPLAY", "--screenshot", "lumencast render"]);
    for place in [".rs:", "registry", "os error at"] {
        assert!(!ran.stderr.contains(place), "{place}: {ran:?}");
    }
    let wrong = folder.0.join("shot.jpg");
    run(&["view", "cornell", "--screenshot", wrong.to_str().expect("text")])
        .failed_saying(&["shot.jpg", ".png"]);
    run(&["view", "http://127.0.0.1:9/cornell"]).failed_saying(&["cannot connect"]);
}

/// Light from elsewhere is shown all the same, for nothing else is known to be wrong; but people are
/// told.
#[test]
fn light_of_another_scene_is_told() {
    let folder = Folder::new("view-elsewhere");
    let field = folder.0.join("elsewhere.light");
    let field = field.to_str().expect("text");
    let volume = ["--volume", "1x1x1@500,0,0:2,2,2"];
    let bake = ["bake", "cornell", "--samples", "1", "-o", field];
    assert_eq!(run(&[&bake[..], &volume].concat()).code, Some(0));
    let server = Serving::start("cornell", &volume);
    let url = format!("http://{}/cornell", server.address);
    for light in [field, &url] {
        run_with(&["view", "cornell", "--light", light], &NOWHERE).failed_saying(&[
            "warning",
            light,
            "no part of this scene",
            "DISPLAY",
        ]);
    }
}
