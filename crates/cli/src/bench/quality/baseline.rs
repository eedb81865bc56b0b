//! What fields are compared with: one path a pixel and frame, as it is and denoised.

use std::time::Instant;

use anyhow::{Context, Result};
use glam::UVec2;
use lumencast_gather::reference::{PictureSettings, Renderer};
use lumencast_picture::Picture;

use super::reference::Judge;
use super::report::Row;
use super::{BenchQuality, Subject};
use crate::bench::bmfr::Bmfr;
use crate::output;

/// The paths' seed: none of them must be among the reference's.
const SEED: u64 = 2;

impl BenchQuality {
    /// The last of some frames, and what BMFR makes of all of them; none where none are asked for.
    pub(super) fn baseline(
        &self,
        subject: &Subject<'_>,
        size: UVec2,
        judge: &Judge,
    ) -> Result<Vec<Row>> {
        let settings = PictureSettings {
            size,
            clamp: self.clamp,
            seed: SEED,
            follow_sun: false,
            ..self.picture.settings()
        };
        let renderer = Renderer::new(&subject.snapshot, subject.view, settings)
            .context("cannot start the threads that trace")?;
        let mut denoiser = Bmfr::new(size, judge.exposure);
        let (mut tracing, mut denoising, mut last) = (0.0, 0.0, None);
        let bar = output::bar(self.baseline_frames.into(), "Denoising frames of one path a pixel");
        for number in 0..self.baseline_frames {
            let start = Instant::now();
            let frame = renderer.frame(number);
            tracing += start.elapsed().as_secs_f64();
            let start = Instant::now();
            denoiser.add(&frame);
            denoising += start.elapsed().as_secs_f64();
            last = Some(frame);
            bar.inc(1);
        }
        bar.finish_and_clear();
        let Some(last) = last else { return Ok(Vec::new()) };
        let raw = last.samples.iter().map(|sample| sample.radiance).collect();
        let pictures =
            [("1 spp", Picture::new(size.x, size.y, raw)?), ("1 spp, BMFR", denoiser.picture()?)];
        let [tracing, denoising] =
            [tracing, denoising].map(|seconds| seconds / f64::from(self.baseline_frames));
        let row = |((name, picture), denoising): ((&str, Picture), f64)| {
            let seconds = [tracing, denoising];
            Ok(Row::new(name.to_owned(), seconds, judge.compare(&picture)?, picture))
        };
        pictures.into_iter().zip([0.0, denoising]).map(row).collect()
    }
}
