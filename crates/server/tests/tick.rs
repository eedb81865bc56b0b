//! The tick, stepped by hand: no network, no clock but the test's own.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use glam::{DVec3, Vec3};
use lumencast_codec::{
    Catalog, EncodedRegion, Epoch, ProbeDecoder, ProbeHeader, StateFrame, VolumeShape,
};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::{Gather, Gathered, Job, Progress, Ticket};
use lumencast_light::ProbeVolume;
use lumencast_scene::{
    Edit, InstanceSource, LightSpec, NodeId, Scene, Script, Transform, VolumeSpec,
};
use lumencast_server::{
    Inbox, Limits, Mail, Outlet, Received, Report, SampleRange, Tick, TickOptions,
};
use lumencast_solve::GatherOptions;
use lumencast_testkit::rooms::{Placed, Rooms};

const PERIOD: f64 = 0.04;

/// Keeps what a tick sends.
#[derive(Default)]
struct Kept {
    catalogs: Vec<Catalog>,
    states: Vec<StateFrame>,
    frames: Vec<(u32, EncodedRegion)>,
    unwatched: bool,
}

impl Outlet for Kept {
    fn is_watched(&self, _: u32, _: u32) -> bool {
        !self.unwatched
    }

    fn catalog(&mut self, catalog: &Catalog) {
        self.catalogs.push(Catalog::decode(&catalog.encode()).expect("a catalog"));
    }

    fn state(&mut self, frame: Vec<u8>, new_group: bool) {
        let state = StateFrame::decode(&frame).expect("a state frame");
        assert_eq!(new_group, state.snapshot.is_some(), "a snapshot begins a group");
        self.states.push(state);
    }

    fn light(&mut self, field: u32, frame: EncodedRegion) {
        self.frames.push((field, frame));
    }
}

/// The volumes in the order in which they were asked for.
fn volumes(stepped: &Stepped) -> Vec<ProbeVolume> {
    let mut volumes: Vec<ProbeVolume> = stepped.tick.light().volumes().cloned().collect();
    volumes.sort_by_key(|volume| volume.id);
    volumes
}

/// The shape of a catalog's volume.
fn shape(catalog: &Catalog, field: usize) -> VolumeShape {
    catalog.fields[field].shape.as_volume().expect("a volume").clone()
}

/// A cornell with few probes, and the kept frames.
struct Stepped {
    tick: Tick,
    kept: Kept,
    now: f64,
}

impl Stepped {
    fn new(options: TickOptions) -> Self {
        let tracer = CpuPathTracer::new(Options::default()).expect("threads");
        Self::with(options, Box::new(tracer))
    }

    fn with(options: TickOptions, gatherer: Box<dyn Gather>) -> Self {
        let scene = Scene::builtin("cornell").expect("a built-in scene");
        let tick = Tick::new(scene, gatherer, options, Epoch(7)).expect("a tick");
        Self { tick, kept: Kept::default(), now: 0.0 }
    }

    fn step(&mut self, mail: Mail) -> Report {
        let report = self.tick.step(self.now, mail, &mut self.kept);
        self.now += PERIOD;
        report
    }

    fn steps(&mut self, n: usize) {
        for _ in 0..n {
            self.step(Mail::default());
        }
    }

    fn node(&self, name: &str) -> NodeId {
        self.tick.scene().nodes().find(|node| node.name == name).expect(name).id
    }

    fn volume(&self) -> &ProbeVolume {
        self.tick.light().volumes().next().expect("a volume")
    }

    fn mean_c0(&self) -> f32 {
        let volume = self.volume();
        let sum: Vec3 = (0..volume.grid.probe_count()).map(|i| volume.probe(i)[0]).sum();
        sum.element_sum() / volume.grid.probe_count() as f32
    }
}

fn options() -> TickOptions {
    let scene = Scene::builtin("cornell").expect("a built-in scene");
    let mut volume: VolumeSpec = scene.volumes()[0];
    volume.grid.resolution = glam::UVec3::splat(3);
    TickOptions {
        period: PERIOD,
        samples: SampleRange::fixed(64),
        volumes: vec![volume],
        ..TickOptions::default()
    }
}

fn mail(seq: u64, edit: Edit) -> Mail {
    let received = Received { client: "a".into(), seq, edit, temporary: false };
    Mail { edits: vec![received], acks: BTreeMap::from([("a".into(), seq)]), ..Mail::default() }
}

fn dim(node: NodeId, intensity: f32) -> Edit {
    Edit::SetLight { node, light: LightSpec { intensity: Some(intensity), ..LightSpec::default() } }
}

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
fn state_tells_of_edits_and_the_version_of_the_light() {
    let mut stepped = Stepped::new(options());
    let lamp = stepped.node("lamp");
    stepped.steps(2);
    stepped.step(mail(5, dim(lamp, 2.0)));
    let state = stepped.kept.states.last().expect("a frame a tick");
    assert_eq!(state.edits.len(), 1);
    assert_eq!(state.edits[0].source, Some(("a".into(), 5)));
    assert_eq!(state.edits[0].edit, dim(lamp, 2.0));
    assert_eq!(state.tick, 2);
    assert!((state.time - 2.0 * PERIOD).abs() < 1e-9, "{}", state.time);
    let (_, frame) = stepped.kept.frames.last().expect("light");
    let header = lumencast_codec::ProbeHeader::read(&frame.bytes).expect("a header");
    assert_eq!((header.info.scene_version, header.info.tick), (state.version, 2));

    // Those who join later learn of it from a snapshot.
    stepped.steps(70);
    let snapshots: Vec<_> =
        stepped.kept.states.iter().filter_map(|state| state.snapshot.as_ref()).collect();
    assert_eq!(snapshots.len(), 2, "at the first tick and after 64");
    let told = snapshots[1].edits.iter().any(|edit| {
        matches!(edit, Edit::SetLight { node, light }
        if *node == lamp && light.intensity == Some(2.0))
    });
    assert!(told, "{:?}", snapshots[1].edits);
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

/// In map coordinates, too, light stays in its room, at probes and fitted to surfaces.
#[test]
fn far_rooms_are_lit_as_near_ones() {
    let rooms = Rooms { at: DVec3::ZERO, placed: Placed::Flat, emission: 0.0 };
    let far = DVec3::new(1e6 + 0.37, 120.3, -1.3e6);
    for fit in [None, Some(lumencast_solve::FitOptions { points: 16 })] {
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
            let tracer = Box::new(CpuPathTracer::new(Options::default()).expect("threads"));
            let tick = Tick::new(rooms.scene(), tracer, options, Epoch(7)).expect("a tick");
            let mut stepped = Stepped { tick, kept: Kept::default(), now: 0.0 };
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

/// A gatherer that is as slow as the test wants.
struct Slow {
    inner: CpuPathTracer,
    a_sample: Arc<Mutex<Duration>>,
    samples: u32,
}

impl Gather for Slow {
    fn submit(&mut self, job: Job) -> Ticket {
        self.samples = job.budgets[0].samples;
        self.inner.submit(job)
    }

    fn poll(&mut self, ticket: Ticket) -> Progress {
        self.inner.poll(ticket)
    }

    fn wait(&mut self, ticket: Ticket) -> Option<Gathered> {
        std::thread::sleep(*self.a_sample.lock().expect("no panic") * self.samples);
        self.inner.wait(ticket)
    }

    fn cancel(&mut self, ticket: Ticket) {
        self.inner.cancel(ticket);
    }
}

/// A gatherer that loses chosen jobs.
struct Losing {
    inner: CpuPathTracer,
    submitted: u64,
    lost: HashSet<Ticket>,
    /// By how many were submitted before.
    loses: fn(u64) -> bool,
}

impl Losing {
    fn new(loses: fn(u64) -> bool) -> Self {
        let inner = CpuPathTracer::new(Options::default()).expect("threads");
        Self { inner, submitted: 0, lost: HashSet::new(), loses }
    }
}

impl Gather for Losing {
    fn submit(&mut self, job: Job) -> Ticket {
        let ticket = self.inner.submit(job);
        if (self.loses)(self.submitted) {
            self.inner.cancel(ticket);
            self.lost.insert(ticket);
        }
        self.submitted += 1;
        ticket
    }

    fn poll(&mut self, ticket: Ticket) -> Progress {
        self.inner.poll(ticket)
    }

    fn wait(&mut self, ticket: Ticket) -> Option<Gathered> {
        if self.lost.contains(&ticket) { None } else { self.inner.wait(ticket) }
    }

    fn cancel(&mut self, ticket: Ticket) {
        self.inner.cancel(ticket);
    }
}

/// Three fields, each of other numbers of probes.
fn three_fields() -> TickOptions {
    let mut three = options();
    let volume = three.volumes[0];
    let of = |n| {
        let mut volume = volume;
        volume.grid.resolution = glam::UVec3::splat(n);
        volume
    };
    three.volumes = vec![of(3), of(2), of(3)];
    three.samples = SampleRange::fixed(16);
    three
}

#[test]
fn a_field_whose_job_fails_keeps_its_light() {
    let [mut sound, mut losing] = [0, 1].map(|n| {
        // Of the third tick the first field's job, of the fourth the second's.
        let loses: fn(u64) -> bool = if n == 0 { |_| false } else { |n| n == 6 || n == 10 };
        Stepped::with(three_fields(), Box::new(Losing::new(loses)))
    });
    sound.steps(2);
    losing.steps(2);
    let before = volumes(&losing);
    assert_eq!(before, volumes(&sound));

    let lamp = sound.node("lamp");
    sound.step(mail(1, dim(lamp, 300.0)));
    losing.step(mail(1, dim(lamp, 300.0)));
    let (expected, kept) = (volumes(&sound), volumes(&losing));
    assert_eq!(kept[0], before[0], "it keeps its light");
    assert_ne!(expected[0], before[0]);
    assert_eq!(kept[1..], expected[1..], "the others have theirs");

    // Clients learn which moment each shows.
    let told = |field| {
        let (_, frame) = losing.kept.frames.iter().rfind(|(f, _)| *f == field).expect("light");
        let info = lumencast_codec::ProbeHeader::read(&frame.bytes).expect("a header").info;
        (info.tick, info.scene_version)
    };
    let versions: Vec<u64> = losing.kept.states.iter().map(|state| state.version).collect();
    assert_eq!(told(0), (1, versions[1]));
    assert_eq!(told(1), (2, versions[2]));
    assert!(versions[1] < versions[2]);

    let before = volumes(&losing);
    sound.steps(1);
    losing.steps(1);
    let (expected, kept) = (volumes(&sound), volumes(&losing));
    assert_eq!(kept[1], before[1]);
    assert_eq!(kept[2], expected[2]);
    assert_ne!(kept[0], before[0], "the next job counts");
}

/// Surfaces that could not be looked for are looked for again.
#[test]
fn a_field_whose_look_fails_looks_again() {
    let fit = Some(lumencast_solve::FitOptions { points: 8 });
    let with = |loses| {
        let mut options = three_fields();
        options.gather.fit = fit;
        options.volumes.truncate(2);
        Stepped::with(options, Box::new(Losing::new(loses)))
    };
    // The first tick's jobs: two looks, then the light.
    let (mut sound, mut losing) = (with(|_| false), with(|n| n == 0));
    sound.steps(1);
    losing.steps(1);
    assert_ne!(volumes(&losing)[0], volumes(&sound)[0], "fitted to nothing");
    // Volumes are fitted together: the other one's light is another as well, but light.
    assert!(
        volumes(&losing).iter().all(|volume| volume.coefficients.iter().all(|c| c.is_finite()))
    );
    sound.steps(60);
    losing.steps(60);
    let [a, b] = [&losing, &sound].map(Stepped::mean_c0);
    assert!((a / b - 1.0).abs() < 0.05, "{a} {b}");
}

/// Counts warnings that name a field.
#[derive(Clone, Default)]
struct Warnings(Arc<Mutex<Vec<u64>>>);

impl tracing::Subscriber for Warnings {
    fn enabled(&self, metadata: &tracing::Metadata<'_>) -> bool {
        *metadata.level() == tracing::Level::WARN
    }

    fn new_span(&self, _: &tracing::span::Attributes<'_>) -> tracing::span::Id {
        tracing::span::Id::from_u64(1)
    }

    fn record(&self, _: &tracing::span::Id, _: &tracing::span::Record<'_>) {}

    fn record_follows_from(&self, _: &tracing::span::Id, _: &tracing::span::Id) {}

    fn event(&self, event: &tracing::Event<'_>) {
        struct FieldNumber(Option<u64>);
        impl tracing::field::Visit for FieldNumber {
            fn record_u64(&mut self, field: &tracing::field::Field, value: u64) {
                if field.name() == "field" {
                    self.0 = Some(value);
                }
            }

            fn record_debug(&mut self, _: &tracing::field::Field, _: &dyn std::fmt::Debug) {}
        }
        let mut number = FieldNumber(None);
        event.record(&mut number);
        self.0.lock().expect("no panic").extend(number.0);
    }

    fn enter(&self, _: &tracing::span::Id) {}

    fn exit(&self, _: &tracing::span::Id) {}
}

#[test]
fn failing_jobs_are_told_and_do_not_flood() {
    let warnings = Warnings::default();
    tracing::subscriber::with_default(warnings.clone(), || {
        // The second field's jobs, all of them.
        let mut options = three_fields();
        options.samples = SampleRange::fixed(1);
        let mut losing = Stepped::with(options, Box::new(Losing::new(|n| n % 3 == 1)));
        losing.steps(100);
        assert!(losing.kept.frames.iter().all(|(field, _)| *field != 1), "it has no light");
    });
    // After 1, 2, 4, … 64 failures.
    assert_eq!(*warnings.0.lock().expect("no panic"), [1; 7]);
}

#[test]
fn a_late_tick_takes_fewer_samples_next_time() {
    let mut slow = options();
    slow.volumes[0].grid.resolution = glam::UVec3::ONE;
    slow.period = 0.1;
    slow.samples = SampleRange { min: 2, max: 20 };
    let a_sample = Arc::new(Mutex::new(Duration::ZERO));
    let inner = CpuPathTracer::new(Options::default()).expect("threads");
    let gatherer = Slow { inner, a_sample: a_sample.clone(), samples: 0 };
    let mut stepped = Stepped::with(slow, Box::new(gatherer));
    stepped.steps(20);
    assert_eq!(stepped.step(Mail::default()).samples_a_probe, 20, "there is time for all");

    *a_sample.lock().expect("no panic") = Duration::from_millis(10);
    let late = stepped.step(Mail::default());
    assert!(late.late && late.samples_a_probe == 20, "20 samples of 10 ms in 100 ms");
    let next = stepped.step(Mail::default());
    assert!(next.samples_a_probe <= 10, "{}", next.samples_a_probe);
    assert_eq!(stepped.kept.states.last().map(|s| s.samples), Some(20.0), "of the last tick");
    stepped.steps(1);
    assert_eq!(stepped.kept.states.last().map(|s| s.samples), Some(next.samples_a_probe.into()));
}

/// A gatherer whose jobs are done only while nobody holds them.
struct Held {
    inner: CpuPathTracer,
    hold: Arc<AtomicBool>,
    submitted: Arc<AtomicU64>,
    /// Of them, those that looked for surfaces.
    looks: Arc<AtomicU64>,
}

impl Held {
    fn new(hold: bool) -> Self {
        let inner = CpuPathTracer::new(Options::default()).expect("threads");
        let hold = Arc::new(AtomicBool::new(hold));
        Self { inner, hold, submitted: Arc::default(), looks: Arc::default() }
    }
}

impl Gather for Held {
    fn submit(&mut self, job: Job) -> Ticket {
        self.submitted.fetch_add(1, Ordering::Relaxed);
        self.looks.fetch_add(job.surfaces.into(), Ordering::Relaxed);
        self.inner.submit(job)
    }

    fn poll(&mut self, ticket: Ticket) -> Progress {
        match self.hold.load(Ordering::Relaxed) {
            true => Progress::Working(0.5),
            false => self.inner.poll(ticket),
        }
    }

    fn wait(&mut self, ticket: Ticket) -> Option<Gathered> {
        self.inner.wait(ticket)
    }

    fn cancel(&mut self, ticket: Ticket) {
        self.inner.cancel(ticket);
    }
}

/// A job that takes longer than a tick goes on beside those that follow, which edit the scene and tell of
/// it all the same.
#[test]
fn ticks_go_on_while_a_job_takes_long() {
    let held = Held::new(true);
    let (hold, submitted) = (held.hold.clone(), held.submitted.clone());
    let mut stepped = Stepped::with(options(), Box::new(held));
    let lamp = stepped.node("lamp");
    let mut step = |mail, patience| {
        stepped.now += PERIOD;
        stepped.tick.step_within(stepped.now, mail, &mut stepped.kept, patience)
    };
    for seq in 1..=3 {
        let report = step(mail(seq, dim(lamp, 100.0)), Duration::ZERO);
        assert_eq!((report.accepted, report.rays, report.samples), (1, 0, 0));
        assert!(report.late, "its light is missing");
    }
    assert_eq!(submitted.load(Ordering::Relaxed), 1, "one job a field at a time");

    hold.store(false, Ordering::Relaxed);
    while step(Mail::default(), Duration::from_secs(60)).rays == 0 {
        std::thread::yield_now();
    }
    let Kept { states, frames, .. } = &stepped.kept;
    assert!(states.len() > 3 && (0..).zip(states).all(|(tick, state)| state.tick == tick));
    let shown = ProbeHeader::read(&frames.last().expect("light").1.bytes).unwrap().info;
    assert_eq!(shown.update, 0, "there was no light before");
}

/// Where looks for surfaces outlast ticks and the scene changes in each, light is gathered all the same.
#[test]
fn looks_that_take_long_leave_room_for_light() {
    let held = Held::new(false);
    let (submitted, looks) = (held.submitted.clone(), held.looks.clone());
    let mut fitted = options();
    fitted.gather.fit = Some(lumencast_solve::FitOptions { points: 8 });
    let mut stepped = Stepped::with(fitted, Box::new(held));
    let lamp = stepped.node("lamp");
    let mut seq = 0;
    while submitted.load(Ordering::Relaxed) < 8 {
        seq += 1;
        stepped.now += PERIOD;
        let mail = mail(seq, dim(lamp, 100.0 + seq as f32));
        stepped.tick.step_within(stepped.now, mail, &mut stepped.kept, Duration::ZERO);
        std::thread::yield_now();
    }
    let looks = looks.load(Ordering::Relaxed);
    assert!((3..=5).contains(&looks), "{looks} of 8 jobs look for surfaces");
}

/// Volumes come and go while ticks go on: clients are told in the next catalog, what stays keeps its
/// light and its updates, and numbers are never used again.
#[test]
fn fields_come_and_go() {
    let mut stepped = Stepped::new(options());
    stepped.steps(3);
    let mut first: VolumeSpec = Scene::builtin("cornell").unwrap().volumes()[0];
    let own = stepped.volume();
    (first.grid, first.order) = (own.grid, own.order);
    let mut second = first;
    second.grid.center.x += 0.5;
    let ids = |stepped: &Stepped| -> Vec<u32> {
        stepped.tick.catalog().fields.iter().map(|field| field.id).collect()
    };
    let updates = |stepped: &Stepped, field: u32| -> Vec<u64> {
        let of_field = stepped.kept.frames.iter().filter(|(id, _)| *id == field);
        let update = |frame: &EncodedRegion| ProbeHeader::read(&frame.bytes).unwrap().info.update;
        of_field.map(|(_, frame)| update(frame)).collect()
    };

    stepped.tick.set_volumes(&[first, second]).unwrap();
    let before = stepped.kept.catalogs.len();
    stepped.steps(1);
    assert_eq!(ids(&stepped), [0, 1]);
    assert_eq!(stepped.kept.catalogs[before].fields.len(), 2, "told before their light");
    assert_eq!((updates(&stepped, 0), updates(&stepped, 1)), (vec![0, 1, 2, 3], vec![0]));

    stepped.tick.set_volumes(&[second]).unwrap();
    stepped.steps(1);
    stepped.tick.set_volumes(&[second, first]).unwrap();
    stepped.steps(1);
    assert_eq!(ids(&stepped), [1, 2]);
    assert_eq!(updates(&stepped, 1), [0, 1, 2]);
    assert_eq!((updates(&stepped, 0).len(), updates(&stepped, 2)), (4, vec![0]));

    second.grid.resolution.x = 0;
    assert!(stepped.tick.set_volumes(&[second]).is_err());
    assert_eq!(ids(&stepped), [1, 2]);
}

#[test]
fn what_is_sent_decodes_to_the_light() {
    let mut stepped = Stepped::new(options());
    stepped.steps(9);
    let field = shape(&stepped.tick.catalog(), 0);
    let mut decoders: Vec<ProbeDecoder> =
        field.regions.iter().map(|r| ProbeDecoder::new(r.size, field.order)).collect();
    let mut last = None;
    for (_, frame) in &stepped.kept.frames {
        let light = decoders[frame.region as usize].decode(&frame.bytes).expect("a frame");
        last = Some(light);
    }
    let light = last.expect("light");
    assert_eq!(light.header.info.update, 8);
    let volume = stepped.volume();
    let n = field.order.coefficients();
    for probe in 0..volume.grid.probe_count() {
        let (sent, held) = (&light.coefficients[probe * n..][..n], volume.probe(probe));
        let error: f32 = sent.iter().zip(held).map(|(a, b)| (*a - *b).length_squared()).sum();
        let rms = (error / (3 * n) as f32).sqrt();
        assert!(rms < 0.02 * held[0].length(), "probe {probe}: {rms} of {}", held[0]);
    }
}

#[test]
fn what_nobody_watches_is_not_encoded() {
    let mut stepped = Stepped::new(options());
    stepped.kept.unwatched = true;
    stepped.steps(5);
    assert!(stepped.kept.frames.is_empty());
    assert_eq!(stepped.kept.states.len(), 5, "the state is");
    stepped.kept.unwatched = false;
    stepped.steps(8);
    let (_, first) = stepped.kept.frames.first().expect("light");
    assert!(first.new_group && first.layer == 0, "it begins with a keyframe");
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
    quick.volumes[0].grid.resolution = glam::UVec3::ONE;
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
        let tracer = Box::new(CpuPathTracer::new(Options::default()).expect("threads"));
        let refused = Tick::new(scene, tracer, options, Epoch(0)).err().expect("refused");
        let error = refused.to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}

#[test]
fn a_volume_too_deep_for_clients_is_sent_in_pieces() {
    let mut deep = options();
    deep.volumes[0].grid.resolution = glam::UVec3::new(1, 2, 40);
    let whole = deep.volumes[0].grid;
    let mut stepped = Stepped::new(deep);
    let catalog = Catalog::decode(&stepped.tick.catalog().encode()).expect("a catalog");
    let fields: Vec<_> = catalog
        .fields
        .iter()
        .map(|f| (f.id, f.shape.as_volume().unwrap().grid.resolution.z))
        .collect();
    assert_eq!(fields, [(0, 20), (1, 20)]);
    stepped.steps(1);
    let sent: BTreeSet<u32> = stepped.kept.frames.iter().map(|(field, _)| *field).collect();
    assert_eq!(sent, BTreeSet::from([0, 1]));
    let probes = stepped.tick.light().volumes().flat_map(|volume| volume.grid.positions());
    for (probe, of_whole) in probes.zip(whole.positions()) {
        assert!(probe.distance(of_whole) < 1e-5, "{probe} {of_whole}");
    }
}

#[test]
fn light_at_both_ends_of_the_scale_is_carried() {
    for (intensity, low, high) in [(1e-3, 1e-6, 1.0), (1e6, 1e3, 1e9)] {
        let mut stepped = Stepped::new(options());
        let lamp = stepped.node("lamp");
        let dark = Edit::SetMaterial {
            material: emissive(&stepped),
            change: lumencast_scene::MaterialChange {
                emissive: Some(Vec3::ZERO),
                ..Default::default()
            },
        };
        stepped.step(mail(1, dark));
        stepped.step(mail(2, dim(lamp, intensity)));
        stepped.steps(10);
        let c0 = stepped.mean_c0();
        assert!(c0 > low && c0 < high, "{intensity} cd: {c0}");
        let (_, frame) = stepped.kept.frames.iter().rfind(|(_, f)| f.layer == 0).expect("light");
        assert!(frame.error < 0.01, "{intensity} cd: {}", frame.error);
    }
}

#[test]
fn the_catalog_is_sent_again_when_a_scale_changes() {
    let scales = |catalogs: &[Catalog]| -> Vec<_> {
        catalogs.iter().map(|catalog| catalog.fields[0].scale_log2).collect()
    };
    let mut stepped = Stepped::new(options());
    assert_eq!(stepped.tick.catalog().fields[0].scale_log2, None, "before there is light");
    stepped.steps(30);
    let told = scales(&stepped.kept.catalogs);
    assert_eq!(told.len(), 1, "once there is light: {told:?}");
    let largest = stepped.volume().coefficients.iter().map(|c| c.abs().max_element());
    let ratio = largest.fold(0.0, f32::max) / f32::from(told[0].expect("a scale")).exp2();
    assert!((0.25..2.0).contains(&ratio), "the largest coefficient is {ratio} of the scale");

    // A light that flickers changes the scale with every tick; slow links are not to suffer.
    let lamp = stepped.node("lamp");
    stepped.kept.catalogs.clear();
    for seq in 1..=50 {
        stepped.step(mail(seq, dim(lamp, if seq % 2 == 1 { 1e8 } else { 1e3 })));
    }
    assert_eq!(stepped.kept.catalogs.len(), 2, "{:?}", scales(&stepped.kept.catalogs));
    stepped.steps(100);
    let last = stepped.kept.catalogs.last().expect("catalogs");
    assert_eq!(last, &stepped.tick.catalog(), "the last is true in the end");
    assert!(stepped.kept.catalogs.iter().all(|c| c.fields[0].shape == last.fields[0].shape));
}

/// The material of the ceiling light.
fn emissive(stepped: &Stepped) -> lumencast_scene::MaterialId {
    let materials = stepped.tick.scene().materials();
    let index = materials.iter().position(|m| m.emissive != Vec3::ZERO).expect("one shines");
    lumencast_scene::MaterialId(index as u32)
}
