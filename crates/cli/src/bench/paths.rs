//! `lumencast bench paths`: camera paths a second.

use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use lumencast_gather::reference::{Film, PASS, PictureSettings, Renderer};
use serde_json::json;

use super::Spread;
use crate::arguments::SceneSource;
use crate::camera::{self, PictureArguments};
use crate::output::{self, say};

/// Measures camera paths and path segments a second.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bench paths sponza.glb
  lumencast bench paths sponza.glb --materials lambert --bounces 4 --json

Every path goes on to its last bounce, without Russian roulette, unless it leaves the scene. Segments are
rays of all kinds: from the camera, after bounces, and towards lights.")]
pub(crate) struct BenchPaths {
    #[command(flatten)]
    scene: SceneSource,
    #[command(flatten)]
    picture: PictureArguments,
    /// Passes that are measured, of 4 samples a pixel each.
    #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

impl BenchPaths {
    pub(crate) fn run(self) -> Result<()> {
        let mut scene = self.scene.open()?;
        let view = camera::view(&scene, self.picture.camera.as_ref())?;
        let settings = PictureSettings {
            roulette_from: u32::MAX,
            follow_sun: false,
            ..self.picture.settings()
        };
        let renderer = Renderer::new(&scene.snapshot(), view, settings)
            .context("cannot start the threads that trace")?;
        let mut film = Film::new(self.picture.size, PASS * self.rounds);
        let bar = output::bar(self.rounds.into(), "Tracing");
        let (mut paths, mut segments) = (Vec::new(), Vec::new());
        for _ in 0..self.rounds {
            let start = Instant::now();
            // Every pass is finished: nothing tells it to stop.
            let traced = renderer.pass(&mut film, u32::MAX, &|_| true).unwrap_or_default();
            let seconds = start.elapsed().as_secs_f64();
            paths.push(traced.paths as f64 / seconds);
            segments.push(traced.rays as f64 / seconds);
            bar.inc(1);
        }
        bar.finish_and_clear();
        let (paths, segments) = (Spread::of(paths), Spread::of(segments));
        let relative_rms = film.noise(1.0).map(|noise| noise.relative_rms);
        if self.json {
            return output::json(&json!({
                "scene": scene.name(),
                "width": self.picture.size.x,
                "height": self.picture.size.y,
                "bounces": self.picture.bounces,
                "materials": self.picture.materials.to_string(),
                "samples": film.samples(),
                "paths_a_second": paths,
                "segments_a_second": segments,
                "noise_relative_rms": relative_rms,
            }));
        }
        say!(
            "{}: {} × {}, {} bounces",
            scene.name(),
            self.picture.size.x,
            self.picture.size.y,
            self.picture.bounces
        );
        for (name, rates) in [("paths", &paths), ("segments", &segments)] {
            say!(
                "{name:<9} {:.3} M a second ({:.3} to {:.3})",
                1e-6 * rates.median,
                1e-6 * rates.min,
                1e-6 * rates.max
            );
        }
        if let Some(rms) = relative_rms {
            say!("noise     {:.1} % of the mean after {} samples", 100.0 * rms, film.samples());
        }
        Ok(())
    }
}
