//! How light is gathered.

use anyhow::{Context, Result};
use clap::Args;
use lumencast_gather::Gather;
use lumencast_gather::path_trace::{CpuPathTracer, Levels, Options};
use lumencast_solve::GatherOptions;
use lumencast_solve::blend::BlendSettings;

use super::materials::Materials;
use super::reading::{Reading, ReadingArguments};
use crate::values::parse_positive;

/// How light is gathered.
#[derive(Debug, Args)]
pub(crate) struct GatherArguments {
    /// Surface scattering events on a path, seen from a probe.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=64))]
    pub(crate) bounces: u32,
    /// Upper limit of one path vertex's contribution, cd/m², against bright speckles.
    #[arg(long, value_name = "CD/M2", default_value = "inf", value_parser = parse_positive)]
    pub(crate) clamp: f32,
    /// How surfaces reflect: as their materials say, or all as opaque two-sided Lambert.
    #[arg(long, value_enum, default_value_t = Materials::Full)]
    pub(crate) materials: Materials,
    #[command(flatten)]
    pub(crate) reading: ReadingArguments,
}

impl GatherArguments {
    pub(crate) fn options(&self, blend: BlendSettings, reading: Reading) -> GatherOptions {
        reading.gathered(self.bounces, self.clamp, blend)
    }

    pub(crate) fn gatherer(&self, levels: Levels) -> Result<Box<dyn Gather>> {
        let options = Options { materials: self.materials.model(), threads: None, levels };
        let tracer = CpuPathTracer::new(options).context("cannot start the threads that trace")?;
        Ok(Box::new(tracer))
    }
}

/// What computes the light, for the catalog.
pub(crate) fn source(options: &GatherOptions) -> String {
    let fitted = if options.fit.is_some() { ", fitted to surfaces" } else { "" };
    format!("cpu path tracing{fitted}")
}
