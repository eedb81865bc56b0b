//! `lumencast bench rays`: rays a second, and times of building.

use std::num::NonZeroUsize;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;
use lumencast_gather::measure::{RayBench, build_peak_bytes, build_seconds, top_level_seconds};
use lumencast_gather::path_trace::{Levels, Options, Trees};
use serde_json::json;

use super::Spread;
use crate::arguments::SceneSource;
use crate::camera::{self, CameraArgument};
use crate::output::{self, say};

/// Measures rays a second and times of building acceleration structures.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bench rays sponza.glb
  lumencast bench rays tomb --rays 200000 --threads 1 --json

Closest-hit rays leave in cosine-distributed directions where camera paths met their second surface, in
shuffled order; any-hit rays go from the same points to the lights. Surfaces with holes count as whole.
Median of the rounds, with the least and the largest.")]
pub(crate) struct BenchRays {
    #[command(flatten)]
    scene: SceneSource,
    /// Rays of each kind; fewer where most paths leave the scene.
    #[arg(long, value_name = "N", default_value_t = 1_000_000,
          value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    rays: u32,
    /// Where the paths begin; the scene's first camera unless given.
    #[arg(long, value_name = "NAME|INDEX|EYE,TARGET[,FOV]", allow_hyphen_values = true)]
    camera: Option<CameraArgument>,
    /// Threads; all cores unless given.
    #[arg(long)]
    threads: Option<NonZeroUsize>,
    /// Hierarchies above each other: two, as for scenes that move (one a mesh, one over the
    /// instances), or one over all triangles, as for pictures.
    #[arg(long, value_name = "1|2", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=2))]
    levels: u32,
    /// Times that everything is measured.
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

/// The top level that is timed has so many instances.
const INSTANCES: u32 = 1000;

impl BenchRays {
    pub(crate) fn run(self) -> Result<()> {
        let mut scene = self.scene.open()?;
        let view = camera::view(&scene, self.camera.as_ref())?;
        let snapshot = scene.snapshot();
        let levels = if self.levels == 1 { Levels::One } else { Levels::Two };
        let peak = build_peak_bytes(&snapshot, levels);
        let spinner = output::spinner("Finding rays".into());
        let rays = self.rays as usize;
        let options = Options { threads: self.threads, levels, ..Options::default() };
        let bench = RayBench::new(&snapshot, view, rays, &options, Trees::Improved)
            .context("cannot start the threads that trace")?;
        spinner.finish_and_clear();
        ensure!(
            !bench.closest.is_empty(),
            "no path from this camera meets two surfaces: choose another with --camera"
        );
        let bar = output::bar(self.rounds.into(), "Tracing");
        let [mut closest, mut any, mut build, mut improved, mut top] = [const { Vec::new() }; 5];
        let mut hits = (0, 0);
        for _ in 0..self.rounds {
            let start = Instant::now();
            let found = bench.trace_closest(&bench.closest);
            closest.push(bench.closest.len() as f64 / start.elapsed().as_secs_f64());
            let start = Instant::now();
            let occluded = bench.trace_any(&bench.any);
            any.push(bench.any.len() as f64 / start.elapsed().as_secs_f64());
            hits = (found.iter().flatten().count(), occluded.iter().filter(|o| **o).count());
            let seconds = |trees| bench.install(|| build_seconds(&snapshot, levels, trees));
            build.push(1e3 * seconds(Trees::AsBuilt));
            improved.push(1e3 * seconds(Trees::Improved));
            top.push(1e3 * bench.install(|| top_level_seconds(&snapshot, INSTANCES)));
            bar.inc(1);
        }
        bar.finish_and_clear();

        let triangles = bench.triangles().len();
        let threads = bench.install(|| self.threads.map_or_else(cores, NonZeroUsize::get));
        let a_triangle = |bytes: f64| bytes / triangles as f64;
        let bytes = a_triangle(bench.bytes() as f64);
        let peak = peak.map(|peak| a_triangle(peak as f64));
        let [closest, any, build, improved, top] =
            [closest, any, build, improved, top].map(Spread::of);
        if self.json {
            return output::json(&json!({
                "scene": scene.name(),
                "triangles": triangles,
                "threads": threads,
                "levels": self.levels,
                "rays": { "closest": bench.closest.len(), "any": bench.any.len() },
                "hits": { "closest": hits.0, "any": hits.1 },
                "closest_a_second": closest,
                "any_a_second": any,
                "build_ms": build,
                "build_improved_ms": improved,
                "top_level_ms": top,
                "top_level_instances": INSTANCES,
                "bytes_a_triangle": bytes,
                "peak_bytes_a_triangle": peak,
            }));
        }
        say!("{}: {triangles} triangles, {threads} threads", scene.name());
        let rate = |name: &str, rates: &Spread, rays: usize, hits: usize| {
            say!(
                "{name:<12} {:.3} M rays a second ({:.3} to {:.3}); {hits} of {rays} hit",
                1e-6 * rates.median,
                1e-6 * rates.min,
                1e-6 * rates.max
            );
        };
        rate("closest hit", &closest, bench.closest.len(), hits.0);
        rate("any hit", &any, bench.any.len(), hits.1);
        let time = |name: &str, times: &Spread| {
            say!("{name:<12} {:.2} ms ({:.2} to {:.2})", times.median, times.min, times.max);
        };
        time("build", &build);
        time("improved", &improved);
        time("top level", &top);
        say!("memory       {bytes:.1} bytes a triangle");
        if let Some(peak) = peak {
            say!("at most      {peak:.0} bytes a triangle while it is built");
        }
        Ok(())
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}
