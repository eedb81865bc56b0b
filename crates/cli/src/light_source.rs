//! Light from where people have them, files and servers, or computed on the spot.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use indicatif::ProgressBar;
use lumencast_codec::{Catalog, DecodeError, FieldInfo, LightFile};
use lumencast_gather::Gather;
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_light::Field;
use lumencast_scene::{Edit, Scene, Snapshot, VolumeSpec};
use lumencast_solve::blend::BlendSettings;
use lumencast_solve::{Bake, Baked, Done, Effort, GatherOptions, Receivers, bake};

use crate::arguments::{Reading, Wanted};
use crate::output::{self, tell};
use crate::remote::{self, Seen};

/// Whether `what` is the address of a server's scene.
pub(crate) fn is_address(what: &str) -> bool {
    what.starts_with("http://") || what.starts_with("https://")
}

/// Light that was computed elsewhere.
pub(crate) struct Found {
    /// The file or address that it is from.
    what: String,
    catalog: Catalog,
    /// Edits that turn the scene's file into the scene that the light is of, where they are known.
    pub(crate) edits: Vec<Edit>,
    pub(crate) fields: Vec<Field>,
}

impl Found {
    /// Warns where it is another scene's light.
    pub(crate) fn check_fits(&self, scene: &Scene) {
        check_fits(&self.what, &self.catalog, scene);
    }
}

/// The light of a file, or the newest of a server's scene.
pub(crate) fn light(what: &str) -> Result<Found> {
    if is_address(what) {
        let Seen { catalog, fields, .. } = remote::look(what)?;
        return Ok(Found { what: what.into(), catalog, edits: Vec::new(), fields });
    }
    let bytes = std::fs::read(Path::new(what)).with_context(|| format!("cannot read {what}"))?;
    let read = || {
        let file = LightFile::read(&bytes)?;
        let fields = file.fields()?;
        Ok(Found { what: what.into(), catalog: file.catalog, edits: file.edits, fields })
    };
    let read: Result<_, DecodeError> = read();
    read.with_context(|| format!("{what} is no light file"))
}

/// Warns where light is another scene's: by its name, or because none of it reaches this one.
pub(crate) fn check_fits(what: &str, catalog: &Catalog, scene: &Scene) {
    let (of, this) = (&catalog.scene.name, scene.name());
    if of != this {
        tell!("warning: {what} is the light of {of:?}, and this scene is {this:?}");
    }
    let bounds = scene.bounds();
    let (middle, reach) = (0.5 * (bounds.min + bounds.max), 0.5 * bounds.min.distance(bounds.max));
    // Where lumels are, the scene itself says.
    let mut volumes = catalog.fields.iter().filter(|field| field.shape.as_volume().is_some());
    let is_elsewhere = |field: &FieldInfo| field.shape.distance_from_all(middle) > reach;
    if volumes.clone().next().is_some() && volumes.all(is_elsewhere) {
        tell!("warning: {what} lights no part of this scene; is it another scene's?");
    }
}

/// How a field is computed.
#[derive(Debug)]
pub(crate) struct Computed {
    pub(crate) effort: Effort,
    /// Surface scattering events, seen from a probe.
    pub(crate) bounces: u32,
    /// Upper limit of one path vertex's contribution, cd/m².
    pub(crate) clamp: f32,
    pub(crate) reading: Reading,
    pub(crate) tracing: Options,
}

impl Computed {
    /// What computes it.
    pub(crate) fn gatherer(&self) -> Result<Box<dyn Gather>> {
        let tracer = CpuPathTracer::new(self.tracing.clone());
        Ok(Box::new(tracer.context("cannot start the threads that trace")?))
    }

    /// The light of volumes, with a bar that shows how far it is.
    pub(crate) fn volumes(
        self,
        scene: &Arc<Snapshot>,
        volumes: &[VolumeSpec],
        gatherer: &mut dyn Gather,
    ) -> Result<Baked> {
        let volumes = volumes.to_vec();
        self.light(scene, &Wanted { volumes, lightmap: None, directional: false }, gatherer)
    }

    /// The light where it is wanted, with a bar that shows how far it is.
    pub(crate) fn light(
        self,
        scene: &Arc<Snapshot>,
        wanted: &Wanted,
        gatherer: &mut dyn Gather,
    ) -> Result<Baked> {
        let options = self.reading.gathered(self.bounces, self.clamp, BlendSettings::default());
        let bar = output::share_bar("Computing light");
        let Wanted { volumes, lightmap, directional } = wanted;
        let options = GatherOptions { directional: *directional, ..options };
        let (lightmap, effort) = (lightmap.as_ref(), self.effort);
        let wanted = Bake { scene, volumes, lightmap, effort, options };
        let light = bake(wanted, gatherer, |done| show(&bar, done));
        bar.finish_and_clear();
        Ok(light?)
    }
}

/// Shows how far a computation is, and how noisy its light still is.
pub(crate) fn show(bar: &ProgressBar, done: Done) {
    bar.set_position((f64::from(done.share) * output::SHARE_BAR_LENGTH) as u64);
    let receivers = match done.of {
        Receivers::Probes => "probes",
        Receivers::Lumels => "lumels",
    };
    bar.set_message(match done.noise {
        Some(noise) => format!("Computing light at {receivers}, noise {noise:.2} of 255"),
        None => format!("Computing light at {receivers}"),
    });
}
