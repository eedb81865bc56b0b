//! `lumencast bench peers`: our pictures by the protocol by which the second paper's published
//! implementation was measured.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use glam::{UVec2, Vec3};
use lumencast_gather::path_trace::{MaterialModel, Options};
use lumencast_light::{LightField, OffsetPolicy};
use lumencast_picture::{Loaded, Pair, Picture, gamma_code, psnr};
use lumencast_scene::{Environment, Material, Scene, Snapshot, View, VolumeSpec};
use lumencast_shade::{Gpu, Lighting, Materials, Renderer, Settings, Shading};
use serde_json::{Value, json};

use super::{cells, draw};
use crate::arguments::{FitArguments, SceneArguments, parse_offset};
use crate::camera;
use crate::light_source::Computed;
use crate::output;

/// Pixels of the pictures.
const SIZE: UVec2 = UVec2::new(320, 180);
/// Samples a probe: 64 updates of 512.
const PROBE_SAMPLES: u32 = 64 * 512;
/// Side of the filter that takes the reference's noise away, pixels.
const FILTER: u32 = 4;
/// Samples a pixel and bounces of the reference.
const REFERENCE: [(&str, &str); 2] = [("--spp", "1024"), ("--bounces", "4")];

/// Judges our pictures as those of the published implementation were judged: 320×180, all materials
/// Lambert, against Mitsuba 3.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bench peers CornellBoxPoint.glb --volume 8x8x8 --reference box.exr --tools ../shared/tools/mitsuba --python VENV/bin/python
  lumencast bench peers Sponza.glb --volume 10x6x7 --reference sponza-mitsuba.exr

The reference is a picture by Mitsuba 3 of 1024 samples a pixel and 4 bounces, of the first camera;
--tools and --python make it where --reference is not there yet. Probes have 3 bounces and 64 × 512
samples unless told otherwise. PSNR is of codes v^(1/2.2) clamped to 0 to 1 at exposure 1, over pixels
that show nothing but surfaces; in brackets after a filter of 4×4 pixels.")]
pub(crate) struct BenchPeers {
    #[command(flatten)]
    scene: SceneArguments,
    /// The reference, .exr; made where it is not there.
    #[arg(long, value_name = "FILE.exr")]
    reference: PathBuf,
    /// The folder of conv.py and mitsuba_ref.py.
    #[arg(long, value_name = "FOLDER")]
    tools: Option<PathBuf>,
    /// A Python that has Mitsuba 3, NumPy and Pillow.
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    python: PathBuf,
    /// Where in front of a surface the field is read: none, half-cell or metres.
    #[arg(long, value_name = "none|half-cell|METRES", default_value = "half-cell", value_parser = parse_offset)]
    offset: OffsetPolicy,
    #[command(flatten)]
    fit: FitArguments,
    /// Samples a probe.
    #[arg(long, value_name = "N", default_value_t = PROBE_SAMPLES,
          value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    probe_samples: u32,
    /// Bounces of the probes.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=64))]
    bounces: u32,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

impl BenchPeers {
    pub(crate) fn run(self) -> Result<()> {
        if !self.reference.is_file() {
            self.make_reference()?;
        }
        let reference = Loaded::read(&self.reference)?.linear();
        let size = UVec2::new(reference.width(), reference.height());
        ensure!(size == SIZE, "{}: {size} pixels instead of {SIZE}", self.reference.display());
        let mut scene = self.scene.source.open()?;
        let view = camera::view(&scene, None)?;
        let snapshot = scene.snapshot();
        let grids = self.scene.volumes(&scene)?;
        let settings = Settings {
            size: SIZE,
            samples: 64,
            shading: Shading::Samples,
            materials: Materials::Lambert,
            ..Settings::default()
        };
        let mut renderer = Renderer::new(Gpu::new()?, &settings);
        let covered = covered(&mut renderer, &snapshot, view, &settings)?;
        renderer.set_scene(&snapshot);
        let direct = draw(&mut renderer, view, &settings, Lighting::DIRECT)?;

        let mut rows = Vec::new();
        for grid in &grids {
            let light = self.light(&snapshot, *grid)?;
            renderer.set_light(&light, self.offset)?;
            let picture = draw(&mut renderer, view, &settings, Lighting::FIELD)?;
            rows.push((*grid, judge(&reference, &picture, &covered)?));
        }
        let without = judge(&reference, &direct, &covered)?;
        if self.json {
            return output::json(&report(&scene, &rows, without, &renderer.gpu().name()));
        }
        println!("{}, {}", scene.name(), renderer.gpu().name());
        for (grid, [sharp, filtered]) in &rows {
            println!("{} L{}: {sharp:.1} ({filtered:.1}) dB", cells(grid), u8::from(grid.order));
        }
        println!("without indirect light: {:.1} ({:.1}) dB", without[0], without[1]);
        Ok(())
    }

    fn light(&self, snapshot: &Arc<Snapshot>, grid: VolumeSpec) -> Result<LightField> {
        let tracing = Options { materials: MaterialModel::Lambert, threads: None };
        let (samples, bounces) = (self.probe_samples, self.bounces);
        let fit = self.fit.options(0, self.offset);
        let computed = Computed { samples, bounces, clamp: f32::INFINITY, fit, tracing };
        Ok(LightField::new(computed.volumes(snapshot, &[grid])?))
    }

    /// The reference, by Mitsuba.
    fn make_reference(&self) -> Result<()> {
        let Some(tools) = &self.tools else {
            bail!(
                "{} is not there: give --tools, the folder of mitsuba_ref.py, to make it",
                self.reference.display()
            );
        };
        let plain = self.reference.with_extension("scene");
        self.python(&tools.join("conv.py"), |run| {
            run.arg(&self.scene.source.scene).arg(&plain);
        })?;
        let [width, height] = SIZE.to_array().map(|n| n.to_string());
        eprintln!("Mitsuba draws the reference: this takes minutes.");
        self.python(&tools.join("mitsuba_ref.py"), |run| {
            run.arg("render").arg(plain.join("scene.json")).arg(&self.reference);
            run.args(["--width", &width, "--height", &height, "--alpha", "opaque"]);
            run.args(REFERENCE.iter().flat_map(|(name, value)| [name, value]));
        })
    }

    fn python(&self, script: &Path, arguments: impl FnOnce(&mut Command)) -> Result<()> {
        let mut run = Command::new(&self.python);
        run.arg(script);
        arguments(&mut run);
        let output =
            run.output().with_context(|| format!("cannot start {}", self.python.display()))?;
        ensure!(
            output.status.success(),
            "{}: {}",
            script.display(),
            String::from_utf8_lossy(&output.stderr).trim()
        );
        Ok(())
    }
}

/// Which pixels show nothing but surfaces: those where no environment is seen, were there nothing
/// else that shines.
fn covered(
    renderer: &mut Renderer,
    snapshot: &Snapshot,
    view: View,
    settings: &Settings,
) -> Result<Vec<bool>> {
    let dark = |m: &Material| Material { emissive: Vec3::ZERO, ..m.clone() };
    let silhouette = Snapshot {
        materials: snapshot.materials.iter().map(dark).collect(),
        environment: Environment::Constant { radiance: Vec3::ONE },
        ..snapshot.clone()
    };
    renderer.set_scene(&Arc::new(silhouette));
    let picture = draw(renderer, view, settings, Lighting::NONE)?;
    Ok(picture.pixels().iter().map(|p| *p == Vec3::ZERO).collect())
}

/// PSNR, and the same of filtered pictures, over covered pixels.
fn judge(reference: &Picture, picture: &Picture, covered: &[bool]) -> Result<[f64; 2]> {
    let filtered = |p: &Picture| filtered(p, covered);
    let of = |a: Vec<Vec3>, b: Vec<Vec3>| -> Result<f64> {
        ensure!(!a.is_empty(), "the camera sees no surface");
        let [a, b] = [a, b].map(|codes| {
            let codes: Vec<Vec3> =
                codes.into_iter().map(|v| gamma_code(v).clamp(Vec3::ZERO, Vec3::ONE)).collect();
            Picture::new(codes.len() as u32, 1, codes)
        });
        Ok(psnr(&Pair::new(&a?, &b?)?))
    };
    let shown = |p: &Picture| -> Vec<Vec3> {
        p.pixels().iter().zip(covered).filter(|(_, covered)| **covered).map(|(p, _)| *p).collect()
    };
    Ok([of(shown(reference), shown(picture))?, of(filtered(reference), filtered(picture))?])
}

/// Means over blocks of pixels that are covered all.
fn filtered(picture: &Picture, covered: &[bool]) -> Vec<Vec3> {
    let blocks = SIZE / FILTER;
    let block = |b: u32| {
        let corner = FILTER * UVec2::new(b % blocks.x, b / blocks.x);
        let mut sum = Vec3::ZERO;
        for i in 0..FILTER * FILTER {
            let at = corner + UVec2::new(i % FILTER, i / FILTER);
            let index = (at.y * SIZE.x + at.x) as usize;
            if !covered[index] {
                return None;
            }
            sum += picture.pixels()[index];
        }
        Some(sum / (FILTER * FILTER) as f32)
    };
    (0..blocks.element_product()).filter_map(block).collect()
}

fn report(
    scene: &Scene,
    rows: &[(VolumeSpec, [f64; 2])],
    [without, without_filtered]: [f64; 2],
    adapter: &str,
) -> Value {
    let fields: Vec<Value> = rows
        .iter()
        .map(|(grid, [sharp, filtered])| {
            json!({
                "grid": cells(grid), "order": grid.order, "psnr": sharp, "psnr_filtered": filtered,
            })
        })
        .collect();
    json!({
        "scene": scene.name(), "adapter": adapter, "fields": fields,
        "without_indirect": { "psnr": without, "psnr_filtered": without_filtered },
    })
}
