//! `lumencast render`: a picture of a scene.

mod partial;

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use glam::UVec2;
use lumencast_gather::reference::{
    Film, Filter, Noise, PASS, Parts, PictureSettings, Renderer,
};
use lumencast_picture::{Picture, ToneMap, exposure};
use lumencast_scene::{FileContents, Scene, View};
use serde_json::{Value, json};

use crate::arguments::{Exposure, SceneSource, parse_positive};
use crate::camera::{self, PictureArguments};
use crate::{interrupt, output};

/// Draws a picture of a scene.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast render cornell -o cornell.png
  lumencast render sponza.glb --camera nave --spp 1024 --size 1920x1080 -o sponza.exr -o sponza.png
  lumencast render sponza.glb --camera 2,1.5,0,0,1.5,0,60 --parts indirect --bounces 4 -o i.exr

The reference is path-traced: every sample follows one path of at most --bounces surface scattering
events, 1 being direct light. It is done when every pixel has its samples; Ctrl-C, or a crash, leaves
what there is beside the picture (FILE.part), and the same command goes on from there, also with more
samples than before. The noise told is the error that is left, from the difference of two independent
halves. EXR holds linear radiance in cd/m²; PNG is shown by exposure and tone map.")]
pub(crate) struct Render {
    #[command(flatten)]
    scene: SceneSource,
    /// How light is computed.
    #[arg(long, value_enum, default_value_t = Lighting::Reference)]
    lighting: Lighting,
    /// The picture's file, .exr or .png; may be given several times.
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Samples a pixel: four times as many halve the noise.
    #[arg(long, value_name = "N", default_value_t = 64,
          value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    spp: u32,
    #[command(flatten)]
    picture: PictureArguments,
    /// Which light: direct is what clients draw themselves, indirect what light fields hold.
    #[arg(long, value_enum, default_value_t = PartsArgument::All)]
    parts: PartsArgument,
    /// How a pixel weighs what it sees.
    #[arg(long, value_enum, default_value_t = FilterArgument::Box)]
    filter: FilterArgument,
    /// Upper limit of one path vertex's contribution, cd/m², against bright speckles.
    #[arg(long, value_name = "CD/M2", default_value = "inf", value_parser = parse_positive)]
    clamp: f32,
    /// Scattering events from which on paths may end by chance.
    #[arg(long, value_name = "N", default_value_t = 4)]
    roulette_from: u32,
    /// Scene time, seconds: animations are shown as they stand then.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = parse_time)]
    time: f64,
    /// Factor on radiance before the tone map: a number, or auto: 1 over the 99th percentile of
    /// luminance. For PNG only.
    #[arg(long, value_name = "auto|NUMBER", default_value = "auto")]
    exposure: Exposure,
    /// Tone map of PNG: gamma, srgb, reinhard, filmic or neutral.
    #[arg(long, value_name = "NAME", default_value_t = ToneMap::Srgb)]
    tone_map: ToneMap,
    /// Another seed gives other, independent noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Begins anew where an unfinished picture is there.
    #[arg(long)]
    restart: bool,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

/// How light is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Lighting {
    /// By path tracing every pixel.
    Reference,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PartsArgument {
    All,
    Direct,
    Indirect,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FilterArgument {
    /// The pixel's own square.
    Box,
    /// Falls to nothing at the neighbours' centres.
    Tent,
    /// σ of half a pixel.
    Gaussian,
}

/// The unfinished picture is kept at least so often.
const KEEP_EVERY: Duration = Duration::from_secs(60);

impl Render {
    pub(crate) fn run(self) -> Result<()> {
        let Lighting::Reference = self.lighting;
        self.check_outputs()?;
        let mut scene = self.scene.open()?;
        scene.advance(self.time);
        let view = camera::view(&scene, self.picture.camera.as_ref())?;
        let settings = self.settings();
        let key = self.key(&scene, view, settings);
        let partial = partial::path_of(&self.output[0]);
        let mut film = self.begun(&partial, key);
        let before = film.samples();
        let spinner = output::spinner("Building".into());
        let renderer = Renderer::new(&scene.snapshot(), view, settings)
            .context("cannot start the threads that trace")?;
        spinner.finish_and_clear();

        let start = Instant::now();
        let rays = match self.trace(&renderer, &mut film, &partial, key)? {
            Some(rays) => rays,
            None => {
                if film.samples() > before {
                    partial::write(&partial, key, &film)?;
                }
                match film.samples() {
                    0 => eprintln!("Stopped before the first samples were done."),
                    samples => eprintln!(
                        "Stopped at {samples} of {} samples; the same command goes on from {}.",
                        self.spp,
                        partial.display()
                    ),
                }
                std::process::exit(interrupt::EXIT_CODE);
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        let picture = Picture::new(self.picture.size.x, self.picture.size.y, film.picture())?;
        let exposure = self.exposure.0.unwrap_or_else(|| exposure(&picture));
        self.write(&picture, exposure)?;
        if partial.exists() {
            fs::remove_file(&partial)
                .with_context(|| format!("cannot remove {}", partial.display()))?;
        }
        let done = Done { film, before, rays, seconds, exposure };
        if self.json {
            return output::json(&self.report(&done));
        }
        self.print(&done);
        Ok(())
    }

    /// Said before hours of work, not after.
    fn check_outputs(&self) -> Result<()> {
        for path in &self.output {
            let extension = path.extension().map(|e| e.to_ascii_lowercase());
            match extension.as_ref().and_then(|e| e.to_str()) {
                Some("png" | "exr") => {}
                _ => bail!("{}: pictures are written as .exr or .png", path.display()),
            }
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
            let folder = folder.unwrap_or(Path::new("."));
            ensure!(folder.is_dir(), "{}: there is no such folder", folder.display());
        }
        Ok(())
    }

    fn settings(&self) -> PictureSettings {
        PictureSettings {
            clamp: self.clamp,
            roulette_from: self.roulette_from,
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

    /// A hash of all that a sample depends on: scene files by length and time of change.
    fn key(&self, scene: &Scene, view: View, settings: PictureSettings) -> u64 {
        let mut hasher = DefaultHasher::new();
        let settings = PictureSettings { threads: None, ..settings };
        let said = format!("{} {view:?} {settings:?} {:?}", env!("CARGO_PKG_VERSION"), self.scene);
        (said, self.time.to_bits()).hash(&mut hasher);
        for file in scene.files() {
            file.name.hash(&mut hasher);
            match &file.contents {
                FileContents::Bytes(bytes) => bytes.hash(&mut hasher),
                FileContents::Path(path) => {
                    if let Ok(metadata) = fs::metadata(path) {
                        (metadata.len(), metadata.modified().ok()).hash(&mut hasher);
                    }
                }
            }
        }
        hasher.finish()
    }

    /// The film to go on with.
    fn begun(&self, partial: &Path, key: u64) -> Film {
        let kept =
            (!self.restart).then(|| partial::read(partial, key, self.picture.size)).flatten();
        match kept {
            Some(film) => {
                eprintln!("Going on from {} samples in {}.", film.samples(), partial.display());
                film
            }
            None => {
                if partial.exists() && !self.restart {
                    eprintln!(
                        "{} belongs to another picture or is damaged: beginning anew.",
                        partial.display()
                    );
                }
                Film::new(self.picture.size, self.spp)
            }
        }
    }

    /// Traces until all samples are there and returns the number of rays; `None` when interrupted.
    fn trace(
        &self,
        renderer: &Renderer,
        film: &mut Film,
        partial: &Path,
        key: u64,
    ) -> Result<Option<u64>> {
        let interrupted = interrupt::flag()?;
        let bar = output::share_bar("Rendering");
        let share = |samples: f64| samples / f64::from(self.spp);
        bar.set_position((share(film.samples().into()) * output::SHARE_BAR_LENGTH) as u64);
        bar.reset_eta();
        let mut kept = Instant::now();
        let mut rays = 0;
        while film.samples() < self.spp {
            let samples = film.samples();
            let going = |done: f32| {
                let pass = PASS.min(self.spp - samples);
                let at = share(f64::from(samples) + f64::from(done) * f64::from(pass));
                bar.set_position((at * output::SHARE_BAR_LENGTH) as u64);
                !interrupted.load(Ordering::Relaxed)
            };
            match renderer.pass(film, self.spp, &going) {
                Some(traced) => rays += traced.rays,
                None => {
                    bar.abandon();
                    return Ok(None);
                }
            }
            if kept.elapsed() > KEEP_EVERY && film.samples() < self.spp {
                partial::write(partial, key, film)?;
                kept = Instant::now();
            }
        }
        bar.finish_and_clear();
        Ok(Some(rays))
    }

    fn write(&self, picture: &Picture, exposure: f32) -> Result<()> {
        for path in &self.output {
            if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
                picture.write_png(path, self.tone_map, exposure)?;
            } else {
                picture.write_exr(path)?;
            }
        }
        Ok(())
    }

    fn print(&self, done: &Done) {
        let files: Vec<_> = self.output.iter().map(|path| path.display().to_string()).collect();
        println!("{}", files.join(", "));
        println!(
            "{} × {}, {} samples a pixel, {} bounces, {:.1} s",
            self.picture.size.x,
            self.picture.size.y,
            done.film.samples(),
            self.picture.bounces,
            done.seconds
        );
        if done.paths(self.picture.size) > 0.0 {
            println!(
                "{:.3} M paths, {:.3} M rays a second",
                1e-6 * done.paths(self.picture.size) / done.seconds,
                1e-6 * done.rays as f64 / done.seconds
            );
        }
        if let Some(Noise { relative_rms, psnr }) = done.film.noise(done.exposure) {
            println!(
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
            "noise_relative_rms": noise.map(|n| n.relative_rms),
            "noise_psnr": noise.map(|n| n.psnr),
        })
    }
}

/// A finished picture, and what it took.
struct Done {
    film: Film,
    /// Samples a pixel that were there at the start.
    before: u32,
    rays: u64,
    seconds: f64,
    exposure: f32,
}

impl Done {
    /// Paths traced this time.
    fn paths(&self, size: UVec2) -> f64 {
        f64::from(size.x) * f64::from(size.y) * f64::from(self.film.samples() - self.before)
    }
}

fn parse_time(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(time) if time >= 0.0 && time.is_finite() => Ok(time),
        _ => Err("seconds from 0 on".into()),
    }
}
