//! What a tick does with edits, scripts and volumes, and the light that comes of them.

mod common;

use common::{Stepped, dim, mail, options, shape, tracer, volumes};
use glam::{DVec3, UVec3, Vec3};
use lumencast_codec::Epoch;
use lumencast_light::ProbeVolume;
use lumencast_scene::{Edit, InstanceSource, NodeId, Scene, Script, Transform};
use lumencast_server::{Inbox, Limits, Mail, Received, Report, SampleRange, Tick, TickOptions};
use lumencast_solve::{FitOptions, GatherOptions};
use lumencast_testkit::rooms::{Placed, Rooms};

#[test]
fn light_follows_an_edit() {
    let mut stepped = Stepped::new(options());
    stepped.steps(10);
    let before = stepped.mean_c0();
    assert!(before > 0.0);
    let lamp = stepped.node("lamp");
    let report = stepped.step(mail(1, dim(lamp, 300.0)));
    assert_eq!((report.accepted, report.refused), (1, 0));
    stepped.steps(5);
    let after = stepped.mean_c0();
    assert!(after > 3.0 * before, "{before} before, {after} with a hundred times the lamp");

    // Moved out of the box, to the far side of its back wall, it lights nothing inside.
    let away = Transform { translation: Some(Vec3::new(0.0, 1.0, -50.0)), ..Transform::default() };
    stepped.step(mail(2, Edit::MoveNode { node: lamp, transform: away }));
    stepped.steps(15);
    assert!(stepped.mean_c0() < 0.5 * after, "{after}, then {}", stepped.mean_c0());
}

/// With feedback, paths of one bounce bring the light of many.
#[test]
fn feedback_adds_the_bounces_that_paths_leave_out() {
    let light = |bounces, feedback| {
        let gather = GatherOptions { bounces, ..options().gather };
        let mut stepped = Stepped::new(TickOptions { feedback, gather, ..options() });
        stepped.steps(40);
        stepped.mean_c0()
    };
    let (all, alone, fed_back) = (light(24, false), light(1, false), light(1, true));
    assert!(alone < 0.85 * all, "{alone} {all}");
    assert!((fed_back / all - 1.0).abs() < 0.05, "{fed_back} {all}");
}

#[test]
fn a_refused_edit_changes_nothing() {
    let mut still = options();
    still.samples = SampleRange::fixed(16);
    let (mut edited, mut untouched) = (Stepped::new(still.clone()), Stepped::new(still));
    edited.steps(3);
    untouched.steps(4);
    let report = edited.step(mail(1, Edit::RemoveNode { node: NodeId(999) }));
    assert_eq!((report.accepted, report.refused), (0, 1));
    let state = edited.kept.states.last().expect("a frame");
    assert!(state.edits.is_empty());
    assert_eq!((state.refused[0].client.as_str(), state.refused[0].seq), ("a", 1));
    assert!(state.refused[0].reason.contains("999"), "{}", state.refused[0].reason);
    assert_eq!(edited.volume(), untouched.volume());
    assert_eq!(state.version, untouched.kept.states[3].version);
}

#[test]
fn edits_of_an_inbox_reach_the_scene_in_order() {
    let mut stepped = Stepped::new(options());
    let lamp = stepped.node("lamp");
    let mut inbox = Inbox::new(Limits::default());
    for (seq, intensity) in [(1, 5.0), (2, 7.0), (3, -1.0)] {
        let edit =
            lumencast_codec::ClientEdit { seq, edit: dim(lamp, intensity), temporary: false };
        inbox.receive("a", &edit.encode(), 0.0);
    }
    let report = stepped.step(inbox.take(0.0));
    assert_eq!((report.accepted, report.refused), (2, 1));
    let light = stepped.tick.scene().nodes().find(|n| n.id == lamp).and_then(|n| n.light);
    assert_eq!(light.map(|l| l.intensity), Some(7.0));
}

#[test]
fn additions_end_before_a_snapshot_grows_too_long() {
    let mut quick = options();
    quick.volumes[0].grid.resolution = UVec3::ONE;
    quick.samples = SampleRange::fixed(1);
    let mut stepped = Stepped::new(quick);
    let source =
        InstanceSource::Mesh(stepped.tick.scene().nodes().find_map(|n| n.mesh).expect("one"));
    let add = Edit::AddInstance {
        node: None,
        name: None,
        source,
        parent: None,
        transform: Transform {
            translation: Some(Vec3::new(0.1, 0.2, 0.3)),
            ..Transform::default()
        },
    };
    let many = |first: u64| Mail {
        edits: (first..first + 2000)
            .map(|seq| Received { client: "a".into(), seq, edit: add.clone(), temporary: false })
            .collect(),
        ..Mail::default()
    };
    let reports: Vec<Report> = (0..5).map(|i| stepped.step(many(1 + 2000 * i))).collect();
    assert_eq!(reports[0].refused, 0, "thousands are fine");
    assert_eq!(reports[4].accepted, 0, "but not any number");
    let reason = &stepped.kept.states[4].refused[0].reason;
    assert!(reason.contains("remove some"), "{reason}");
    stepped.steps(60);
    let frames = stepped.kept.states.iter().filter(|state| state.snapshot.is_some());
    let longest = frames.map(|state| state.encode().len()).max().expect("a snapshot");
    assert!(longest < lumencast_codec::limits::FRAME_BYTES, "{longest}");
}

#[test]
fn too_many_probes_are_refused_in_words() {
    let with = |resolution: [u32; 3], count: usize| {
        let mut huge = options();
        huge.volumes[0].grid.resolution = resolution.into();
        huge.volumes = vec![huge.volumes[0]; count];
        huge
    };
    let long = TickOptions { source: "x".repeat(129), ..options() };
    for (options, words) in [
        (with([u32::MAX; 3], 1), ["volume 0", "1 to 65536"]),
        (with([64, 32, 32], 9), ["volume 8", "589824"]),
        (long, ["source", "128"]),
    ] {
        let scene = Scene::builtin("cornell").expect("a built-in scene");
        let tracer = Box::new(tracer());
        let refused = Tick::new(scene, tracer, options, Epoch(0)).err().expect("refused");
        let error = refused.to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}

#[test]
fn a_script_gives_the_same_light_every_time() {
    let run = || {
        let mut scripted = options();
        scripted.samples = SampleRange::fixed(8);
        scripted.script = Some(script());
        let mut stepped = Stepped::new(scripted);
        stepped.steps(12);
        stepped
    };
    let (first, second) = (run(), run());
    let edits: usize = first.kept.states.iter().map(|state| state.edits.len()).sum();
    assert_eq!(edits, 2, "both edits of the script were due");
    assert!(first.kept.states.iter().flat_map(|s| &s.edits).all(|edit| edit.source.is_none()));
    assert_eq!(first.volume(), second.volume());
    assert!(first.kept.frames.iter().zip(&second.kept.frames).all(|(a, b)| a == b));
    assert_eq!(first.kept.frames.len(), second.kept.frames.len());

    let mut unscripted = options();
    unscripted.samples = SampleRange::fixed(8);
    let mut other = Stepped::new(unscripted);
    other.steps(12);
    assert_ne!(first.volume(), other.volume(), "the script does something");
}

fn script() -> Script {
    let scene = Scene::builtin("cornell").expect("a built-in scene");
    let lamp = scene.nodes().find(|node| node.name == "lamp").expect("a lamp").id;
    let line = |at: f64, intensity: f32| {
        let edit = serde_json::to_value(dim(lamp, intensity)).expect("JSON");
        serde_json::json!({ "at": at, "edit": edit }).to_string()
    };
    Script::parse(&format!("{}\n{}\n", line(0.1, 30.0), line(0.3, 0.0))).expect("a script")
}

/// In map coordinates, too, light stays in its room, at probes and fitted to surfaces.
#[test]
fn far_rooms_are_lit_as_near_ones() {
    let rooms = Rooms { at: DVec3::ZERO, placed: Placed::Flat, emission: 0.0 };
    let far = DVec3::new(1e6 + 0.37, 120.3, -1.3e6);
    for fit in [None, Some(FitOptions { points: 16 })] {
        let [near, far] = [DVec3::ZERO, far].map(|at| {
            let rooms = Rooms { at, ..rooms };
            let volume = |x: f32| {
                let mut volume = options().volumes[0];
                volume.grid.center = rooms.world(Vec3::new(x, 1.5, 0.0));
                volume.grid.size = Vec3::new(3.6, 2.6, 3.6);
                volume
            };
            let mut options = TickOptions { volumes: vec![volume(-2.0), volume(2.0)], ..options() };
            options.gather.fit = fit;
            let mut stepped = Stepped::of(rooms.scene(), Box::new(tracer()), options);
            stepped.steps(30);
            let mean = |volume: &ProbeVolume| {
                let sum: Vec3 = (0..volume.grid.probe_count()).map(|i| volume.probe(i)[0]).sum();
                sum.x / volume.grid.probe_count() as f32
            };
            let center = shape(&stepped.tick.catalog(), 1).grid.center;
            assert_eq!(center, rooms.world(Vec3::new(2.0, 1.5, 0.0)), "clients know the world's");
            volumes(&stepped).iter().map(mean).collect::<Vec<f32>>()
        });
        assert!((far[0] / near[0] - 1.0).abs() < 0.05, "{fit:?}: {far:?} {near:?}");
        // Fitting is precise to its last step only.
        let slack = if fit.is_some() { 1e-3 * near[0] } else { 0.0 };
        let dark = far[1].abs().max(near[1].abs());
        assert!(dark <= slack, "{fit:?}: light in the dark: {far:?} {near:?}");
    }
}
