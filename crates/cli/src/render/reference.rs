//! Pictures by path tracing every pixel.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

use anyhow::{Context, Result};
use glam::UVec2;
use lumencast_gather::reference::{Film, Filter, Noise, PASS, Parts, PictureSettings, Renderer};
use lumencast_picture::{Picture, exposure};
use lumencast_scene::{Scene, View};
use serde_json::{Value, json};

use super::{FilterArgument, PartsArgument, Render};
use crate::film_file::{FilmFile, KeptFilm};
use crate::output::{self, say, tell};
use crate::{fingerprint, interrupt};

/// Samples a pixel unless told otherwise.
const SAMPLES: u32 = 64;

impl Render {
    pub(super) fn trace_picture(&self, scene: &mut Scene, view: View) -> Result<()> {
        let settings = self.settings();
        let key = self.key(scene, view, settings)?;
        let partial = unfinished(&self.output[0]);
        let mut kept = self.begun(FilmFile { path: partial.clone(), key });
        let before = kept.film.samples();
        let spinner = output::spinner("Building".into());
        let renderer = Renderer::new(&scene.snapshot(), view, settings)
            .context("cannot start the threads that trace")?;
        spinner.finish_and_clear();

        let start = Instant::now();
        let rays = match self.trace(&renderer, &mut kept)? {
            Some(rays) => rays,
            None => {
                if kept.film.samples() > before {
                    kept.keep()?;
                }
                match kept.film.samples() {
                    0 => tell!("Stopped before the first samples were done."),
                    samples => tell!(
                        "Stopped at {samples} of {} samples; the same command goes on from {}.",
                        self.reference_samples(),
                        partial.display()
                    ),
                }
                std::process::exit(interrupt::EXIT_CODE);
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        let film = kept.film;
        let picture = Picture::new(self.picture.size.x, self.picture.size.y, film.picture())?;
        let exposure = self.exposure.0.unwrap_or_else(|| exposure(&picture));
        self.write(&picture, exposure)?;
        if partial.exists() {
            fs::remove_file(&partial)
                .with_context(|| format!("cannot remove {}", partial.display()))?;
        }
        let done =
            Done { follows_sun: renderer.follows_sun(), film, before, rays, seconds, exposure };
        if self.json {
            return output::json(&self.report(&done));
        }
        self.print(&done);
        Ok(())
    }

    fn reference_samples(&self) -> u32 {
        self.spp.unwrap_or(SAMPLES)
    }

    fn settings(&self) -> PictureSettings {
        PictureSettings {
            clamp: self.clamp,
            roulette_from: self.roulette_from,
            follow_sun: self.follow_sun,
            parts: match self.parts {
                PartsArgument::All => Parts::All,
                PartsArgument::Direct => Parts::Direct,
                PartsArgument::Indirect => Parts::Indirect,
            },
            filter: match self.filter {
                FilterArgument::Box => Filter::Box,
                FilterArgument::Tent => Filter::Tent,
                FilterArgument::Gaussian => Filter::Gaussian,
            },
            seed: self.seed,
            ..self.picture.settings()
        }
    }

    /// All that a sample depends on.
    fn key(&self, scene: &Scene, view: View, settings: PictureSettings) -> Result<u64> {
        let settings = PictureSettings { threads: None, ..settings };
        let said = format!("{} {view:?} {settings:?}", env!("CARGO_PKG_VERSION"));
        fingerprint::of(scene, (said, self.time.to_bits()))
    }

    /// The film to go on with.
    fn begun(&self, partial: FilmFile) -> KeptFilm {
        let begin = if self.restart { KeptFilm::anew } else { KeptFilm::begun };
        begin(Some(partial), self.picture.size, self.reference_samples())
    }

    /// Traces until all samples are there and returns the number of rays; `None` when interrupted.
    fn trace(&self, renderer: &Renderer, kept: &mut KeptFilm) -> Result<Option<u64>> {
        let interrupted = interrupt::flag()?;
        let bar = output::share_bar("Rendering");
        let share = |samples: f64| samples / f64::from(self.reference_samples());
        bar.set_position((share(kept.film.samples().into()) * output::SHARE_BAR_LENGTH) as u64);
        bar.reset_eta();
        let mut rays = 0;
        while kept.film.samples() < self.reference_samples() {
            let samples = kept.film.samples();
            let going = |done: f32| {
                let pass = PASS.min(self.reference_samples() - samples);
                let at = share(f64::from(samples) + f64::from(done) * f64::from(pass));
                bar.set_position((at * output::SHARE_BAR_LENGTH) as u64);
                !interrupted.load(Ordering::Relaxed)
            };
            match renderer.pass(&mut kept.film, self.reference_samples(), &going) {
                Some(traced) => rays += traced.rays,
                None => {
                    bar.abandon();
                    return Ok(None);
                }
            }
            if kept.film.samples() < self.reference_samples() {
                kept.keep_at_times()?;
            }
        }
        bar.finish_and_clear();
        Ok(Some(rays))
    }

    fn print(&self, done: &Done) {
        let files: Vec<_> = self.output.iter().map(|path| path.display().to_string()).collect();
        say!("{}", files.join(", "));
        say!(
            "{} × {}, {} samples a pixel, {} bounces, {:.1} s",
            self.picture.size.x,
            self.picture.size.y,
            done.film.samples(),
            self.picture.bounces,
            done.seconds
        );
        if done.paths(self.picture.size) > 0.0 {
            say!(
                "{:.3} M paths, {:.3} M rays a second",
                1e-6 * done.paths(self.picture.size) / done.seconds,
                1e-6 * done.rays as f64 / done.seconds
            );
        }
        if let Some(Noise { relative_rms, psnr }) = done.film.noise(done.exposure) {
            say!(
                "noise {:.2} % of the mean, {psnr:.1} dB at exposure {}",
                100.0 * relative_rms,
                done.exposure
            );
        }
    }

    fn report(&self, done: &Done) -> Value {
        let noise = done.film.noise(done.exposure);
        json!({
            "files": self.output,
            "width": self.picture.size.x,
            "height": self.picture.size.y,
            "samples": done.film.samples(),
            "bounces": self.picture.bounces,
            "materials": self.picture.materials.to_string(),
            "seconds": done.seconds,
            "samples_taken_before": done.before,
            "paths_a_second": done.paths(self.picture.size) / done.seconds,
            "rays_a_second": done.rays as f64 / done.seconds,
            "exposure": done.exposure,
            "follows_sun": done.follows_sun,
            "noise_relative_rms": noise.map(|n| n.relative_rms),
            "noise_psnr": noise.map(|n| n.psnr),
        })
    }
}

/// Where the picture of a file is kept until it is finished.
fn unfinished(output: &Path) -> PathBuf {
    let mut name = output.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// A finished picture, and what it took.
struct Done {
    film: Film,
    /// Samples a pixel that were there at the start.
    before: u32,
    rays: u64,
    seconds: f64,
    exposure: f32,
    follows_sun: bool,
}

impl Done {
    /// Paths traced this time.
    fn paths(&self, size: UVec2) -> f64 {
        f64::from(size.x) * f64::from(size.y) * f64::from(self.film.samples() - self.before)
    }
}
