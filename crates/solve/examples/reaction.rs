//! How fast blended probes follow a lamp that jumps, and how much they flicker while nothing moves.
//!
//! `cargo run --release -p lumencast-solve --example reaction`
//!
//! Error: RMS over all probes and coefficients against the new steady light, as a share of what it
//! was before the jump. Flicker: mean change of the display value (c₀ over its 99th percentile,
//! gamma 2.2, of 255) from one update to the next.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::sync::Arc;

use glam::{Quat, UVec3, Vec3};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::{Gather, Gathered, Job, Receiver};
use lumencast_light::{Grid, Order};
use lumencast_scene::{LightKind, PunctualLight, Snapshot};
use lumencast_solve::blend::{BlendSettings, History};
use lumencast_testkit::scenes::{Stage, lambert};

const STILL: u64 = 500;
const AFTER: u64 = 600;

fn room(lamp: Vec3) -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::splat(0.73), Vec3::ZERO));
    let red = stage.material(lambert(Vec3::new(0.65, 0.05, 0.05), Vec3::ZERO));
    let glow = stage.material(lambert(Vec3::ZERO, Vec3::splat(0.5)));
    stage.room(Vec3::Y, Vec3::splat(2.0), white);
    stage.room(Vec3::new(-0.4, 0.6, -0.3), Vec3::new(-0.6, 1.2, 0.6), red);
    stage.quad(Vec3::new(-0.3, 1.99, -0.3), 0.6 * Vec3::X, 0.6 * Vec3::Z, glow);
    let light = PunctualLight {
        kind: LightKind::Point { radius: 0.0 },
        color: Vec3::ONE,
        intensity: 1.0,
        range: None,
    };
    stage.light(light, lamp, Vec3::NEG_Y);
    stage.snapshot()
}

fn gather(tracer: &mut CpuPathTracer, scene: &Arc<Snapshot>, samples: u32, seed: u64) -> Gathered {
    let grid = Grid {
        center: Vec3::Y,
        rotation: Quat::IDENTITY,
        size: Vec3::splat(2.0),
        resolution: UVec3::splat(8),
    };
    let receivers: Vec<_> = grid.positions().map(Receiver::probe).collect();
    let job = Job { clamp: 10.0, seed, ..Job::new(scene.clone(), receivers, samples) };
    let ticket = tracer.submit(job);
    tracer.wait(ticket).unwrap_or_else(|| unreachable!("nobody cancels"))
}

type Field = Vec<Vec<Vec3>>;

fn rms(a: &Field, b: &Field) -> f32 {
    let pairs = || a.iter().flatten().zip(b.iter().flatten());
    (pairs().map(|(a, b)| (a - b).length_squared()).sum::<f32>() / pairs().count() as f32).sqrt()
}

fn flicker(fields: &[Field]) -> f32 {
    let mut levels: Vec<f32> = fields[0].iter().map(|p| p[0].y).collect();
    levels.sort_by(f32::total_cmp);
    let white = levels[levels.len() * 99 / 100];
    let shown = |p: &[Vec3]| 255.0 * (p[0].y / white).clamp(0.0, 1.0).powf(1.0 / 2.2);
    let changes: Vec<f32> = fields
        .windows(2)
        .flat_map(|w| w[0].iter().zip(&w[1]).map(|(a, b)| (shown(a) - shown(b)).abs()))
        .collect();
    changes.iter().sum::<f32>() / changes.len() as f32
}

fn main() -> std::io::Result<()> {
    let mut tracer = CpuPathTracer::new(Options::default())?;
    let [before, after] = [Vec3::new(0.7, 1.7, 0.6), Vec3::new(-0.7, 0.4, 0.7)].map(room);
    let steady: Field = gather(&mut tracer, &after, 65_536, 99)
        .sums
        .iter()
        .map(|s| s.sum.iter().map(|c| c / s.count as f32).collect())
        .collect();
    println!("samples,significance,updates to 50 %,90 %,95 %,flicker of 255");
    for samples in [16, 64] {
        let updates: Vec<Gathered> = (0..STILL + AFTER)
            .map(|t| gather(&mut tracer, if t < STILL { &before } else { &after }, samples, t))
            .collect();
        for significance in [2.5, 3.0, 3.5, 4.0, 5.0, f32::INFINITY] {
            let settings = BlendSettings { ratio: 0.01, significance };
            let mut history =
                History::new(settings, updates[0].sums.len(), Order::L2.coefficients());
            let fields: Vec<Field> = updates
                .iter()
                .map(|u| {
                    history.update(u.sums.iter());
                    (0..history.len()).map(|i| history.coefficients(i).to_vec()).collect()
                })
                .collect();
            let (still, moved) = fields.split_at(STILL as usize);
            let at_jump = rms(&still[still.len() - 1], &steady);
            let errors: Vec<f32> = moved.iter().map(|f| rms(f, &steady) / at_jump).collect();
            let within =
                |share: f32| 1 + errors.iter().rposition(|&e| e > share).map_or(0, |i| i + 1);
            println!(
                "{samples},{significance},{},{},{},{:.3}",
                within(0.5),
                within(0.1),
                within(0.05),
                flicker(&still[300..]),
            );
        }
    }
    Ok(())
}
