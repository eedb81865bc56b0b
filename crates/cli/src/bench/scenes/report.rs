//! All that was measured: for machines as it is serialised, for people as a table of markdown.

use std::fmt::Write;

use serde::Serialize;

use crate::bench::judge::Psnr;

#[derive(Serialize)]
pub(super) struct Report {
    pub(super) adapter: String,
    #[serde(rename = "scenes")]
    pub(super) rows: Vec<Row>,
}

/// Of a scene.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) scene: String,
    /// Whether it stands under a sky, having no light of its own.
    pub(super) under_sky: bool,
    pub(super) grids: Vec<String>,
    pub(super) probes: usize,
    /// Of a probe.
    pub(super) samples: u32,
    /// Of the field, codes of 0 to 255.
    pub(super) noise: Option<f32>,
    pub(super) exposure: f32,
    /// Of the indirect part.
    pub(super) psnr: Psnr,
    /// The same of more samples.
    pub(super) beside: Option<Beside>,
    /// After the filter, dB.
    pub(super) reference_noise: f64,
    /// A pixel.
    pub(super) reference_samples: u32,
}

/// A field of more samples.
#[derive(Serialize)]
pub(super) struct Beside {
    /// So many times as many.
    pub(super) times: u32,
    pub(super) psnr: Psnr,
}

impl Report {
    /// A table of markdown, which can be read as it is.
    pub(super) fn text(&self) -> String {
        let times = self.rows.iter().find_map(|row| row.beside.as_ref()).map(|beside| beside.times);
        let more = times.map_or(String::new(), |times| format!(" {times} times the samples |"));
        let mut text = format!(
            "| scene | grid | samples a probe | noise, codes | indirect part, dB |{more} \
             reference's noise |\n|{}\n",
            " --- |".repeat(6 + usize::from(times.is_some()))
        );
        for row in &self.rows {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{}", row.line());
        }
        let sky = "Scenes marked * have no light and stand under a sky of 1,000 lux.";
        text + &format!("\n{sky} Drawn by {}.\n", self.adapter)
    }
}

impl Row {
    /// Of the table.
    pub(super) fn line(&self) -> String {
        let star = if self.under_sky { "*" } else { "" };
        let noise = self.noise.map_or("off".into(), |noise| format!("{noise:.2}"));
        let beside = self.beside.as_ref().map_or(String::new(), |beside| {
            format!(
                " {:.1} ({:.1}), {:+.2} |",
                beside.psnr.sharp,
                beside.psnr.filtered,
                beside.psnr.filtered - self.psnr.filtered
            )
        });
        format!(
            "| {}{star} | {} | {} | {noise} | {:.1} ({:.1}) |{beside} {:.1} |",
            self.scene,
            self.grids.join(", "),
            self.samples,
            self.psnr.sharp,
            self.psnr.filtered,
            self.reference_noise
        )
    }
}
