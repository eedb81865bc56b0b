//! `lumencast bake`: converged light in a file.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use lumencast_codec::{LightFile, SavedFile, SceneInfo, UpdateInfo};
use lumencast_gather::path_trace::Levels;
use lumencast_light::Field;
use lumencast_scene::{FileContents, Scene};
use lumencast_solve::blend::BlendSettings;
use lumencast_solve::{Baked, GatherOptions, Spent};
use serde_json::json;

use crate::arguments::{
    EffortArguments, FieldsArguments, GatherArguments, MOST_SAMPLES, SceneArguments, Wanted, source,
};
use crate::{
    charting::Lumels,
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
    #[command(flatten)]
    fields: FieldsArguments,
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
        let Wanted { volumes, lightmap, directional } =
            self.fields.wanted(&mut scene, &self.scene, &mut *gatherer)?;
        let snapshot = scene.snapshot();
        let options = self.gather.options(BlendSettings::default(), self.gather.reading.baked());
        let options = GatherOptions { directional, ..options };
        let bar = output::share_bar("Computing light");
        let wanted = lumencast_solve::Bake {
            scene: &snapshot,
            volumes: &volumes,
            lightmap: lightmap.as_ref(),
            effort: self.fields.effort(&self.effort, self.samples),
            options,
        };
        let baked = lumencast_solve::bake(wanted, &mut *gatherer, |done| {
            light_source::show(&bar, done);
        });
        bar.finish_and_clear();
        let Baked { fields, probes: of_probes, lumels: of_lumels } = baked?;

        let info = SceneInfo { name: scene.name().into(), root: scene.root_file().into() };
        let at = UpdateInfo {
            time: snapshot.time,
            scene_version: snapshot.version,
            ..UpdateInfo::default()
        };
        let samples =
            of_lumels.map_or(of_probes.samples, |spent| spent.samples.max(of_probes.samples));
        let source = format!("{}, baked, {samples} samples", source(&options));
        let mut file = LightFile::of_fields(info, &source, &fields, at);
        file.edits = scene.edits_since_load();
        file.files = named_files(&scene)?;
        let bytes = file.write();
        out_file::write(&self.output, &bytes)?;
        let probes: usize = fields.iter().map(Field::probe_count).sum();
        let pages: u32 = fields.iter().filter_map(Field::as_lightmap).map(|l| l.layout.pages).sum();
        if self.json {
            return output::json(&json!({
                "file": self.output, "bytes": bytes.len(), "fields": fields.len(),
                "probes": probes, "samples": of_probes.samples, "noise": of_probes.noise,
                "pages": pages,
                "lumel_samples": of_lumels.map(|spent| spent.samples),
                "lumel_noise": of_lumels.and_then(|spent| spent.noise),
            }));
        }
        let spent = |Spent { samples, noise }: Spent, receiver: &str| {
            let noise = noise.map_or(String::new(), |noise| format!(", noise {noise:.2} of 255"));
            format!("{samples} samples a {receiver}{noise}")
        };
        let (bytes, fields) = (output::bytes(bytes.len() as u64), fields.len());
        say!("{}: fields: {fields}, {bytes}", self.output.display());
        if probes > 0 {
            say!("probes: {probes}, {}", spent(of_probes, "probe"));
        }
        if let (Some(of_lumels), Some(laid_out)) = (of_lumels, &lightmap) {
            let spent = spent(of_lumels, "lumel");
            say!("pages: {}, {spent}", Lumels::of(laid_out));
        }
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
