//! `lumencast bench peers`: our pictures by the protocol by which the second paper's published
//! implementation was measured.

mod reference;
mod report;
mod subjects;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use clap::Args;
use lumencast_charts::LaidOut;
use lumencast_gather::path_trace::{CpuPathTracer, Levels, MaterialModel, Options};
use lumencast_gather::reference::Parts;
use lumencast_light::Light;
use lumencast_picture::{Picture, ToneMap};
use lumencast_scene::{Scene, Snapshot, VolumeSpec};
use lumencast_shade::{Gpu, Lighting, Materials, Renderer, Settings, Shading};
use lumencast_solve::Effort;

use super::drawing::{cells, draw};
use super::judge::{Judge, covered};
use super::traced::{self, SIZE, Traced};
use crate::arguments::{LightmapArguments, Reading, ReadingArguments, VolumeArgument, Wanted};
use crate::charting::{self, Lumels};
use crate::light_source::Computed;
use crate::{camera, out_file, output, warnings};
use reference::References;
use report::{Fault, Field, Report, Table};
pub(super) use subjects::SUBJECTS;
use subjects::{PlaceOfFault, Subject};

/// Samples a probe: 64 updates of 512.
const PROBE_SAMPLES: u32 = 64 * 512;

/// Samples a lumel.
const LUMEL_SAMPLES: u32 = 64;

/// Judges our pictures as those of the published implementation were judged: 320×180, all materials
/// Lambert, against Mitsuba 3.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bench peers ../shared/scenes --references refs --tools ../shared/tools/mitsuba --python VENV/bin/python
  lumencast bench peers ../shared/scenes --references refs --scene sponza --volume 30x18x21 --fit 64 -o pictures

Grids are the published ones, over the scenes' bounds, unless others are given. Each is judged as its
light is gathered and, unless --fit is 0, fitted to surfaces, and the last one once more with lumels on
all still surfaces. References are pictures by Mitsuba 3 of
1024 samples a pixel and 4 bounces, of the first camera. Probes have 3 bounces and 64 × 512 samples
unless told otherwise. PSNR is of codes v^(1/2.2) clamped to 0 to 1 at exposure 1, over pixels that
show nothing but surfaces; in brackets after a filter of 4×4 pixels. The indirect part is the picture's
alone, beside the path tracer's; figures of three.js are its best. Faults that the published
implementation shows are looked for where it shows them: mean and root mean square of what is too
much there, in codes of 0 to 255 after the filter.")]
pub(crate) struct BenchPeers {
    /// The folder of the scenes: cornell, breakfast_room and sponza.
    #[arg(value_name = "FOLDER")]
    scenes: PathBuf,
    /// Only this scene: cornell, breakfast or sponza. May be given several times.
    #[arg(long = "scene", value_name = "NAME", value_parser = SUBJECTS.map(|s| s.name))]
    only: Vec<String>,
    #[command(flatten)]
    references: References,
    /// A grid in place of the published one. May be given several times.
    #[arg(long = "volume", value_name = "NXxNYxNZ[@X,Y,Z:SX,SY,SZ]")]
    volumes: Vec<VolumeArgument>,
    #[command(flatten)]
    reading: ReadingArguments,
    /// Samples a probe.
    #[arg(long, value_name = "N", default_value_t = PROBE_SAMPLES,
          value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    probe_samples: u32,
    /// Samples a lumel, where the last grid stands below lumels of still surfaces; 0 for probes alone.
    #[arg(long, value_name = "N", default_value_t = LUMEL_SAMPLES,
          value_parser = clap::value_parser!(u32).range(0..=1 << 20))]
    lumel_samples: u32,
    #[command(flatten)]
    lightmap: LightmapArguments,
    /// Bounces of the probes.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=64))]
    bounces: u32,
    /// Samples a pixel of the path tracer's indirect part.
    #[arg(long, value_name = "N", default_value_t = 512,
          value_parser = clap::value_parser!(u32).range(2..=1 << 20))]
    indirect_spp: u32,
    /// Writes the pictures, and how they differ from the reference, into this folder: grey where
    /// they do not, brighter where they are too bright, twice enlarged.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

impl BenchPeers {
    pub(crate) fn run(self) -> Result<()> {
        if let Some(folder) = &self.output {
            out_file::check_folder(folder)?;
        }
        let wanted = |s: &&Subject| self.only.is_empty() || self.only.iter().any(|n| n == s.name);
        let subjects: Vec<&Subject> = SUBJECTS.iter().filter(wanted).collect();
        for subject in &subjects {
            let path = self.scenes.join(subject.file);
            ensure!(path.is_file(), "{} is not there", path.display());
        }
        let settings = Settings {
            size: SIZE,
            samples: 64,
            shading: Shading::Samples,
            materials: Materials::Lambert,
            ..Settings::default()
        };
        let mut renderer = Renderer::new(Gpu::new()?, &settings);
        let mut tables = Vec::new();
        for subject in subjects {
            tables.push(self.table(subject, &mut renderer, &settings)?);
        }
        let report = Report {
            adapter: renderer.gpu().name(),
            probe_samples: self.probe_samples,
            lumel_samples: self.lumel_samples,
            bounces: self.bounces,
            scenes: tables,
        };
        if self.json {
            return output::json(&serde_json::to_value(&report)?);
        }
        output::lines(&report.text());
        Ok(())
    }

    fn table(
        &self,
        subject: &'static Subject,
        renderer: &mut Renderer,
        settings: &Settings,
    ) -> Result<Table> {
        let path = self.scenes.join(subject.file);
        let reference = self.references.read(subject, &path)?;
        let mut scene = Scene::open(&path.to_string_lossy())?;
        warnings::left_out(&scene);
        let view = camera::view(&scene, None)?;
        let snapshot = scene.snapshot();
        let judge = Judge::new(reference, covered(renderer, &snapshot, view, settings)?, 1.0)?;
        self.write(subject, "reference", judge.reference())?;
        let mut traced = {
            let (scene, snapshot) = (&scene, &snapshot);
            Traced::new(&traced::Subject { scene, snapshot, view, keep: None }, Parts::Indirect)?
        };
        traced.to(self.indirect_spp)?;
        let covered_pixels = covered(renderer, &snapshot, view, settings)?;
        let indirect = Judge::new(traced.picture()?, covered_pixels, 1.0)?;
        renderer.set_scene(&snapshot);
        let direct = draw(renderer, view, settings, Lighting::DIRECT)?;

        let mut fields = Vec::new();
        for Way { grid, reading, lumels } in self.ways(subject, &mut scene)? {
            renderer.set_light(&self.light(&snapshot, grid, reading, lumels.clone())?)?;
            let picture = draw(renderer, view, settings, Lighting::FIELD)?;
            let how = match (&lumels, reading.fit) {
                (Some(_), _) => "lumels",
                (None, Some(_)) => "fitted",
                (None, None) => "gathered",
            };
            let name = format!("{}-{how}", cells(&grid));
            self.write(subject, &name, &picture)?;
            self.write(subject, &format!("{name}-difference"), &judge.difference(&picture))?;
            let indirect_part = draw(renderer, view, settings, Lighting::INDIRECT)?;
            fields.push(Field {
                grid: cells(&grid),
                order: grid.order,
                fit: reading.fit.map(|fit| fit.points),
                lumels: lumels.as_ref().map(Lumels::of),
                psnr: judge.psnr(&picture)?,
                indirect: indirect.psnr(&indirect_part)?,
                faults: faults(subject, &judge, &picture),
            });
        }
        Ok(Table {
            scene: subject.name,
            published: subject.published,
            without_indirect: judge.psnr(&direct)?,
            fields,
        })
    }

    /// Each grid in each reading; the last of them once more below lumels.
    fn ways(&self, subject: &Subject, scene: &mut Scene) -> Result<Vec<Way>> {
        let published = [VolumeArgument { resolution: subject.cells, place: None }];
        let grids = if self.volumes.is_empty() { &published[..] } else { &self.volumes };
        let mut ways = Vec::new();
        for grid in grids {
            let grid = grid.in_scene(scene).context("--volume")?;
            let readings = self.reading.compared().into_iter();
            ways.extend(readings.map(|reading| Way { grid, reading, lumels: None }));
        }
        if self.lumel_samples > 0
            && let Some(&Way { grid, reading, .. }) = ways.last()
        {
            let mut looks = CpuPathTracer::new(Options::default())?;
            let spec = self.lightmap.spec(scene);
            let lumels = charting::lay_out(&scene.snapshot(), spec, &mut looks)?;
            ways.push(Way { grid, reading, lumels });
        }
        Ok(ways)
    }

    fn light(
        &self,
        snapshot: &Arc<Snapshot>,
        grid: VolumeSpec,
        reading: Reading,
        lightmap: Option<LaidOut>,
    ) -> Result<Light> {
        let materials = MaterialModel::Lambert;
        let tracing = Options { materials, threads: None, levels: Levels::One };
        let lumel_samples = self.lumel_samples.max(1);
        let effort = Effort { lumel_samples, ..Effort::of_samples(self.probe_samples) };
        let (bounces, clamp) = (self.bounces, f32::INFINITY);
        let computed = Computed { effort, bounces, clamp, reading, tracing };
        let mut gatherer = computed.gatherer()?;
        let wanted = Wanted { volumes: vec![grid], lightmap, directional: false };
        Ok(Light::new(computed.light(snapshot, &wanted, &mut *gatherer)?.fields))
    }

    fn write(&self, subject: &Subject, name: &str, picture: &Picture) -> Result<()> {
        let Some(folder) = &self.output else { return Ok(()) };
        let path = folder.join(format!("{}-{name}.png", subject.name));
        Ok(picture.write_png(path, ToneMap::Gamma, 1.0)?)
    }
}

/// A way to hold indirect light.
struct Way {
    grid: VolumeSpec,
    reading: Reading,
    /// Lumels of still surfaces, where they take light from these.
    lumels: Option<LaidOut>,
}

fn faults(subject: &'static Subject, judge: &Judge, picture: &Picture) -> Vec<Fault> {
    let at = |p: &PlaceOfFault| judge.deviation(picture, [p.from, p.to]);
    subject.places.iter().map(|p| Fault { fault: p.fault, deviation: at(p) }).collect()
}
