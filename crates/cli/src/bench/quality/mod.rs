//! `lumencast bench quality`: how near a client's pictures come to path-traced ones.

mod baseline;
mod document;
mod field;
mod plot;
mod reference;
mod report;
mod results;
mod sheet;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use clap::Args;
use glam::UVec2;
use lumencast_gather::path_trace::CpuPathTracer;
use lumencast_light::Order;
use lumencast_scene::{Scene, Snapshot, View, VolumeSpec};
use lumencast_shade::{Gpu, Renderer, Settings, Shading, Shadows};

use crate::arguments::{ReadingArguments, SceneArguments};
use crate::camera::{self, PictureArguments};
use crate::values::parse_positive;
use crate::{out_file, output};
use field::{Canvas, Field};
use reference::Judge;
use report::{AtResolution, Report, Table};

/// Texels along the side of a shadow map.
const SHADOW_RESOLUTION: u32 = 4096;

/// Measures how near pictures drawn under fields come to path-traced ones.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bench quality sponza.glb --environment sky:4 --volume 10x6x7 --volume 20x12x14
  lumencast bench quality breakfast.glb --volume 8x4x8 --orders 2,3,4 --keep references -o results
  lumencast bench quality breakfast.glb --volume 8x4x8 --resolutions 64,128,256,512 -o results
  lumencast bench quality breakfast.glb --volume 8x4x8 --document docs/results/pictures-breakfast.md

Every --volume is a grid to be measured by itself. A row is a grid and an order, as its light is
gathered, and, unless --fit is 0, another one fitted to surfaces; the first grid is also measured, as
gathered, with as many bounces in its probes as the picture has, the second paper's way, where a probe
sees one more than a camera. Two rows are the baseline: one path a pixel, as it is, and after as many
frames denoised by BMFR (Koskela et al. 2019), whose pictures end at white.

PSNR is of codes v^(1/2.2), clamped, at the reference's exposure. Beside the whole picture's it is
told for the indirect light alone, with the reference's direct light on both sides, and for the direct
light alone, with the reference's indirect light on both sides. No picture can be nearer to the reference
than the reference is to its own limit: its noise, told as a PSNR too.

Times are those of a frame: an update of 512 samples a probe, or a path a pixel; and drawing, or
denoising.")]
pub(crate) struct BenchQuality {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    picture: PictureArguments,
    /// Orders of the spherical harmonics.
    #[arg(long, value_name = "L,…", value_delimiter = ',', default_value = "2,3,4",
          value_parser = crate::values::parse_order)]
    orders: Vec<Order>,
    /// Samples a pixel of the reference.
    #[arg(long, value_name = "N", default_value_t = 256,
          value_parser = clap::value_parser!(u32).range(2..=1 << 20))]
    reference_spp: u32,
    /// Upper limit of one path vertex's contribution, cd/m², on both sides.
    #[arg(long, value_name = "CD/M2", default_value = "inf", value_parser = parse_positive)]
    clamp: f32,
    /// Samples a probe: the second paper's 60 updates of 512 unless given.
    #[arg(long, value_name = "N", default_value_t = 60 * field::UPDATE,
          value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    probe_samples: u32,
    /// Samples a pixel of the pictures that are judged.
    #[arg(long, value_name = "N", default_value_t = 8,
          value_parser = clap::value_parser!(u32).range(1..=1024))]
    samples: u32,
    /// Frames of one path a pixel that the baseline's last picture follows on; 0 for no baseline.
    #[arg(long, value_name = "N", default_value_t = 60,
          value_parser = clap::value_parser!(u32).range(0..=100_000))]
    baseline_frames: u32,
    /// Sides of square pictures that the first grid's first order and the baseline are measured in too,
    /// pixels shaded once, at the same exposure.
    #[arg(long, value_name = "PIXELS,…", value_delimiter = ',',
          value_parser = clap::value_parser!(u32).range(1..=16_384))]
    resolutions: Vec<u32>,
    #[command(flatten)]
    reading: ReadingArguments,
    /// Keeps the references in this folder, also while they grow, and goes on from there the next time:
    /// with more samples where more are asked for.
    #[arg(long, value_name = "FOLDER")]
    keep: Option<PathBuf>,
    /// Writes quality.md into this folder: the tables, with pictures, FLIP's differences from the
    /// reference, and plots.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Puts the tables into this document of markdown, in place of the section that an earlier run put
    /// there or at its end, with one picture of pictures and the plots in pictures/ beside it.
    #[arg(long, value_name = "FILE")]
    document: Option<PathBuf>,
    /// The name of that section; the scene's unless given.
    #[arg(long, value_name = "NAME", requires = "document", value_parser = document::parse_name)]
    section: Option<String>,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

/// What is seen, and from where.
struct Subject<'a> {
    scene: &'a Scene,
    snapshot: Arc<Snapshot>,
    view: View,
}

impl BenchQuality {
    pub(crate) fn run(self) -> Result<()> {
        for folder in self.keep.iter().chain(&self.output) {
            out_file::check_folder(folder)?;
        }
        let mut scene = self.scene.source.open()?;
        out_file::check_apart(&self.document, &self.scene.source.files(&scene))?;
        let section = self.section.clone().unwrap_or_else(|| scene.name().to_owned());
        if let Some(document) = &self.document {
            document::check(&section, document)?;
        }
        let mut tracer = CpuPathTracer::new(self.picture.tracing())
            .context("cannot start the threads that trace")?;
        let grids = self.scene.volumes(&mut scene, &mut tracer)?;
        let snapshot = scene.snapshot();
        let view = camera::view(&scene, self.picture.camera.as_ref())?;
        let subject = Subject { scene: &scene, snapshot, view };
        ensure!(!grids.is_empty(), "the scene has no volumes; give --volume");

        let mut renderer = Renderer::new(Gpu::new()?, &Settings::default());
        renderer.set_scene(&subject.snapshot);
        let fields = self.fields(&subject, &grids)?;
        let table = self.table(&subject, &mut renderer, &fields)?;
        let resolutions =
            self.by_resolution(&subject, &mut renderer, &fields[0], table.exposure)?;
        let report = Report {
            scene: scene.name().to_owned(),
            adapter: renderer.gpu().name(),
            bounces: self.picture.bounces,
            materials: self.picture.materials.to_string(),
            samples: self.samples,
            probe_samples: self.probe_samples,
            baseline_frames: self.baseline_frames,
            table,
            resolutions,
        };
        if let Some(folder) = &self.output {
            results::write(&report, folder)?;
        }
        if let Some(document) = &self.document {
            document::write(&report, &section, document)?;
        }
        if self.json {
            return output::json(&serde_json::to_value(&report)?);
        }
        output::lines(&report.text());
        Ok(())
    }

    /// The light of every grid in every order, and the first grid's with a bounce more.
    fn fields(&self, subject: &Subject<'_>, grids: &[VolumeSpec]) -> Result<Vec<Field>> {
        let mut fields = Vec::new();
        let below = self.picture.bounces.saturating_sub(1);
        let readings = self.reading.compared();
        for (number, grid) in grids.iter().enumerate() {
            let each =
                |&order: &Order| readings.iter().map(move |reading| (order, below, *reading));
            let in_the_paper = if number == 0 { &self.orders[..] } else { &[] };
            let as_in_the_paper =
                in_the_paper.iter().map(|&order| (order, self.picture.bounces, readings[0]));
            let rows = self.orders.iter().flat_map(each).chain(as_in_the_paper);
            for (order, bounces, reading) in rows {
                fields.push(self.field(
                    subject,
                    VolumeSpec { order, ..*grid },
                    bounces,
                    reading,
                )?);
            }
        }
        Ok(fields)
    }

    fn table(
        &self,
        subject: &Subject<'_>,
        renderer: &mut Renderer,
        fields: &[Field],
    ) -> Result<Table> {
        let size = self.picture.size;
        let judge = Judge::new(self.reference(subject, size, None)?, None);
        let settings = self.settings(size, Shading::Samples, &judge);
        let mut canvas = Canvas { renderer, view: subject.view, settings };
        let direct = canvas.direct(&judge)?;
        let fields = fields.iter().map(|field| canvas.row(field, &judge)).collect::<Result<_>>()?;
        Ok(Table {
            width: size.x,
            height: size.y,
            direct,
            fields,
            baseline: self.baseline(subject, size, &judge)?,
            exposure: judge.exposure,
            reference: judge.reference.told,
            picture: judge.whole,
        })
    }

    /// Square pictures under one field, of each of the sizes asked for.
    fn by_resolution(
        &self,
        subject: &Subject<'_>,
        renderer: &mut Renderer,
        field: &Field,
        exposure: f32,
    ) -> Result<Vec<AtResolution>> {
        let exposure = Some(exposure);
        let mut rows = Vec::new();
        for &side in &self.resolutions {
            let size = UVec2::splat(side);
            let judge = Judge::new(self.reference(subject, size, exposure)?, exposure);
            let settings = self.settings(size, Shading::Pixels, &judge);
            let mut canvas = Canvas { renderer: &mut *renderer, view: subject.view, settings };
            rows.push(AtResolution {
                side,
                field: canvas.row(field, &judge)?,
                baseline: self.baseline(subject, size, &judge)?.pop(),
                reference: judge.reference.told,
            });
        }
        Ok(rows)
    }

    fn settings(&self, size: UVec2, shading: Shading, judge: &Judge) -> Settings {
        Settings {
            size,
            samples: self.samples,
            shading,
            materials: self.picture.materials.drawn(),
            shadows: Shadows { resolution: SHADOW_RESOLUTION, ..Shadows::default() },
            pre_exposure: judge.exposure,
            ..Settings::default()
        }
    }
}
