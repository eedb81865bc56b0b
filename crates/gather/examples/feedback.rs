//! What feedback ([`Job::previous`]) gains and costs: the light of many bounces, estimated with few
//! and the field of the job before, and with as many and without it.
//!
//! `cargo run --release -p lumencast-gather --example feedback -- cornell tomb PATH/Sponza.glb`
//!
//! The built-in `cornell` is measured with 8×8×8 probes, others with 10×6×7 over their bounds. What
//! is printed for each way: the root mean square difference of all coefficients from those of 32
//! bounces, relative to their root mean square, the difference of the mean c₀, and rays a sample.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::sync::Arc;

use glam::{Quat, UVec3, Vec3};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::{Gather, Job, Receiver};
use lumencast_light::{FieldId, Grid, Light, Order, ProbeVolume};
use lumencast_scene::{Scene, Snapshot};

/// Jobs until feedback has settled, and samples a probe of each but the last.
const JOBS: u64 = 12;
const SAMPLES: u32 = 256;
/// Samples a probe of what is compared.
const COMPARED: u32 = 4096;
const ALL_BOUNCES: u32 = 32;

struct Bench {
    scene: Arc<Snapshot>,
    grid: Grid,
    tracer: CpuPathTracer,
}

impl Bench {
    fn new(name: &str) -> Result<Self, Box<dyn std::error::Error>> {
        let mut scene = Scene::open(name)?;
        let bounds = scene.bounds();
        let resolution = if name == "cornell" { UVec3::splat(8) } else { UVec3::new(10, 6, 7) };
        let grid = Grid {
            center: 0.5 * (bounds.min + bounds.max),
            rotation: Quat::IDENTITY,
            size: bounds.max - bounds.min,
            resolution,
        };
        let tracer = CpuPathTracer::new(Options::default())?;
        Ok(Self { scene: scene.snapshot(), grid, tracer })
    }

    /// The field of one job, and its rays a sample.
    fn gather(
        &mut self,
        samples: u32,
        bounces: u32,
        previous: Option<Arc<Light>>,
        seed: u64,
    ) -> (Arc<Light>, f64) {
        let receivers: Vec<_> = self.grid.positions().map(Receiver::probe).collect();
        let job = Job::new(self.scene.clone(), receivers, samples);
        let job = Job { bounces, previous, seed, ..job };
        let ticket = self.tracer.submit(job);
        let mut volume = ProbeVolume::dark(FieldId(0), self.grid, Order::L2);
        let Some(gathered) = self.tracer.wait(ticket) else { unreachable!("nobody cancels") };
        for (i, sums) in gathered.sums.iter().enumerate() {
            for (c, mean) in volume.probe_mut(i).iter_mut().zip(sums.mean()) {
                *c = mean;
            }
        }
        let taken = self.grid.probe_count() as f64 * f64::from(samples);
        (Arc::new(Light::new(vec![volume])), gathered.rays as f64 / taken)
    }

    fn fed_back(&mut self, bounces: u32) -> (Arc<Light>, f64) {
        let mut light =
            Arc::new(Light::new(vec![ProbeVolume::dark(FieldId(0), self.grid, Order::L2)]));
        for seed in 1..JOBS {
            light = self.gather(SAMPLES, bounces, Some(light), seed).0;
        }
        self.gather(COMPARED, bounces, Some(light), JOBS)
    }
}

fn coefficients(light: &Light) -> impl Iterator<Item = Vec3> + '_ {
    let volume = light.volumes().next().expect("a volume");
    (0..volume.grid.probe_count()).flat_map(|probe| volume.probe(probe).iter().copied())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for name in std::env::args().skip(1) {
        let mut bench = Bench::new(&name)?;
        let (all, _) = bench.gather(COMPARED, ALL_BOUNCES, None, 0);
        let report = |way: &str, (light, rays): (Arc<Light>, f64)| {
            let squares = |light: &Light, other: f32| {
                let pairs = coefficients(light).zip(coefficients(&all));
                pairs.map(|(a, b)| (a - other * b).length_squared()).sum::<f32>()
            };
            let error = (squares(&light, 1.0) / squares(&all, 0.0)).sqrt();
            let c0 = |light: &Light| coefficients(light).step_by(9).sum::<Vec3>().y;
            let bias = c0(&light) / c0(&all) - 1.0;
            println!(
                "{name}, {way}: differs by {:.1} %, mean {:+.1} %; {rays:.2} rays a sample",
                100.0 * error,
                100.0 * bias,
            );
        };
        report("as many, other paths", bench.gather(COMPARED, ALL_BOUNCES, None, 77));
        for bounces in 0..=4 {
            let alone = bench.gather(COMPARED, bounces, None, JOBS);
            report(&format!("{bounces} bounces"), alone);
            if bounces < 3 {
                report(&format!("{bounces} and feedback"), bench.fed_back(bounces));
            }
        }
    }
    Ok(())
}
