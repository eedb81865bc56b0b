//! How fast probes are gathered: time of a tick, samples and rays a second.
//!
//! `cargo run --release -p lumencast-gather --example throughput`
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Instant;

use glam::{Quat, UVec3, Vec3};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::{Gather, Job, Receiver};
use lumencast_light::{Grid, Order};
use lumencast_scene::{Light, LightKind, Snapshot};
use lumencast_testkit::scenes::{Stage, lambert};

/// A box of 2 m with a sphere, a tall box, a lamp and a point light: about 4,100 triangles.
fn cornell() -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::splat(0.73), Vec3::ZERO));
    let red = stage.material(lambert(Vec3::new(0.65, 0.05, 0.05), Vec3::ZERO));
    let green = stage.material(lambert(Vec3::new(0.12, 0.45, 0.15), Vec3::ZERO));
    let lamp = stage.material(lambert(Vec3::ZERO, Vec3::splat(5.0)));
    let (x, y, z) = (2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z);
    stage.quad(Vec3::new(-1.0, 0.0, 1.0), x, -z, white);
    stage.quad(Vec3::new(-1.0, 2.0, -1.0), x, z, white);
    stage.quad(Vec3::new(-1.0, 0.0, -1.0), x, y, white);
    stage.quad(Vec3::new(-1.0, 0.0, 1.0), -z, y, red);
    stage.quad(Vec3::new(1.0, 0.0, -1.0), z, y, green);
    stage.quad(Vec3::new(-0.3, 1.99, -0.3), 0.3 * x, 0.3 * z, lamp);
    stage.room(Vec3::new(-0.4, 0.6, -0.3), Vec3::new(-0.6, 1.2, 0.6), white);
    stage.sphere(Vec3::new(0.4, 0.4, 0.3), 0.4, 32, white);
    let light = Light { kind: LightKind::Point, color: Vec3::ONE, intensity: 1.0, range: None };
    stage.light(light, Vec3::new(0.0, 1.8, 0.0), Vec3::NEG_Y);
    stage.snapshot()
}

fn measure(
    name: &str,
    scene: &Arc<Snapshot>,
    grid: Grid,
    samples: u32,
    bounces: u32,
    threads: usize,
) {
    let receivers: Arc<[_]> =
        grid.positions().map(|position| Receiver { position, samples }).collect();
    let threads = NonZeroUsize::new(threads);
    let Ok(mut tracer) = CpuPathTracer::new(Options { threads, ..Options::default() }) else {
        return;
    };
    let mut ticks = Vec::new();
    let mut rays = 0;
    for seed in 0..30 {
        let start = Instant::now();
        let job = Job {
            scene: scene.clone(),
            receivers: receivers.clone(),
            order: Order::L2,
            bounces,
            clamp: 10.0,
            seed,
        };
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

fn main() {
    let scene = cornell();
    let grid = Grid {
        center: Vec3::Y,
        rotation: Quat::IDENTITY,
        size: Vec3::splat(2.0),
        resolution: UVec3::splat(8),
    };
    for threads in [1, 2] {
        for samples in [16, 64] {
            measure(&format!("cornell, {threads} threads"), &scene, grid, samples, 3, threads);
        }
    }
}
