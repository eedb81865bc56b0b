//! `lumencast bench quality`: how near a client's pictures come to path-traced ones.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;
use glam::Vec3;
use lumencast_gather::reference::{Film, Parts, PictureSettings};
use lumencast_light::{LightField, OffsetPolicy, Order};
use lumencast_picture::{
    Comparison, Loaded, PIXELS_PER_DEGREE, Picture, ToneMap, compare, exposure,
};
use lumencast_scene::{Scene, Snapshot, View, VolumeSpec};
use lumencast_shade::{Gpu, Lighting, Renderer, Settings, Shading, Shadows};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{cells, draw};
use crate::arguments::{SceneArguments, parse_offset, parse_positive};
use crate::camera::{self, PictureArguments};
use crate::light_source::Computed;
use crate::{fingerprint, output};

/// Texels along the side of a shadow map.
const SHADOW_RESOLUTION: u32 = 4096;

/// Measures how near pictures drawn under light fields come to path-traced ones.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bench quality sponza.glb --environment sky:4 --volume 10x6x7 --volume 20x12x14
  lumencast bench quality breakfast.glb --volume 8x4x8 --orders 2,3,4 --keep references -o pictures

Every --volume is a grid to be measured by itself. A row is a grid and an order; the first grid is also
measured with as many bounces in its probes as the picture has, the second paper's way, where a probe
sees one more than a camera.

PSNR is of codes v^(1/2.2), clamped, at the reference's exposure. Beside the whole picture's it is
told for the indirect light alone, with the reference's direct light on both sides, and for the direct
light alone, with the reference's indirect light on both sides. No picture can be nearer to the reference
than the reference is to its own limit: its noise, told as a PSNR too.")]
pub(crate) struct BenchQuality {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    picture: PictureArguments,
    /// Orders of the spherical harmonics.
    #[arg(long, value_name = "L,…", value_delimiter = ',', default_value = "2,3,4",
          value_parser = crate::arguments::parse_order)]
    orders: Vec<Order>,
    /// Samples a pixel of the reference.
    #[arg(long, value_name = "N", default_value_t = 256,
          value_parser = clap::value_parser!(u32).range(2..=1 << 20))]
    reference_spp: u32,
    /// Upper limit of one path vertex's contribution, cd/m², on both sides.
    #[arg(long, value_name = "CD/M2", default_value = "inf", value_parser = parse_positive)]
    clamp: f32,
    /// Samples a probe: the second paper's 60 updates of 512 unless given.
    #[arg(long, value_name = "N", default_value_t = 60 * 512,
          value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    probe_samples: u32,
    /// Samples a pixel of the pictures that are judged.
    #[arg(long, value_name = "N", default_value_t = 8,
          value_parser = clap::value_parser!(u32).range(1..=1024))]
    samples: u32,
    /// Where in front of a surface the field is read: none, half-cell or metres.
    #[arg(long, value_name = "none|half-cell|METRES", default_value = "half-cell", value_parser = parse_offset)]
    offset: OffsetPolicy,
    /// Keeps the reference in this folder, and takes it from there the next time.
    #[arg(long, value_name = "FOLDER")]
    keep: Option<PathBuf>,
    /// Writes the pictures, and FLIP's differences from the reference, into this folder.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

/// The two parts of a path-traced picture.
struct Reference {
    direct: Picture,
    indirect: Picture,
    told: Told,
}

/// What is kept of a reference beside its pictures.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Told {
    samples: u32,
    /// Of both parts together; nothing where it has no noise.
    noise_psnr: Option<f64>,
    seconds: f64,
}

/// What is measured of a picture.
struct Row {
    name: String,
    whole: Comparison,
    indirect: Comparison,
    probes: usize,
    probe_seconds: f64,
    draw_seconds: f64,
}

impl BenchQuality {
    pub(crate) fn run(self) -> Result<()> {
        for folder in self.keep.iter().chain(&self.output) {
            fs::create_dir_all(folder)
                .with_context(|| format!("cannot make {}", folder.display()))?;
        }
        let mut scene = self.scene.source.open()?;
        let view = camera::view(&scene, self.picture.camera.as_ref())?;
        let snapshot = scene.snapshot();
        let grids = self.scene.volumes(&scene)?;
        ensure!(!grids.is_empty(), "the scene has no volumes; give --volume");

        let reference = self.reference(&scene, &snapshot, view)?;
        let all = sum(&reference.direct, &reference.indirect);
        let exposure = exposure(&all);
        let settings = self.settings(exposure);
        let mut renderer = Renderer::new(Gpu::new()?, &settings);
        renderer.set_scene(&snapshot);
        let direct = draw(&mut renderer, view, &settings, Lighting::DIRECT)?;
        let judged = |picture: &Picture| self.judge(&all, picture, exposure);
        let direct_part = judged(&sum(&direct, &reference.indirect))?;

        let mut rows = Vec::new();
        let below = self.picture.bounces.saturating_sub(1);
        let orders = || self.orders.iter().map(move |order| (*order, below));
        for (number, grid) in grids.iter().enumerate() {
            let as_in_the_paper = (number == 0).then_some((self.orders[0], self.picture.bounces));
            for (order, bounces) in orders().chain(as_in_the_paper) {
                let spec = VolumeSpec { order, ..*grid };
                rows.push(self.row(
                    &mut renderer,
                    &snapshot,
                    view,
                    &reference,
                    spec,
                    bounces,
                    exposure,
                )?);
            }
        }
        self.keep_picture("reference", &all, exposure)?;
        let adapter = renderer.gpu().name();
        if self.json {
            return output::json(&self.report(
                &scene,
                &reference,
                &direct_part,
                &rows,
                exposure,
                &adapter,
            ));
        }
        self.print(&scene, &reference, &direct_part, &rows, exposure, &adapter);
        Ok(())
    }

    fn settings(&self, exposure: f32) -> Settings {
        Settings {
            size: self.picture.size,
            samples: self.samples,
            shading: Shading::Samples,
            materials: self.picture.materials.drawn(),
            shadows: Shadows { resolution: SHADOW_RESOLUTION, ..Shadows::default() },
            pre_exposure: exposure,
            ..Settings::default()
        }
    }

    #[expect(clippy::too_many_arguments, reason = "what a row depends on")]
    fn row(
        &self,
        renderer: &mut Renderer,
        snapshot: &Arc<Snapshot>,
        view: View,
        reference: &Reference,
        spec: VolumeSpec,
        bounces: u32,
        exposure: f32,
    ) -> Result<Row> {
        let name = format!("{} L{} {bounces} bounces", cells(&spec), u8::from(spec.order));
        let start = Instant::now();
        let light = self.light(snapshot, spec, bounces)?;
        let probe_seconds = start.elapsed().as_secs_f64();
        let settings = self.settings(exposure);
        renderer.set_light(&light, self.offset)?;
        let start = Instant::now();
        let whole = draw(renderer, view, &settings, Lighting::FIELD)?;
        let draw_seconds = start.elapsed().as_secs_f64();
        let indirect = draw(renderer, view, &settings, Lighting::INDIRECT)?;
        self.keep_picture(&name, &whole, exposure)?;
        let all = sum(&reference.direct, &reference.indirect);
        let row = Row {
            whole: self.judge(&all, &whole, exposure)?,
            indirect: self.judge(&all, &sum(&reference.direct, &indirect), exposure)?,
            probes: spec.grid.probe_count(),
            probe_seconds,
            draw_seconds,
            name,
        };
        if let Some(folder) = &self.output {
            let path = folder.join(file_name(&format!("{} difference", row.name)));
            row.whole.flip.in_magma().write_png(&path, ToneMap::Srgb, 1.0)?;
        }
        Ok(row)
    }

    fn light(
        &self,
        snapshot: &Arc<Snapshot>,
        spec: VolumeSpec,
        bounces: u32,
    ) -> Result<LightField> {
        let (samples, clamp) = (self.probe_samples, self.clamp);
        let computed = Computed { samples, bounces, clamp, tracing: self.picture.tracing() };
        Ok(LightField::new(computed.volumes(snapshot, &[spec])?))
    }

    fn judge(&self, reference: &Picture, picture: &Picture, exposure: f32) -> Result<Comparison> {
        let [a, b] = [reference, picture].map(|p| Loaded::Linear(p.clone()));
        Ok(compare(&a, &b, Some(exposure), PIXELS_PER_DEGREE)?)
    }

    /// The reference: from the folder where it is kept, or else traced.
    fn reference(&self, scene: &Scene, snapshot: &Arc<Snapshot>, view: View) -> Result<Reference> {
        let known = self.keep.as_ref().map(|folder| folder.join(self.reference_name(scene)));
        if let Some(base) = &known
            && let Some(kept) = kept_reference(base)?
        {
            return Ok(kept);
        }
        let start = Instant::now();
        let trace = |parts, label| self.trace(snapshot, view, parts, label);
        let direct = trace(Parts::Direct, "Tracing direct light")?;
        let indirect = trace(Parts::Indirect, "Tracing indirect light")?;
        let of =
            |film: &Film| Picture::new(self.picture.size.x, self.picture.size.y, film.picture());
        let (direct_picture, indirect_picture) = (of(&direct)?, of(&indirect)?);
        let exposure = exposure(&sum(&direct_picture, &indirect_picture));
        let told = Told {
            samples: self.reference_spp,
            noise_psnr: noise_psnr(&direct, &indirect, exposure),
            seconds: start.elapsed().as_secs_f64(),
        };
        let reference = Reference { direct: direct_picture, indirect: indirect_picture, told };
        if let Some(base) = &known {
            reference.direct.write_exr(beside(base, "direct.exr"))?;
            reference.indirect.write_exr(beside(base, "indirect.exr"))?;
            let path = beside(base, "json");
            fs::write(&path, serde_json::to_string(&told)?)
                .with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(reference)
    }

    /// Of all that the reference depends on.
    fn reference_name(&self, scene: &Scene) -> String {
        let p = &self.picture;
        let said = format!(
            "{:?} {:?} {} {} {:?} {}",
            self.scene.source,
            p.camera,
            p.bounces,
            p.materials,
            scene.environment(),
            self.clamp
        );
        let hash = fingerprint::of(scene, said);
        format!("{}-{}x{}-{}spp-{hash:016x}", scene.name(), p.size.x, p.size.y, self.reference_spp)
    }

    fn trace(
        &self,
        snapshot: &Arc<Snapshot>,
        view: View,
        parts: Parts,
        label: &'static str,
    ) -> Result<Film> {
        let bounces = if parts == Parts::Direct { 1 } else { self.picture.bounces };
        let settings =
            PictureSettings { bounces, parts, clamp: self.clamp, ..self.picture.settings() };
        let renderer = lumencast_gather::reference::Renderer::new(snapshot, view, settings)
            .context("cannot start the threads that trace")?;
        let mut film = Film::new(self.picture.size, self.reference_spp);
        let bar = output::bar(self.reference_spp.into(), label);
        while film.samples() < self.reference_spp {
            // Never told to stop.
            renderer.pass(&mut film, self.reference_spp, &|_| true);
            bar.set_position(film.samples().into());
        }
        bar.finish_and_clear();
        Ok(film)
    }

    fn keep_picture(&self, name: &str, picture: &Picture, exposure: f32) -> Result<()> {
        if let Some(folder) = &self.output {
            picture.write_png(folder.join(file_name(name)), ToneMap::Filmic, exposure)?;
        }
        Ok(())
    }

    fn print(
        &self,
        scene: &Scene,
        reference: &Reference,
        direct: &Comparison,
        rows: &[Row],
        exposure: f32,
        adapter: &str,
    ) {
        let p = &self.picture;
        println!(
            "{}, {} × {}, {} bounces, exposure {exposure}, {adapter}",
            scene.name(),
            p.size.x,
            p.size.y,
            p.bounces
        );
        println!(
            "reference: {} samples a pixel, {:.0} s, noise {}",
            reference.told.samples,
            reference.told.seconds,
            decibels(reference.told.noise_psnr)
        );
        println!("direct light alone: {:.2} dB, FLIP {:.4}\n", direct.psnr, direct.flip.mean());
        println!(
            "| field | PSNR | unclamped | FLIP | SSIM | indirect alone | FLIP | probes | computed, s | drawn, s |"
        );
        println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
        for row in rows {
            println!(
                "| {} | {:.2} | {:.2} | {:.4} | {:.4} | {:.2} | {:.4} | {} | {:.1} | {:.2} |",
                row.name,
                row.whole.psnr,
                row.whole.psnr_unclamped,
                row.whole.flip.mean(),
                row.whole.ssim.unwrap_or(f64::NAN),
                row.indirect.psnr,
                row.indirect.flip.mean(),
                row.probes,
                row.probe_seconds,
                row.draw_seconds,
            );
        }
    }

    fn report(
        &self,
        scene: &Scene,
        reference: &Reference,
        direct: &Comparison,
        rows: &[Row],
        exposure: f32,
        adapter: &str,
    ) -> Value {
        let errors = |c: &Comparison| {
            json!({
                "psnr": c.psnr, "psnr_unclamped": c.psnr_unclamped, "flip": c.flip.mean(),
                "ssim": c.ssim,
            })
        };
        let fields: Vec<Value> = rows
            .iter()
            .map(|row| {
                json!({
                    "field": row.name, "whole": errors(&row.whole),
                    "indirect": errors(&row.indirect), "probes": row.probes,
                    "probe_seconds": row.probe_seconds, "draw_seconds": row.draw_seconds,
                })
            })
            .collect();
        json!({
            "scene": scene.name(), "adapter": adapter,
            "width": self.picture.size.x, "height": self.picture.size.y,
            "bounces": self.picture.bounces, "materials": self.picture.materials.to_string(),
            "samples": self.samples, "probe_samples": self.probe_samples, "exposure": exposure,
            "reference": reference.told, "direct": errors(direct), "fields": fields,
        })
    }
}

fn sum(a: &Picture, b: &Picture) -> Picture {
    let (width, height) = (a.width(), a.height());
    let of = |p: &Picture, x, y| p.pixel(x, y).unwrap_or(Vec3::ZERO);
    Picture::from_fn(width, height, |x, y| of(a, x, y) + of(b, x, y))
}

/// Noise of two films' sum, each with its own.
fn noise_psnr(a: &Film, b: &Film, exposure: f32) -> Option<f64> {
    let psnr = |film: &Film| film.noise(exposure).map(|noise| noise.psnr);
    let error = |psnr: f64| 10f64.powf(-0.1 * psnr);
    let sum = match (psnr(a), psnr(b)) {
        (Some(a), Some(b)) => error(a) + error(b),
        (Some(one), None) | (None, Some(one)) => error(one),
        (None, None) => return None,
    };
    (sum > 0.0).then(|| -10.0 * sum.log10())
}

fn kept_reference(base: &Path) -> Result<Option<Reference>> {
    let path = beside(base, "json");
    if !path.is_file() {
        return Ok(None);
    }
    let text =
        fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let told = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    let read = |part: &str| Loaded::read(beside(base, part)).map(|l| l.stored().clone());
    Ok(Some(Reference { direct: read("direct.exr")?, indirect: read("indirect.exr")?, told }))
}

/// A file of a reference.
fn beside(base: &Path, extension: &str) -> PathBuf {
    let mut name = base.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    name.into()
}

fn file_name(name: &str) -> String {
    format!("{}.png", name.replace(' ', "-"))
}

fn decibels(psnr: Option<f64>) -> String {
    psnr.map_or("none".into(), |psnr| format!("{psnr:.1} dB"))
}
