//! `lumencast compare`: how far a picture is from its reference.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Args;
use lumencast_picture::{Comparison, Loaded, PIXELS_PER_DEGREE, ToneMap, compare};
use serde_json::{Value, json};

use crate::arguments::Exposure;
use crate::{
    out_file,
    output::{self, say},
};

/// Says how far a picture is from a reference: PSNR, FLIP, SSIM, MSE (.png, .exr, .hdr).
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast compare reference.exr picture.exr
  lumencast compare reference.exr picture.exr --exposure 0.02 --json
  lumencast compare reference.png picture.png -o difference.png

PSNR, SSIM and FLIP are of display codes: those of a PNG as stored, v^(1/2.2) of linear values times
the exposure, peak 1, clamped to 0 to 1 except for psnr_unclamped. HDR-FLIP is of linear values, where
both files have them; it finds its exposures itself. MSE and relative MSE, (p−r)²/(r²+0.01), are of
linear values times the exposure. A PNG beside a linear file is decoded by the curve of sRGB and
encoded again as that file is; the exposure is not applied to it. FLIP and HDR-FLIP are means over
pixels, 0 to 1. docs/drawing.md gives definitions and sources.

In JSON a PSNR of equal pictures, which is infinite, is null; so are SSIM of pictures under 11 × 11
pixels and HDR-FLIP with a PNG. exposure is the factor used.")]
pub(crate) struct Compare {
    /// What is held to be right.
    reference: PathBuf,
    /// What is judged; of the same size.
    picture: PathBuf,
    /// Factor on linear values: a number, or auto: 1 over the 99th percentile of the reference's
    /// luminance, and 1 where the reference is a PNG.
    #[arg(long, value_name = "auto|NUMBER", default_value = "auto")]
    exposure: Exposure,
    /// Pixels per degree of the visual field, for FLIP: 67 is a monitor 0.7 m wide of 3840 pixels,
    /// seen from 0.7 m.
    #[arg(long, value_name = "NUMBER", default_value = "67", value_parser = parse_ppd)]
    ppd: f32,
    /// Writes FLIP's error of every pixel in the colours of magma: black none, pale yellow largest.
    #[arg(short, long, value_name = "DIFFERENCE.png")]
    output: Option<PathBuf>,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

fn parse_ppd(text: &str) -> Result<f32, String> {
    match text.parse() {
        // The paper's conditions are called 67 and are a little more.
        Ok(67.0) => Ok(PIXELS_PER_DEGREE),
        Ok(ppd) if (1.0..=1000.0).contains(&ppd) => Ok(ppd),
        _ => Err("give a number from 1 to 1000".into()),
    }
}

impl Compare {
    pub(crate) fn run(self) -> Result<()> {
        if let Some(output) = &self.output {
            let is_png = output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
            ensure!(is_png, "{}: the difference is written as PNG; name it so", output.display());
            out_file::check(output)?;
            out_file::check_apart([output], &[self.reference.clone(), self.picture.clone()])?;
        }
        let (reference, picture) = (Loaded::read(&self.reference)?, Loaded::read(&self.picture)?);
        let found = compare(&reference, &picture, self.exposure.0, self.ppd)
            .with_context(|| format!("{}, {}", self.reference.display(), self.picture.display()))?;
        if let Some(output) = &self.output {
            found.flip.in_magma().write_png(output, ToneMap::Srgb, 1.0)?;
        }
        if self.json {
            return output::json(&self.report(&reference, &found));
        }
        say!("PSNR          {:.3} dB", found.psnr);
        say!("  unclamped   {:.3} dB", found.psnr_unclamped);
        say!("FLIP          {:.5}", found.flip.mean());
        if let Some(hdr) = &found.flip_hdr {
            let range = format!("2^{:.2} to 2^{:.2}", hdr.start, hdr.stop);
            say!("HDR-FLIP      {:.5}   {} exposures, {range}", hdr.map.mean(), hdr.exposures);
        }
        if let Some(ssim) = found.ssim {
            say!("SSIM          {ssim:.5}");
        }
        say!("MSE           {:.4e}", found.mse);
        say!("relative MSE  {:.4e}", found.relative_mse);
        say!("exposure      {}", found.exposure);
        Ok(())
    }

    fn report(&self, reference: &Loaded, found: &Comparison) -> Value {
        let hdr = found.flip_hdr.as_ref();
        json!({
            "reference": self.reference,
            "picture": self.picture,
            "width": reference.stored().width(),
            "height": reference.stored().height(),
            "exposure": found.exposure,
            "ppd": self.ppd,
            // What is not finite becomes null.
            "psnr": found.psnr,
            "psnr_unclamped": found.psnr_unclamped,
            "flip": found.flip.mean(),
            "flip_hdr": hdr.map(|hdr| hdr.map.mean()),
            "flip_hdr_exposures": hdr.map(|hdr| json!({
                "start": hdr.start, "stop": hdr.stop, "count": hdr.exposures,
            })),
            "ssim": found.ssim,
            "mse": found.mse,
            "relative_mse": found.relative_mse,
        })
    }
}
