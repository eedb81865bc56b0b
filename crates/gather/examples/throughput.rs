//! How fast probes are gathered: time of a tick, samples and rays a second.
//!
//! `cargo run --release -p lumencast-gather --example throughput -- cornell PATH/Sponza.glb`
//!
//! The built-in `cornell` is measured with 8×8×8 probes, others with 10×6×7 over their bounds.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Instant;

use glam::{Quat, UVec3};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::{Gather, Job, Receiver};
use lumencast_light::Grid;
use lumencast_scene::{Scene, Snapshot};

fn measure(
    name: &str,
    scene: &Arc<Snapshot>,
    grid: Grid,
    samples: u32,
    bounces: u32,
    threads: usize,
) {
    let receivers: Arc<[_]> = grid.positions().map(Receiver::probe).collect();
    let threads = NonZeroUsize::new(threads);
    let Ok(mut tracer) = CpuPathTracer::new(Options { threads, ..Options::default() }) else {
        return;
    };
    let mut ticks = Vec::new();
    let mut rays = 0;
    for seed in 0..30 {
        let start = Instant::now();
        let job = Job::new(scene.clone(), receivers.clone(), samples);
        let job = Job { bounces, clamp: 10.0, seed, ..job };
        let ticket = tracer.submit(job);
        let Some(gathered) = tracer.wait(ticket) else { return };
        ticks.push(start.elapsed().as_secs_f64());
        rays = gathered.rays;
    }
    ticks.sort_by(f64::total_cmp);
    let (median, worst) = (ticks[ticks.len() / 2], ticks[ticks.len() - 2]);
    let total = grid.probe_count() as f64 * f64::from(samples);
    println!(
        "{name}: {} probes × {samples} samples, {bounces} bounces: median {:.1} ms, second worst {:.1} ms; {:.2} M samples/s, {:.2} M rays/s",
        grid.probe_count(),
        1e3 * median,
        1e3 * worst,
        1e-6 * total / median,
        1e-6 * rays as f64 / median,
    );
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let names: Vec<String> = std::env::args().skip(1).collect();
    let names = if names.is_empty() { vec!["cornell".into()] } else { names };
    for name in &names {
        let mut scene = Scene::open(name)?;
        let bounds = scene.bounds();
        let resolution = if name == "cornell" { UVec3::splat(8) } else { UVec3::new(10, 6, 7) };
        let (center, size) = (0.5 * (bounds.min + bounds.max), bounds.max - bounds.min);
        let grid = Grid { center, rotation: Quat::IDENTITY, size, resolution };
        for threads in [1, 2] {
            for samples in [16, 64] {
                measure(
                    &format!("{name}, {threads} threads"),
                    &scene.snapshot(),
                    grid,
                    samples,
                    3,
                    threads,
                );
            }
        }
    }
    Ok(())
}
