//! Rays and the paths of probes, on one thread.
//!
//! ```sh
//! cargo bench -p lumencast-gather
//! ```

use std::num::NonZeroUsize;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lumencast_gather::measure::RayBench;
use lumencast_gather::path_trace::{CpuPathTracer, Levels, Options, Trees};
use lumencast_gather::{Gather, Job, Receiver};
use lumencast_scene::Scene;

const SCENES: [&str; 2] = ["cornell", "tomb"];
const RAYS: usize = 1 << 16;
const SAMPLES: u32 = 16;

fn one_thread() -> Options {
    Options { threads: NonZeroUsize::new(1), ..Options::default() }
}

/// Finding the nearest surface, and any surface, of rays that share nothing.
fn traversal(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("traversal");
    for name in SCENES {
        let mut scene = Scene::builtin(name).expect("a built-in scene");
        let view = scene.views()[0].view;
        let options = Options { levels: Levels::One, ..one_thread() };
        let bench = RayBench::new(&scene.snapshot(), view, RAYS, &options, Trees::Improved)
            .expect("a thread");
        group.throughput(Throughput::Elements(bench.closest.len() as u64));
        group.bench_function(format!("closest/{name}"), |b| {
            b.iter(|| bench.trace_closest(&bench.closest));
        });
        group.throughput(Throughput::Elements(bench.any.len() as u64));
        group.bench_function(format!("any/{name}"), |b| b.iter(|| bench.trace_any(&bench.any)));
    }
    group.finish();
}

/// A job of a server's tick: all rays of a path, and shading where they end.
fn shading(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("shading");
    for name in SCENES {
        let mut scene = Scene::builtin(name).expect("a built-in scene");
        let receivers: Arc<[Receiver]> =
            scene.volumes()[0].grid.positions().map(Receiver::probe).collect();
        let snapshot = scene.snapshot();
        let mut tracer = CpuPathTracer::new(one_thread()).expect("a thread");
        group.throughput(Throughput::Elements(receivers.len() as u64 * u64::from(SAMPLES)));
        group.bench_function(format!("probes/{name}"), |b| {
            b.iter(|| {
                let job = Job::new(snapshot.clone(), receivers.clone(), SAMPLES);
                let ticket = tracer.submit(job);
                tracer.wait(ticket).expect("light").rays
            });
        });
    }
    group.finish();
}

criterion_group!(tracing, traversal, shading);
criterion_main!(tracing);
