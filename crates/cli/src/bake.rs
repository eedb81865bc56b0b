//! `lumencast bake`: converged light in a file.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use lumencast_codec::{LightFile, SavedFile, SceneInfo, UpdateInfo};
use lumencast_gather::path_trace::Levels;
use lumencast_light::Field;
use lumencast_scene::{FileContents, Scene};
use lumencast_solve::Baked;
use lumencast_solve::blend::BlendSettings;
use serde_json::json;

use crate::arguments::{EffortArguments, GatherArguments, MOST_SAMPLES, SceneArguments, source};
use crate::{
    light_source, out_file,
    output::{self, say},
};

/// Computes a scene's light until its noise does not show and writes it to a file.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bake cornell -o cornell.light
  lumencast bake sponza.glb -o sponza.light --volume 20x12x14 --noise 0.25

The file holds the light, in the same bytes as the keyframes of a server's broadcast (docs/wire.md),
and the environment with its picture. A client can start from it when there is no server.
`lumencast inspect FILE` says what is in it.")]
pub(crate) struct Bake {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    gather: GatherArguments,
    /// The file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Samples a probe, at most: four times as many halve the noise.
    #[arg(long, default_value_t = MOST_SAMPLES,
          value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    samples: u32,
    #[command(flatten)]
    effort: EffortArguments,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

impl Bake {
    pub(crate) fn run(self) -> Result<()> {
        out_file::check(&self.output)?;
        let mut scene = self.scene.source.open()?;
        out_file::check_apart([&self.output], &self.scene.source.files(&scene))?;
        let mut gatherer = self.gather.gatherer(Levels::One)?;
        let volumes = self.scene.volumes(&mut scene, &mut *gatherer)?;
        let snapshot = scene.snapshot();
        let options = self.gather.options(BlendSettings::default(), self.gather.reading.baked());
        let bar = output::share_bar("Computing light");
        let effort = self.effort.with(self.samples);
        let wanted = lumencast_solve::Bake { scene: &snapshot, volumes: &volumes, effort, options };
        let baked = lumencast_solve::bake(wanted, &mut *gatherer, |done| {
            light_source::show(&bar, done);
        });
        bar.finish_and_clear();
        let Baked { fields, samples, noise } = baked?;

        let info = SceneInfo { name: scene.name().into(), root: scene.root_file().into() };
        let at = UpdateInfo {
            time: snapshot.time,
            scene_version: snapshot.version,
            ..UpdateInfo::default()
        };
        let source = format!("{}, baked, {samples} samples", source(&options));
        let mut file = LightFile::of_fields(info, &source, &fields, at);
        file.edits = scene.edits_since_load();
        file.files = named_files(&scene)?;
        let bytes = file.write();
        out_file::write(&self.output, &bytes)?;
        let probes: usize = fields.iter().map(Field::probe_count).sum();
        if self.json {
            return output::json(&json!({
                "file": self.output, "bytes": bytes.len(), "fields": fields.len(),
                "probes": probes, "samples": samples, "noise": noise,
            }));
        }
        let noise = noise.map_or(String::new(), |noise| format!(", noise {noise:.2} of 255"));
        say!(
            "{}: fields: {}, probes: {probes}, {samples} samples a probe{noise}, {}",
            self.output.display(),
            fields.len(),
            output::bytes(bytes.len() as u64)
        );
        Ok(())
    }
}

/// The environment's picture, which is no part of the scene's own file.
fn named_files(scene: &Scene) -> Result<Vec<SavedFile>> {
    let Some(picture) = scene.environment_file() else { return Ok(Vec::new()) };
    let bytes = match &picture.contents {
        FileContents::Path(path) => {
            std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?
        }
        FileContents::Bytes(bytes) => bytes.to_vec(),
    };
    Ok(vec![SavedFile { name: picture.name, bytes }])
}
