//! The reference: traced or kept, and judging by it.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use glam::UVec2;
use lumencast_gather::reference::{Film, Parts, PictureSettings, Renderer};
use lumencast_picture::{Comparison, Loaded, PIXELS_PER_DEGREE, Picture, compare};
use serde::{Deserialize, Serialize};

use super::{BenchQuality, Subject, sum};
use crate::{fingerprint, output};

/// The two parts of a path-traced picture.
pub(super) struct Reference {
    pub(super) direct: Picture,
    pub(super) indirect: Picture,
    pub(super) told: Told,
}

/// What is kept of a reference beside its pictures.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Told {
    pub(super) samples: u32,
    /// Of both parts together; nothing where it has no noise.
    pub(super) noise_psnr: Option<f64>,
    pub(super) seconds: f64,
}

/// What pictures of one size are judged by.
pub(super) struct Judge {
    pub(super) reference: Reference,
    /// All of its light.
    pub(super) whole: Picture,
    /// Of the camera, and so of its pictures of all sizes.
    pub(super) exposure: f32,
}

impl Judge {
    /// At the exposure given, or else the reference's own.
    pub(super) fn new(reference: Reference, exposure: Option<f32>) -> Self {
        let whole = sum(&reference.direct, &reference.indirect);
        let exposure = exposure.unwrap_or_else(|| lumencast_picture::exposure(&whole));
        Self { exposure, whole, reference }
    }

    pub(super) fn compare(&self, picture: &Picture) -> Result<Comparison> {
        let [a, b] = [&self.whole, picture].map(|p| Loaded::Linear(p.clone()));
        Ok(compare(&a, &b, Some(self.exposure), PIXELS_PER_DEGREE)?)
    }
}

impl BenchQuality {
    /// The reference of a size: from the folder where it is kept, or else traced. Its noise is told
    /// at the exposure given, or else its own.
    pub(super) fn reference(
        &self,
        subject: &Subject<'_>,
        size: UVec2,
        exposure: Option<f32>,
    ) -> Result<Reference> {
        let name = self.reference_name(subject, size);
        let known = self.keep.as_ref().map(|folder| folder.join(name));
        if let Some(base) = &known
            && let Some(kept) = kept(base)?
        {
            return Ok(kept);
        }
        let start = Instant::now();
        let direct = self.trace(subject, size, Parts::Direct, "Tracing direct light")?;
        let indirect = self.trace(subject, size, Parts::Indirect, "Tracing indirect light")?;
        let picture = |film: &Film| Picture::new(size.x, size.y, film.picture());
        let (direct_picture, indirect_picture) = (picture(&direct)?, picture(&indirect)?);
        let own = || lumencast_picture::exposure(&sum(&direct_picture, &indirect_picture));
        let told = Told {
            samples: self.reference_spp,
            noise_psnr: noise_psnr(&direct, &indirect, exposure.unwrap_or_else(own)),
            seconds: start.elapsed().as_secs_f64(),
        };
        let reference = Reference { direct: direct_picture, indirect: indirect_picture, told };
        if let Some(base) = &known {
            reference.keep(base)?;
        }
        Ok(reference)
    }

    /// Of all that the reference depends on.
    fn reference_name(&self, subject: &Subject<'_>, size: UVec2) -> String {
        let (p, scene) = (&self.picture, subject.scene);
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
        format!("{}-{}x{}-{}spp-{hash:016x}", scene.name(), size.x, size.y, self.reference_spp)
    }

    fn trace(
        &self,
        subject: &Subject<'_>,
        size: UVec2,
        parts: Parts,
        label: &'static str,
    ) -> Result<Film> {
        let bounces = if parts == Parts::Direct { 1 } else { self.picture.bounces };
        let settings =
            PictureSettings { size, bounces, parts, clamp: self.clamp, ..self.picture.settings() };
        let renderer = Renderer::new(&subject.snapshot, subject.view, settings)
            .context("cannot start the threads that trace")?;
        let mut film = Film::new(size, self.reference_spp);
        let bar = output::bar(self.reference_spp.into(), label);
        while film.samples() < self.reference_spp {
            // Never told to stop.
            renderer.pass(&mut film, self.reference_spp, &|_| true);
            bar.set_position(film.samples().into());
        }
        bar.finish_and_clear();
        Ok(film)
    }
}

impl Reference {
    fn keep(&self, base: &Path) -> Result<()> {
        self.direct.write_exr(beside(base, "direct.exr"))?;
        self.indirect.write_exr(beside(base, "indirect.exr"))?;
        let path = beside(base, "json");
        fs::write(&path, serde_json::to_string(&self.told)?)
            .with_context(|| format!("cannot write {}", path.display()))
    }
}

fn kept(base: &Path) -> Result<Option<Reference>> {
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
