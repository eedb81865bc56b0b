//! The reference: traced or kept, and judging by it.

use anyhow::{Context, Result};
use glam::UVec2;
use lumencast_gather::reference::{Film, Parts, PictureSettings, Renderer};
use lumencast_picture::{Comparison, Loaded, PIXELS_PER_DEGREE, Picture, compare};
use serde::Serialize;

use super::{BenchQuality, Subject};
use crate::bench::drawing::sum;
use crate::film_file::{FilmFile, KeptFilm};
use crate::fingerprint;

/// The two parts of a path-traced picture.
pub(super) struct Reference {
    pub(super) direct: Picture,
    pub(super) indirect: Picture,
    pub(super) told: Told,
}

/// What is told of a reference beside its pictures.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Told {
    pub(super) samples: u32,
    /// The noise of both parts together, dB; nothing where there is none.
    pub(super) noise_psnr: Option<f64>,
    /// The seconds that a sample a pixel took in both parts; nothing where one was there already.
    pub(super) sample_seconds: Option<f64>,
}

/// What pictures of one size are judged by.
pub(super) struct Judge {
    pub(super) reference: Reference,
    /// The picture of all the reference's light.
    pub(super) whole: Picture,
    /// The camera's exposure, which its pictures of all sizes share.
    pub(super) exposure: f32,
}

impl Judge {
    /// A judge at the exposure given, or else at the reference's own.
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
    /// The reference of a size, traced, or gone on with where it is kept. Its noise is told at the
    /// exposure given, or else its own.
    pub(super) fn reference(
        &self,
        subject: &Subject<'_>,
        size: UVec2,
        exposure: Option<f32>,
    ) -> Result<Reference> {
        // The key takes reading all of the scene's files.
        let key = self.keep.is_some().then(|| self.key(subject)).transpose()?;
        let (direct_film, for_direct) = self.trace(subject, size, key, Parts::Direct)?;
        let (indirect_film, for_indirect) = self.trace(subject, size, key, Parts::Indirect)?;
        let picture = |film: &Film| Picture::new(size.x, size.y, film.picture());
        let (direct, indirect) = (picture(&direct_film)?, picture(&indirect_film)?);
        let own = || lumencast_picture::exposure(&sum(&direct, &indirect));
        let told = Told {
            samples: direct_film.samples().min(indirect_film.samples()),
            noise_psnr: noise_psnr(&direct_film, &indirect_film, exposure.unwrap_or_else(own)),
            sample_seconds: for_direct.zip(for_indirect).map(|(a, b)| a + b),
        };
        Ok(Reference { direct, indirect, told })
    }

    /// One part of the reference, and the seconds that a sample a pixel took; nothing where all samples
    /// were there already.
    fn trace(
        &self,
        subject: &Subject<'_>,
        size: UVec2,
        key: Option<u64>,
        parts: Parts,
    ) -> Result<(Film, Option<f64>)> {
        let name = if parts == Parts::Direct { "direct" } else { "indirect" };
        let scene = subject.scene.name();
        let file = self.keep.as_ref().zip(key).map(|(folder, key)| {
            let file = format!("{scene}-{}x{}-{key:016x}.{name}.film", size.x, size.y);
            FilmFile { path: folder.join(file), key }
        });
        let mut kept = KeptFilm::begun(file, size, self.reference_spp);
        let before = kept.film.samples();
        if before >= self.reference_spp {
            return Ok((kept.film, None));
        }

        let bounces = if parts == Parts::Direct { 1 } else { self.picture.bounces };
        let settings =
            PictureSettings { size, bounces, parts, clamp: self.clamp, ..self.picture.settings() };
        let renderer = Renderer::new(&subject.snapshot, subject.view, settings)
            .context("cannot start the threads that trace")?;
        let what = format!("Tracing {name} light");
        let seconds = kept.refine(&renderer, self.reference_spp, what)?;
        let traced = kept.film.samples() - before;
        Ok((kept.film, Some(seconds / f64::from(traced))))
    }

    /// All that a sample of the reference depends on, but the size.
    fn key(&self, subject: &Subject<'_>) -> Result<u64> {
        let p = &self.picture;
        let said = format!("{:?} {} {} {}", p.camera, p.bounces, p.materials, self.clamp);
        fingerprint::of(subject.scene, said)
    }
}

/// The noise of two films' sum, as a PSNR in dB; nothing where neither film has noise.
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
