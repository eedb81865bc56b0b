//! How a server's ticks follow one another.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use lumencast_charts::Store;
use lumencast_gather::Gather;
use lumencast_scene::{Scene, Script};
use lumencast_server::{SampleRange, TickOptions};
use lumencast_solve::GatherOptions;
use lumencast_solve::blend::BlendSettings;

use super::fields::LiveFieldsArguments;
use super::gather::{GatherArguments, source};
use super::scene::SceneArguments;
use crate::values::{parse_positive, parse_rate, parse_samples, parse_share};

/// How ticks follow one another.
#[derive(Debug, Args)]
pub(crate) struct TickArguments {
    /// Ticks a second.
    #[arg(long, default_value = "25", value_name = "HZ", value_parser = parse_rate)]
    pub(crate) rate: f64,
    /// Samples a probe and tick: fixed, or between two bounds so that the tick fits its period.
    #[arg(long, default_value = "4..256", value_name = "N|MIN..MAX", value_parser = parse_samples)]
    samples: SampleRange,
    /// Least weight of a new update: lower is calmer, higher follows small changes sooner.
    #[arg(long, default_value = "0.01", value_parser = parse_share)]
    ratio: f32,
    /// Standard deviations by which a change stands out to be followed at once; inf to follow by
    /// the ratio alone.
    #[arg(long, default_value = "3.5", value_parser = parse_positive)]
    significance: f32,
    /// Lets paths go on, where they end, in the light of the tick before, of lumels where there are
    /// some: all bounces for the price of few, as coarse as that light is.
    #[arg(long)]
    feedback: bool,
    #[command(flatten)]
    fields: LiveFieldsArguments,
    /// A script of edits (JSON lines, {"at": seconds, "edit": …}), played by scene time.
    #[arg(long, value_name = "FILE")]
    pub(crate) edits: Option<PathBuf>,
}

impl TickArguments {
    /// What a tick needs to know.
    pub(crate) fn options(
        &self,
        scene: &mut Scene,
        volumes: &SceneArguments,
        gather: &GatherArguments,
        gatherer: &mut dyn Gather,
    ) -> Result<TickOptions> {
        let lightmap = self.fields.lumels(scene, gatherer)?;
        let page_size = lightmap.as_ref().map_or(0, |laid_out| laid_out.layout.page_size);
        let blend = BlendSettings { ratio: self.ratio, significance: self.significance };
        let feedback = if self.feedback { ", feedback" } else { "" };
        let options = gather.options(blend, gather.reading.served());
        let gather = GatherOptions { directional: self.fields.directional, ..options };
        Ok(TickOptions {
            period: 1.0 / self.rate,
            samples: self.samples,
            source: source(&gather) + feedback,
            gather,
            feedback: self.feedback,
            volumes: volumes.volumes(scene, gatherer)?,
            lightmap,
            lumel_samples: None,
            charts: Store::of_user(),
            lumel_coding: self.fields.coding(page_size),
            script: self.edits.as_deref().map(read_script).transpose()?,
        })
    }
}

/// Reads a script of edits.
fn read_script(path: &Path) -> Result<Script> {
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("cannot read the edits in {}", path.display()))?;
    Script::parse(&text).with_context(|| path.display().to_string())
}
