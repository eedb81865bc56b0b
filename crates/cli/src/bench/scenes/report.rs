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

/// What is measured of a scene.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) scene: String,
    /// Whether it stands under a sky, having no light of its own.
    pub(super) under_sky: bool,
    pub(super) grids: Vec<String>,
    pub(super) probes: usize,
    /// The samples of a probe.
    pub(super) samples: u32,
    /// The noise of volumes, codes of 0 to 255.
    pub(super) noise: Option<f32>,
    /// The samples of a lumel, where there are some.
    pub(super) lumel_samples: Option<u32>,
    /// The noise of lumels.
    pub(super) lumel_noise: Option<f32>,
    pub(super) exposure: f32,
    /// The PSNR of the picture's indirect part.
    pub(super) psnr: Psnr,
    /// The same scene's light, computed in other ways.
    pub(super) beside: Vec<Beside>,
    /// The reference's noise after the filter, as a PSNR in dB.
    pub(super) reference_noise: f64,
    /// The reference's samples a pixel.
    pub(super) reference_samples: u32,
}

/// Light that was computed in another way.
#[derive(Serialize)]
pub(super) struct Beside {
    pub(super) what: String,
    pub(super) psnr: Psnr,
}

impl Report {
    /// A table of markdown, which can be read as it is.
    pub(super) fn text(&self) -> String {
        let beside = self.rows.first().map_or(&[][..], |row| &row.beside);
        let more: String = beside.iter().map(|beside| format!(" {} |", beside.what)).collect();
        let mut text = format!(
            "| scene | grid | samples a receiver | noise, codes | indirect part, dB |{more} \
             reference's noise |\n|{}\n",
            " --- |".repeat(6 + beside.len())
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
    /// The row as a line of the table.
    pub(super) fn line(&self) -> String {
        let star = if self.under_sky { "*" } else { "" };
        let shown = |noise: Option<f32>| noise.map_or("off".into(), |noise| format!("{noise:.2}"));
        let both = |probes: String, lumels: Option<String>| {
            [probes].into_iter().chain(lumels).collect::<Vec<_>>().join(", ")
        };
        let noise = both(shown(self.noise), self.lumel_samples.map(|_| shown(self.lumel_noise)));
        let samples = both(self.samples.to_string(), self.lumel_samples.map(|n| n.to_string()));
        let beside = |beside: &Beside| {
            let Psnr { sharp, filtered } = beside.psnr;
            format!(" {sharp:.1} ({filtered:.1}), {:+.2} |", filtered - self.psnr.filtered)
        };
        let beside: String = self.beside.iter().map(beside).collect();
        format!(
            "| {}{star} | {} | {} | {noise} | {:.1} ({:.1}) |{beside} {:.1} |",
            self.scene,
            self.grids.join(", "),
            samples,
            self.psnr.sharp,
            self.psnr.filtered,
            self.reference_noise
        )
    }
}
