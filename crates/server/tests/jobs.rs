//! Jobs that fail, are lost or take long, and what ticks make of them.

mod common;

use std::collections::HashSet;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use common::{Kept, PERIOD, Stepped, dim, mail, options, tracer, volumes};
use glam::UVec3;
use lumencast_codec::ProbeHeader;
use lumencast_gather::path_trace::CpuPathTracer;
use lumencast_gather::{Gather, Gathered, Job, Progress, Ticket};
use lumencast_server::{Mail, SampleRange, TickOptions};
use lumencast_solve::FitOptions;

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
        Self { inner: tracer(), submitted: 0, lost: HashSet::new(), loses }
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
        volume.grid.resolution = UVec3::splat(n);
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
        let info = ProbeHeader::read(&frame.bytes).expect("a header").info;
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
    let fit = Some(FitOptions { points: 8 });
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

#[test]
fn a_late_tick_takes_fewer_samples_next_time() {
    let mut slow = options();
    slow.volumes[0].grid.resolution = UVec3::ONE;
    slow.period = 0.1;
    slow.samples = SampleRange { min: 2, max: 20 };
    let a_sample = Arc::new(Mutex::new(Duration::ZERO));
    let gatherer = Slow { inner: tracer(), a_sample: a_sample.clone(), samples: 0 };
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
        let hold = Arc::new(AtomicBool::new(hold));
        Self { inner: tracer(), hold, submitted: Arc::default(), looks: Arc::default() }
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
    fitted.gather.fit = Some(FitOptions { points: 8 });
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
