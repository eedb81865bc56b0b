//! All that was measured: for machines as it is serialised, for people as tables of markdown.

use std::fmt::Write;

use lumencast_picture::{Comparison, ErrorMap, Picture};
use serde::Serialize;

use super::reference::Told;

/// What was measured, and of what.
#[derive(Serialize)]
pub(super) struct Report {
    pub(super) scene: String,
    pub(super) adapter: String,
    pub(super) bounces: u32,
    pub(super) materials: String,
    /// The samples a pixel of pictures under fields.
    pub(super) samples: u32,
    pub(super) probe_samples: u32,
    pub(super) baseline_frames: u32,
    #[serde(flatten)]
    pub(super) table: Table,
    pub(super) resolutions: Vec<AtResolution>,
}

/// What is measured of pictures of one size.
#[derive(Serialize)]
pub(super) struct Table {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) exposure: f32,
    pub(super) reference: Told,
    /// Direct light as clients draw it, with the reference's indirect light.
    pub(super) direct: Errors,
    pub(super) fields: Vec<Row>,
    pub(super) baseline: Vec<Row>,
    /// The reference.
    #[serde(skip)]
    pub(super) picture: Picture,
}

/// What is measured of square pictures of one size.
#[derive(Serialize)]
pub(super) struct AtResolution {
    /// The pictures' side, pixels.
    pub(super) side: u32,
    pub(super) reference: Told,
    pub(super) field: Row,
    /// The denoised picture's row, where there is a baseline.
    pub(super) baseline: Option<Row>,
}

/// What is measured of a picture.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) name: String,
    pub(super) whole: Errors,
    /// The errors of indirect light, with the reference's direct light on both sides.
    pub(super) indirect: Option<Errors>,
    pub(super) probes: Option<usize>,
    /// The time of an update of the field, or of a path a pixel.
    pub(super) light_seconds: f64,
    /// The time of drawing, or of denoising.
    pub(super) picture_seconds: f64,
    #[serde(skip)]
    pub(super) picture: Picture,
    #[serde(skip)]
    pub(super) difference: ErrorMap,
}

/// How far a picture is from the reference.
#[derive(Clone, Copy, Serialize)]
pub(super) struct Errors {
    pub(super) psnr: f64,
    pub(super) psnr_unclamped: f64,
    pub(super) flip: f64,
    pub(super) ssim: Option<f64>,
}

impl Errors {
    pub(super) fn of(found: &Comparison) -> Self {
        let (psnr, psnr_unclamped) = (found.psnr, found.psnr_unclamped);
        Self { psnr, psnr_unclamped, flip: found.flip.mean(), ssim: found.ssim }
    }
}

impl Row {
    /// The row of a picture without probes; its light and the picture itself took these seconds.
    pub(super) fn new(
        name: String,
        [light_seconds, picture_seconds]: [f64; 2],
        whole: Comparison,
        picture: Picture,
    ) -> Self {
        Self {
            name,
            whole: Errors::of(&whole),
            indirect: None,
            probes: None,
            light_seconds,
            picture_seconds,
            picture,
            difference: whole.flip,
        }
    }

    /// The time that light and picture take together.
    pub(super) fn frame_seconds(&self) -> f64 {
        self.light_seconds + self.picture_seconds
    }

    fn line(&self) -> String {
        let indirect = self.indirect.map(|e| [e.psnr, e.flip]);
        let [psnr, flip] = match indirect {
            Some([psnr, flip]) => [format!("{psnr:.2}"), format!("{flip:.4}")],
            None => Default::default(),
        };
        format!(
            "| {} | {:.2} | {:.2} | {:.4} | {} | {psnr} | {flip} | {} | {:.3} | {:.3} |\n",
            self.name,
            self.whole.psnr,
            self.whole.psnr_unclamped,
            self.whole.flip,
            self.whole.ssim.map_or(String::new(), |ssim| format!("{ssim:.4}")),
            self.probes.map_or(String::new(), |probes| probes.to_string()),
            self.light_seconds,
            self.picture_seconds,
        )
    }
}

impl AtResolution {
    fn line(&self) -> String {
        let times = |row: &Row| {
            let [light, picture] = [row.light_seconds, row.picture_seconds].map(|s| 1e3 * s);
            format!("{:.2} | {light:.1} | {picture:.1}", row.whole.psnr)
        };
        let baseline = self.baseline.as_ref().map_or("| |".into(), times);
        let noise = decibels(self.reference.noise_psnr);
        format!("| {0} × {0} | {noise} | {1} | {baseline} |\n", self.side, times(&self.field))
    }
}

impl Report {
    /// Tables of markdown, which can be read as they are.
    pub(super) fn text(&self) -> String {
        let mut text = self.heading();
        text += "| picture | PSNR | unclamped | FLIP | SSIM | indirect alone | FLIP | probes | \
                 light, s | picture, s |\n";
        text += &rule(10);
        let rows = self.table.fields.iter().chain(&self.table.baseline);
        text.extend(rows.map(Row::line));
        if !self.resolutions.is_empty() {
            text += &self.by_resolution();
        }
        text
    }

    fn heading(&self) -> String {
        let Table { width, height, exposure, reference, direct, .. } = &self.table;
        let mut text = format!(
            "{}, {width} × {height}, {} bounces, exposure {exposure}, {}  \n",
            self.scene, self.bounces, self.adapter
        );
        let (samples, noise) = (reference.samples, decibels(reference.noise_psnr));
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "pictures: {} samples a pixel; light: {} samples a probe; materials: {}  ",
            self.samples, self.probe_samples, self.materials
        );
        let took = reference.sample_seconds.map_or_else(String::new, |one| {
            format!(
                ", {:.0} s, of which 4,096 would take {:.0}",
                one * f64::from(samples),
                4096.0 * one
            )
        });
        let _ = writeln!(text, "reference: {samples} samples a pixel, noise {noise}{took}  ");
        let (psnr, flip) = (direct.psnr, direct.flip);
        let _ = writeln!(text, "direct light alone: {psnr:.2} dB, FLIP {flip:.4}\n");
        text
    }

    fn by_resolution(&self) -> String {
        let name = &self.resolutions[0].field.name;
        let mut text = format!(
            "\n| size | noise of the reference | {name}: PSNR | light, ms | picture, ms | \
             1 spp, BMFR: PSNR | light, ms | picture, ms |\n"
        );
        text += &rule(8);
        text.extend(self.resolutions.iter().map(AtResolution::line));
        text
    }
}

fn rule(columns: usize) -> String {
    format!("|{}\n", " --- |".repeat(columns))
}

fn decibels(psnr: Option<f64>) -> String {
    psnr.map_or("none".into(), |psnr| format!("{psnr:.1} dB"))
}
