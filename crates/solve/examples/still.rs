//! How blended probes of a scene settle while nothing changes, with and without following changes:
//! what following costs in accuracy where the light is noisy.
//!
//! `cargo run --release -p lumencast-solve --example still -- door`
//!
//! Error: of a probe's c₀ relative to a converged one, over all probes of the first volume.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use glam::Vec3;
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::{Gather, Job, Receiver, Sums};
use lumencast_light::Order;
use lumencast_scene::Scene;
use lumencast_solve::blend::{BlendSettings, History};

const UPDATES: u64 = 600;
const SHOWN: [u64; 6] = [10, 50, 100, 200, 400, 600];
const SAMPLES: u32 = 32;
const CONVERGED: u32 = 32_768;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "door".into());
    let mut scene = Scene::open(&name)?;
    let snapshot = scene.snapshot();
    let grid = scene.volumes()[0].grid;
    let mut tracer = CpuPathTracer::new(Options::default())?;
    let mut gather = |samples: u32, seed: u64| -> Sums {
        let receivers: Vec<_> = grid.positions().map(Receiver::probe).collect();
        let (scene, clamp) = (snapshot.clone(), f32::INFINITY);
        let ticket = tracer.submit(Job { clamp, seed, ..Job::new(scene, receivers, samples) });
        tracer.wait(ticket).map_or_else(Sums::default, |gathered| gathered.sums)
    };
    let converged: Vec<f32> =
        gather(CONVERGED, UPDATES).iter().map(|s| s.sum[0].y / s.count as f32).collect();
    let mean = converged.iter().sum::<f32>() / converged.len() as f32;

    let mut histories: Vec<(f32, History)> = [2.5, 3.5, 5.0, f32::INFINITY]
        .map(|significance| {
            let settings = BlendSettings { significance, ..BlendSettings::default() };
            (significance, History::new(settings, converged.len(), Order::L2.coefficients()))
        })
        .into();
    println!("updates,significance,median error,95 %,largest");
    for update in 1..=UPDATES {
        let sums = gather(SAMPLES, update);
        for (significance, history) in &mut histories {
            history.update(sums.iter());
            if SHOWN.contains(&update) {
                let error = |(i, exact): (usize, &f32)| {
                    let c0: Vec3 = history.coefficients(i)[0];
                    ((c0.y - exact) / exact.max(0.01 * mean)).abs()
                };
                let mut errors: Vec<f32> = converged.iter().enumerate().map(error).collect();
                errors.sort_by(f32::total_cmp);
                let at = |share: usize| errors[(errors.len() - 1) * share / 100];
                let (median, most, worst) = (at(50), at(95), at(100));
                println!("{update},{significance},{median:.3},{most:.3},{worst:.2}");
            }
        }
    }
    Ok(())
}
