//! How an adapter is to draw pictures.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use glam::UVec2;

use crate::arguments::{EffortArguments, FieldsArguments, MOST_SAMPLES, ReadingArguments};
use crate::light_source;
use crate::values::{parse_occlusion, parse_positive};

/// How an adapter draws.
#[derive(Debug, Args)]
#[command(next_help_heading = "Pictures drawn by an adapter")]
pub(crate) struct RasterArguments {
    /// The light: a file of `lumencast bake`, or the address of a server's scene. Computed where
    /// it is not given.
    #[arg(long, value_name = "FILE|URL")]
    pub(super) light: Option<String>,
    /// Samples a probe where the field is computed, at most.
    #[arg(long, value_name = "N", default_value_t = MOST_SAMPLES,
          value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub(super) probe_samples: u32,
    #[command(flatten)]
    pub(super) effort: EffortArguments,
    #[command(flatten)]
    pub(super) fields: FieldsArguments,
    #[command(flatten)]
    pub(super) reading: ReadingArguments,
    /// Takes ringing out of the field by a Hann window that ends at this band; 3 leaves order 2 a
    /// quarter of its band 2. None unless given.
    #[arg(long, value_name = "BAND", value_parser = parse_positive)]
    pub(super) window: Option<f32>,
    /// How often surfaces are shaded: once a sample, or once a pixel, which is faster.
    #[arg(long, value_enum, default_value_t = ShadingArgument::Samples)]
    pub(super) shading: ShadingArgument,
    /// Texels along the side of a shadow map; 0 draws no shadows.
    #[arg(long, value_name = "N", default_value_t = 4096,
          value_parser = clap::value_parser!(u32).range(0..=16_384))]
    pub(super) shadow_resolution: u32,
    /// Samples of a shadow's edge.
    #[arg(long, value_name = "N", default_value_t = 16,
          value_parser = clap::value_parser!(u32).range(1..=256))]
    pub(super) pcf: u32,
    /// Samples of the search for what casts a shadow, which makes shadows of lights with a size
    /// soft; 0 leaves them sharp.
    #[arg(long, value_name = "N", default_value_t = 16,
          value_parser = clap::value_parser!(u32).range(0..=256))]
    pub(super) pcss: u32,
    /// Takes away indirect light that is hidden within so many metres (ambient occlusion in screen
    /// space), which probes are too sparse for; 0 takes none.
    #[arg(long, value_name = "METRES", default_value_t = 0.0, value_parser = parse_occlusion)]
    pub(super) occlusion: f32,
    /// How blended surfaces are drawn: by the samples that they cover, or sorted and mixed.
    #[arg(long, value_enum, default_value_t = TransparencyArgument::Coverage)]
    pub(super) transparency: TransparencyArgument,
    /// Several views in one picture: a stereo pair, or a grid of cameras, the first at the upper left.
    #[arg(long, value_name = "stereo|COLSxROWS", value_parser = parse_views)]
    pub(super) views: Option<UVec2>,
    /// Metres from one of several views to the next.
    #[arg(long, value_name = "METRES", default_value_t = 0.064)]
    pub(super) view_spacing: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum ShadingArgument {
    Pixels,
    Samples,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum TransparencyArgument {
    Coverage,
    Sorted,
}

impl RasterArguments {
    /// What only an adapter's pictures have, where it is asked for.
    pub(super) fn asked_for(&self) -> Option<&'static str> {
        let light = self.light.is_some().then_some("--light");
        light.or_else(|| self.views.is_some().then_some("--views"))
    }

    /// The light's file, where that is what it comes from.
    pub(super) fn light_file(&self) -> Option<PathBuf> {
        self.light.as_deref().filter(|light| !light_source::is_address(light)).map(PathBuf::from)
    }
}

fn parse_views(text: &str) -> Result<UVec2, String> {
    const MOST: u32 = 256;
    if text == "stereo" {
        return Ok(UVec2::new(2, 1));
    }
    let wrong =
        || format!("{text:?}: give stereo, or columns and rows as 8x4, at most {MOST} views");
    let (columns, rows) = text.split_once('x').ok_or_else(wrong)?;
    let side = |text: &str| text.parse::<u32>().ok().filter(|n| (1..=MOST).contains(n));
    match (side(columns), side(rows)) {
        (Some(x), Some(y)) if x * y <= MOST => Ok(UVec2::new(x, y)),
        _ => Err(wrong()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_views() {
        assert_eq!(parse_views("stereo"), Ok(UVec2::new(2, 1)));
        assert_eq!(parse_views("8x4"), Ok(UVec2::new(8, 4)));
        for wrong in ["", "3", "0x2", "20x20", "-1x2"] {
            assert!(parse_views(wrong).is_err(), "{wrong}");
        }
    }
}
