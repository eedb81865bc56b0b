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
use lumencast_light::{Field, Light};
use lumencast_picture::{Picture, ToneMap, exposure};
use lumencast_scene::{Edit, Environment, Scene, Snapshot, View};
use lumencast_shade::{Gpu, Lighting, Materials, Renderer, Settings, Shading, Shadows};
use lumencast_solve::{Effort, Spent};

use super::drawing::{cells, draw, sum};
use super::judge::{Judge, covered};
use super::peers::SUBJECTS;
use super::section::Section;
use super::traced::{self, BOUNCES, FIRST_SPP, SIZE, Traced};
use crate::arguments::{
    EffortArguments, FieldsArguments, MOST_SAMPLES, Reading, ReadingArguments, Wanted,
};
use crate::charting::Lumels;
use crate::light_source::Computed;
use crate::output::{self, tell};
use crate::{camera, out_file, warnings};
use live::Live;
use report::{Beside, Report, Row};

/// The reference's noise lies so far below the error that it tells, dB.
const BELOW: f64 = 6.0;
/// The sky that scenes without light stand under, lux.
const SKY: f32 = 1000.0;

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
    /// Also casts each scene's light for so many seconds as `serve` does, and for as many after its first
    /// light has moved, and compares what then is there with the same light converged.
    #[arg(long, value_name = "SECONDS", value_parser = crate::values::parse_positive)]
    live: Option<f32>,
    /// Samples a pixel of a reference, at most.
    #[arg(long, value_name = "N", default_value_t = 4096,
          value_parser = clap::value_parser!(u32).range(2..=1 << 20))]
    reference_spp: u32,
    /// Keeps references in this folder and goes on from there.
    #[arg(long, value_name = "FOLDER")]
    keep: Option<PathBuf>,
    /// Writes each scene's indirect light, the reference's and how they differ into this folder; with
    /// --live, what is shown after the seconds, and the converged light where it has moved.
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
    path: PathBuf,
    name: String,
    scene: Scene,
    snapshot: Arc<Snapshot>,
    view: View,
    /// The exposure to judge at; nothing where the reference tells it.
    exposure: Option<f32>,
    under_sky: bool,
}

/// A reference that is fine enough.
struct Judged {
    judge: Judge,
    /// As a PSNR after the filter, dB.
    noise: f64,
    /// Samples a pixel.
    samples: u32,
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
            warnings::left_out(&subject.scene);
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
        let exposure = match subject.exposure {
            Some(exposure) => exposure,
            None => {
                let [direct, indirect] = [Parts::Direct, Parts::Indirect].map(|parts| {
                    let mut traced = self.traced(&subject, parts)?;
                    traced.to(FIRST_SPP)?;
                    traced.picture()
                });
                exposure(&sum(&direct?, &indirect?))
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
        let wanted = Wanted { volumes, lightmap, directional: self.fields.directional };
        let snapshot = subject.snapshot.clone();
        let mut bake = |computed: Computed| computed.light(&snapshot, &wanted, &mut *gatherer);
        let baked = bake(usual)?;
        let mut picture_of =
            |fields: Vec<Field>| draw_light(renderer, fields, subject.view, &settings);
        let picture = picture_of(baked.fields)?;
        let mut beside = Vec::new();
        let mut more = None;
        if let Some(times) = self.times {
            let more_of = |spent: Spent| spent.samples.saturating_mul(times);
            let effort = Effort {
                lumel_samples: baked.lumels.map_or(1, more_of),
                ..Effort::of_samples(more_of(baked.probes))
            };
            let light = bake(computed(drawn, effort))?;
            more = Some((format!("{times} times the samples"), picture_of(light.fields)?));
        }
        let judged = self.judged(&subject, renderer, &settings, &picture)?;
        let judge = &judged.judge;
        if let Some((what, picture)) = more {
            beside.push(Beside { what, psnr: judge.psnr(&picture)? });
        }
        self.write(&subject.name, "reference", judge.reference(), exposure)?;
        self.write(&subject.name, "field", &picture, exposure)?;
        self.write(&subject.name, "difference", &judge.difference(&picture), 1.0)?;
        if let Some(seconds) = self.live {
            let live = Live { bench: self, subject: &subject, wanted: &wanted, settings };
            beside.extend(live.beside(renderer, gatherer, judge, seconds.into())?);
        }
        let pages = wanted.lightmap.iter().map(|laid_out| Lumels::of(laid_out).to_string());
        Ok(Row {
            psnr: judge.psnr(&picture)?,
            reference_noise: judged.noise,
            reference_samples: judged.samples,
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

    /// Writes a picture of a scene, where that is wished for.
    fn write(&self, scene: &str, what: &str, picture: &Picture, exposure: f32) -> Result<()> {
        let Some(folder) = &self.output else { return Ok(()) };
        let path = folder.join(format!("{scene}-{what}.png"));
        Ok(picture.write_png(path, ToneMap::Gamma, exposure)?)
    }

    fn traced(&self, subject: &Subject, parts: Parts) -> Result<Traced> {
        let Subject { scene, snapshot, view, .. } = subject;
        let keep = self.keep.as_deref();
        Traced::new(&traced::Subject { scene, snapshot, view: *view, keep }, parts)
    }

    /// What pictures of a scene's indirect light are judged by, refined until its noise is well below
    /// the error of this one.
    fn judged(
        &self,
        subject: &Subject,
        renderer: &mut Renderer,
        settings: &Settings,
        picture: &Picture,
    ) -> Result<Judged> {
        let covered = covered(renderer, &subject.snapshot, subject.view, settings)?;
        renderer.set_scene(&subject.snapshot);
        let mut indirect = self.traced(subject, Parts::Indirect)?;
        indirect.to(FIRST_SPP)?;
        loop {
            let judge = Judge::new(indirect.picture()?, covered.clone(), settings.pre_exposure)?;
            let noise = judge.noise(indirect.film())?;
            let samples = indirect.film().samples();
            let enough = noise >= judge.psnr(picture)?.filtered + BELOW;
            if enough || samples >= self.reference_spp {
                return Ok(Judged { judge, noise, samples });
            }
            indirect.to(2 * samples)?;
        }
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

impl Subject {
    /// The same scene once more.
    fn again(&self) -> Result<Self> {
        Ok(Self { exposure: self.exposure, ..subject(&self.path)? })
    }

    /// The same scene after an edit.
    fn edited(&self, edit: &Edit) -> Result<Self> {
        let mut edited = self.again()?;
        edited.scene.apply(edit)?;
        edited.snapshot = edited.scene.snapshot();
        Ok(edited)
    }
}

fn section() -> Section {
    Section { title: "indirect light of scenes".to_owned(), command: "scenes" }
}

fn subject(path: &Path) -> Result<Subject> {
    let name = path.to_string_lossy();
    let mut scene = Scene::open(&name)?;
    let under_sky = scene.is_dark();
    if under_sky {
        scene.apply(&Edit::SetEnvironment { environment: Environment::clear_sky(SKY) })?;
    }
    let published = SUBJECTS.iter().any(|subject| path.ends_with(subject.file));
    Ok(Subject {
        path: path.to_owned(),
        name: scene.name().to_owned(),
        snapshot: scene.snapshot(),
        view: camera::view(&scene, None)?,
        scene,
        exposure: published.then_some(1.0),
        under_sky,
    })
}
