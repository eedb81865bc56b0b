//! `lumencast bake`: a converged light field in a file.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use lumencast_codec::{Epoch, LightFile, SceneInfo, UpdateInfo};
use lumencast_gather::blend::BlendSettings;
use lumencast_gather::path_trace::Levels;
use serde_json::json;

use crate::arguments::{GatherArguments, SceneArguments, source};
use crate::{
    out_file,
    output::{self, say},
};

/// Computes a scene's light until it has converged and writes it to a file.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bake cornell -o cornell.light
  lumencast bake sponza.glb -o sponza.light --volume 20x12x14 --samples 16384

The file holds the same bytes as the keyframes of a server's broadcast (docs/wire.md); a client can
start from it when there is no server. `lumencast inspect FILE` says what is in it.")]
pub(crate) struct Bake {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    gather: GatherArguments,
    /// The file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Samples a probe: four times as many halve the noise.
    #[arg(long, default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    samples: u32,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

impl Bake {
    pub(crate) fn run(self) -> Result<()> {
        out_file::check(&self.output)?;
        let mut scene = self.scene.source.open()?;
        out_file::check_apart([&self.output], &self.scene.source.files(&scene))?;
        let volumes = self.scene.volumes(&scene)?;
        let snapshot = scene.snapshot();
        let mut gatherer = self.gather.gatherer(Levels::One)?;
        let options = self.gather.options(BlendSettings::default(), self.gather.reading.baked());
        let bar = output::bar(1000, "Baking");
        let light = lumencast_server::bake(
            &snapshot,
            &volumes,
            &mut *gatherer,
            self.samples,
            options,
            |done| bar.set_position((done * 1000.0) as u64),
        );
        bar.finish_and_clear();
        let light = light?;

        let info = SceneInfo { name: scene.name().into(), root: scene.root_file().into() };
        let at = UpdateInfo {
            time: snapshot.time,
            scene_version: snapshot.version,
            ..UpdateInfo::default()
        };
        let source = format!("{}, baked, {} samples", source(&options), self.samples);
        let bytes = LightFile::of_volumes(Epoch(0), info, 1.0, &source, &light, at).write();
        out_file::write(&self.output, &bytes)?;
        let probes: usize = light.iter().map(|volume| volume.grid.probe_count()).sum();
        if self.json {
            return output::json(&json!({
                "file": self.output, "bytes": bytes.len(), "fields": light.len(),
                "probes": probes, "samples": self.samples,
            }));
        }
        say!(
            "{}: fields: {}, probes: {probes}, {}",
            self.output.display(),
            light.len(),
            output::bytes(bytes.len() as u64)
        );
        Ok(())
    }
}
