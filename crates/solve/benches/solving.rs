//! From sums to light: histories, and the fit to surfaces.
//!
//! ```sh
//! cargo bench -p lumencast-solve
//! ```

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use lumencast_gather::Gather;
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_scene::Scene;
use lumencast_solve::{Asked, FitEffort, FitOptions, GatherOptions, Request, Solver, Turn};

/// What a server's tick does.
const EFFORT: FitEffort = FitEffort { rounds: 1, steps: 4 };
const SAMPLES: u32 = 16;

/// A solver of cornell's volume that knows of the surfaces, and what a tick has brought it.
fn solver(fit: Option<FitOptions>) -> (Solver, Vec<(Asked, lumencast_gather::Gathered)>) {
    let mut scene = Scene::builtin("cornell").expect("a built-in scene");
    let mut tracer = CpuPathTracer::new(Options::default()).expect("threads");
    let options = GatherOptions { fit, ..GatherOptions::default() };
    let mut solver = Solver::new(&scene.volumes(), options).expect("a volume");
    let snapshot = scene.snapshot();
    let mut gather = |requests: Vec<Request>| -> Vec<_> {
        let wait = |Request { job, asked }| {
            let ticket = tracer.submit(job);
            (asked, tracer.wait(ticket).expect("light"))
        };
        requests.into_iter().map(wait).collect()
    };
    let ids: Vec<_> = solver.ids().collect();
    let looks = ids.iter().filter_map(|id| solver.look(*id, &snapshot)).collect();
    for (asked, found) in gather(looks) {
        solver.take(&asked, &found);
    }
    let turn = Turn { previous: None, samples: SAMPLES, lumels: None, pass: 0 };
    let jobs = ids.iter().filter_map(|id| solver.job(*id, &snapshot, turn.clone())).collect();
    let brought = gather(jobs);
    (solver, brought)
}

fn solving(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("solving");
    for (name, fit) in [("gathered", None), ("fitted", Some(FitOptions { points: 64 }))] {
        let (before, brought) = solver(fit);
        let take = |mut solver: Solver| {
            brought.iter().for_each(|(asked, gathered)| solver.take(asked, gathered));
            solver
        };
        group.throughput(Throughput::Elements(before.probe_count() as u64));
        group.bench_function(format!("take/{name}"), |b| {
            b.iter_batched(|| before.clone(), take, BatchSize::LargeInput);
        });
        let after = take(before.clone());
        let solve = |mut solver: Solver| {
            solver.solve(EFFORT);
            solver
        };
        group.bench_function(format!("solve/{name}"), |b| {
            b.iter_batched(|| after.clone(), solve, BatchSize::LargeInput);
        });
    }
    group.finish();
}

criterion_group!(benches, solving);
criterion_main!(benches);
