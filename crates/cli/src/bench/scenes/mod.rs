//! `lumencast bench scenes`: the indirect light of many scenes at default settings, so that none is only
//! looked at by chance.

mod find;
mod live;
mod report;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Result;
use clap::Args;
use lumencast_gather::path_trace::{Levels, MaterialModel, Options};
use lumencast_gather::reference::Parts;
use lumencast_light::{Field, Layout, Light};
use lumencast_picture::{Picture, ToneMap, exposure};
use lumencast_scene::{Edit, Environment, Scene, Snapshot, View};
use lumencast_server::{SampleRange, TickOptions};
use lumencast_shade::{Gpu, Lighting, Materials, Renderer, Settings, Shading, Shadows};
use lumencast_solve::blend::BlendSettings;
use lumencast_solve::{Effort, Spent};

use super::drawing::{cells, draw, sum};
use super::judge::{Judge, covered};
use super::peers::SUBJECTS;
use super::section::Section;
use super::traced::{self, BOUNCES, FIRST_SPP, SIZE, Traced};
use crate::arguments::{
    EffortArguments, FieldsArguments, MOST_SAMPLES, Reading, ReadingArguments, Wanted,
};
use crate::light_source::Computed;
use crate::output::{self, tell};
use crate::{camera, out_file, warnings};
use report::{Beside, Report, Row};

/// The reference's noise lies so far below the error that it tells, dB.
const BELOW: f64 = 6.0;
/// The sky that scenes without light stand under, lux.
const SKY: f32 = 1000.0;
/// Light counts as converged at so many times the samples of light that is computed once.
const LIVE_CONVERGED: u32 = 4;

/// Measures the indirect light of scenes at default settings, beside the path tracer's.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bench scenes
  lumencast bench scenes cornell door ../shared/scenes --keep references -o pictures
  lumencast bench scenes door --times 16 --json

A picture of 320×180, of the scene's first camera or else of all of it, all materials Lambert, is drawn
with indirect light alone, of the scene's own volumes or the default one, and compared with the path
tracer's indirect light of 4 bounces. Scenes without light stand under a sky of 1,000 lux. PSNR is of
codes v^(1/2.2) clamped to 0 to 1, over pixels that show nothing but surfaces, and in brackets after a
filter of 4×4 pixels. The exposure makes the 99th percentile of the whole picture white; it is 1 for
the scenes of `bench peers`. References are refined until their noise after the filter lies 6 dB below
the error that they tell, or to the samples allowed.")]
pub(crate) struct BenchScenes {
    /// Built-in scenes, glTF files, and folders of them; the built-in scenes unless given.
    #[arg(value_name = "SCENE|FOLDER")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadingArguments,
    #[command(flatten)]
    effort: EffortArguments,
    #[command(flatten)]
    fields: FieldsArguments,
    /// Samples a probe, at most.
    #[arg(long, value_name = "N", default_value_t = MOST_SAMPLES,
          value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    probe_samples: u32,
    /// Also computes each field with so many times the samples, to see what noise costs.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=256))]
    times: Option<u32>,
    /// Also casts each scene's light for so many seconds of 25 ticks, as `serve` does with these samples
    /// a probe and tick, and compares what then is there with the same light converged.
    #[arg(long, value_name = "SECONDS", value_parser = crate::values::parse_positive)]
    live: Option<f32>,
    /// Samples a probe and tick of --live.
    #[arg(long, value_name = "N", default_value_t = 64, requires = "live",
          value_parser = clap::value_parser!(u32).range(1..=65_536))]
    live_samples: u32,
    /// Samples a pixel of a reference, at most.
    #[arg(long, value_name = "N", default_value_t = 4096,
          value_parser = clap::value_parser!(u32).range(2..=1 << 20))]
    reference_spp: u32,
    /// Keeps references in this folder and goes on from there.
    #[arg(long, value_name = "FOLDER")]
    keep: Option<PathBuf>,
    /// Writes each scene's indirect light, the reference's and how they differ into this folder.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Puts the table into this document of markdown, in place of the one that an earlier run put there
    /// or at its end.
    #[arg(long, value_name = "FILE")]
    document: Option<PathBuf>,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

/// A scene that is measured.
struct Subject {
    name: String,
    scene: Scene,
    snapshot: Arc<Snapshot>,
    view: View,
    /// The exposure to judge at; nothing where the reference tells it.
    exposure: Option<f32>,
    under_sky: bool,
}

impl BenchScenes {
    pub(crate) fn run(self) -> Result<()> {
        for folder in self.keep.iter().chain(&self.output) {
            out_file::check_folder(folder)?;
        }
        if let Some(path) = &self.document {
            section().check(path)?;
        }
        let settings = Settings {
            size: SIZE,
            samples: 64,
            shading: Shading::Samples,
            materials: Materials::Lambert,
            shadows: Shadows { resolution: 4096, ..Shadows::default() },
            ..Settings::default()
        };
        let mut renderer = Renderer::new(Gpu::new()?, &settings);
        let mut rows = Vec::new();
        for scene in find::scenes(&self.scenes)? {
            let subject = subject(&scene)?;
            tell!("{}", subject.name);
            let row = self.row(subject, &mut renderer, &settings)?;
            tell!("{}", row.line());
            rows.push(row);
        }
        let report = Report { adapter: renderer.gpu().name(), rows };
        if let Some(path) = &self.document {
            section().replace(path, &report.text())?;
        }
        if self.json {
            return output::json(&serde_json::to_value(&report)?);
        }
        output::print(&report.text());
        Ok(())
    }

    fn row(
        &self,
        mut subject: Subject,
        renderer: &mut Renderer,
        settings: &Settings,
    ) -> Result<Row> {
        let covered = covered(renderer, &subject.snapshot, subject.view, settings)?;
        let traced = |parts| {
            let Subject { scene, snapshot, view, .. } = &subject;
            let keep = self.keep.as_deref();
            Traced::new(&traced::Subject { scene, snapshot, view: *view, keep }, parts)
        };
        let mut indirect = traced(Parts::Indirect)?;
        indirect.to(FIRST_SPP)?;
        let exposure = match subject.exposure {
            Some(exposure) => exposure,
            None => {
                let mut direct = traced(Parts::Direct)?;
                direct.to(FIRST_SPP)?;
                exposure(&sum(&direct.picture()?, &indirect.picture()?))
            }
        };
        let settings = Settings { pre_exposure: exposure, ..*settings };
        renderer.set_scene(&subject.snapshot);
        let drawn = self.reading.drawn();
        let usual = computed(drawn, self.fields.effort(&self.effort, self.probe_samples));
        let mut gatherer = usual.gatherer()?;
        let volumes = match self.fields.volumes() {
            true => lumencast_solve::volumes(&mut subject.scene, &mut *gatherer)?,
            false => Vec::new(),
        };
        let lightmap = self.fields.lumels(&mut subject.scene, &mut *gatherer)?;
        let wanted = Wanted { volumes, lightmap };
        let snapshot = subject.snapshot.clone();
        let mut bake = |computed: Computed| computed.light(&snapshot, &wanted, &mut *gatherer);
        let baked = bake(usual)?;
        let mut picture_of =
            |fields: Vec<Field>| draw_light(renderer, fields, subject.view, &settings);
        let picture = picture_of(baked.fields)?;
        let mut judge;
        loop {
            judge = Judge::new(indirect.picture()?, covered.clone(), exposure)?;
            let error = judge.psnr(&picture)?.filtered;
            let enough = judge.noise(indirect.film())? >= error + BELOW;
            if enough || indirect.film().samples() >= self.reference_spp {
                break;
            }
            indirect.to(2 * indirect.film().samples())?;
        }
        if let Some(folder) = &self.output {
            let write = |what: &str, picture: &Picture, exposure: f32| {
                let path = folder.join(format!("{}-{what}.png", subject.name));
                picture.write_png(path, ToneMap::Gamma, exposure)
            };
            write("reference", judge.reference(), exposure)?;
            write("field", &picture, exposure)?;
            write("difference", &judge.difference(&picture), 1.0)?;
        }
        let mut beside = Vec::new();
        if let Some(times) = self.times {
            let more = |spent: Spent| spent.samples.saturating_mul(times);
            let effort = Effort {
                lumel_samples: baked.lumels.map_or(1, more),
                ..Effort::of_samples(more(baked.probes))
            };
            let more = bake(computed(drawn, effort))?;
            beside.push(Beside {
                what: format!("{times} times the samples"),
                psnr: judge.psnr(&picture_of(more.fields)?)?,
            });
        }
        if let Some(seconds) = self.live {
            let served = self.reading.served();
            let effort = Effort::of_samples(self.probe_samples.saturating_mul(LIVE_CONVERGED));
            let converged = bake(computed(served, effort))?;
            beside.push(Beside {
                what: "as served, converged".to_owned(),
                psnr: judge.psnr(&picture_of(converged.fields)?)?,
            });
            let samples = self.live_samples;
            let options = TickOptions {
                samples: SampleRange::fixed(samples),
                gather: served.gathered(BOUNCES - 1, f32::INFINITY, BlendSettings::default()),
                volumes: wanted.volumes.clone(),
                lightmap: wanted.lightmap.clone(),
                ..TickOptions::default()
            };
            let live = live::light(subject.scene, gatherer, options, seconds.into())?;
            beside.push(Beside {
                what: format!("live, {samples} samples a tick, after {seconds} s"),
                psnr: judge.psnr(&picture_of(live)?)?,
            });
        }
        let pages = wanted.lightmap.iter().map(|laid_out| {
            let Layout { pages, page_size, .. } = laid_out.layout;
            format!("{pages} × {page_size}²")
        });
        Ok(Row {
            psnr: judge.psnr(&picture)?,
            reference_noise: judge.noise(indirect.film())?,
            reference_samples: indirect.film().samples(),
            scene: subject.name,
            under_sky: subject.under_sky,
            grids: wanted.volumes.iter().map(cells).chain(pages).collect(),
            probes: wanted.volumes.iter().map(|spec| spec.grid.probe_count()).sum(),
            samples: baked.probes.samples,
            noise: baked.probes.noise,
            lumel_samples: baked.lumels.map(|spent| spent.samples),
            lumel_noise: baked.lumels.and_then(|spent| spent.noise),
            exposure,
            beside,
        })
    }
}

/// How a scene's light is computed.
fn computed(reading: Reading, effort: Effort) -> Computed {
    Computed {
        effort,
        bounces: BOUNCES - 1,
        clamp: f32::INFINITY,
        reading,
        tracing: Options { materials: MaterialModel::Lambert, threads: None, levels: Levels::One },
    }
}

/// The indirect part of a picture under these fields.
fn draw_light(
    renderer: &mut Renderer,
    fields: Vec<Field>,
    view: View,
    settings: &Settings,
) -> Result<Picture> {
    renderer.set_light(&Light::new(fields))?;
    draw(renderer, view, settings, Lighting::INDIRECT)
}

fn section() -> Section {
    Section { title: "indirect light of scenes".to_owned(), command: "scenes" }
}

fn subject(path: &Path) -> Result<Subject> {
    let name = path.to_string_lossy();
    let mut scene = Scene::open(&name)?;
    warnings::left_out(&scene);
    let under_sky = scene.is_dark();
    if under_sky {
        scene.apply(&Edit::SetEnvironment { environment: Environment::clear_sky(SKY) })?;
    }
    let published = SUBJECTS.iter().any(|subject| path.ends_with(subject.file));
    Ok(Subject {
        name: scene.name().to_owned(),
        snapshot: scene.snapshot(),
        view: camera::view(&scene, None)?,
        scene,
        exposure: published.then_some(1.0),
        under_sky,
    })
}
