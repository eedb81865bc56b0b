//! Which scene is meant, and where its probes are.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use clap::builder::{OsStringValueParser, TypedValueParser};
use lumencast_codec::check_volumes;
use lumencast_gather::Gather;
use lumencast_light::Order;
use lumencast_scene::{Edit, FileContents, Scene, VolumeSpec};
use lumencast_solve::Survey;

use super::volume::VolumeArgument;
use crate::environment::EnvironmentArgument;
use crate::output::tell;
use crate::values::parse_order;
use crate::{output, warnings};

/// Which scene.
#[derive(Debug, Args)]
pub(crate) struct SceneSource {
    /// A glTF file (.gltf or .glb), or a built-in scene: cornell, door, tomb.
    #[arg(value_name = "SCENE", value_parser = scene_name())]
    pub(crate) scene: String,
    /// Light from all around in place of the scene's own: sky:LUX, a colour R,G,B in cd/m², or an
    /// .hdr or .exr file in the scene's folder.
    #[arg(long, value_name = "ENVIRONMENT")]
    environment: Option<EnvironmentArgument>,
}

impl SceneSource {
    /// The scene. People are told what is left out of it, and where nothing lights it.
    pub(crate) fn open(&self) -> Result<Scene> {
        self.open_edited(&[])
    }

    /// The scene as edits leave it that came with its light. An environment given here takes the place
    /// of the light's.
    pub(crate) fn open_edited(&self, edits: &[Edit]) -> Result<Scene> {
        let spinner = output::spinner(format!("Loading {}", self.scene));
        let scene = self.load();
        spinner.finish_and_clear();
        let mut scene = scene?;
        for edit in edits {
            if self.environment.is_some() && matches!(edit, Edit::SetEnvironment { .. }) {
                continue;
            }
            if let Err(error) = scene.replay(edit) {
                tell!("warning: the scene is not all that its light is of: {error}");
            }
        }
        warnings::left_out(&scene);
        warnings::dark(&scene);
        Ok(scene)
    }

    fn load(&self) -> Result<Scene> {
        let mut scene = Scene::open(&self.scene)?;
        if let Some(EnvironmentArgument(environment)) = self.environment.clone() {
            scene.apply(&Edit::SetEnvironment { environment }).context("--environment")?;
        }
        Ok(scene)
    }

    /// The files that the opened scene was read from.
    pub(crate) fn files(&self, scene: &Scene) -> Vec<PathBuf> {
        let settings = Path::new(&self.scene).with_extension("lumencast.toml");
        let referred = scene.files().into_iter().filter_map(|file| match file.contents {
            FileContents::Path(path) => Some(path),
            FileContents::Bytes(_) => None,
        });
        referred.chain([settings]).collect()
    }
}

/// Parses a scene's name, which is passed on as text, to servers and pages too.
pub(crate) fn scene_name() -> impl TypedValueParser<Value = String> {
    OsStringValueParser::new().try_map(|name| {
        name.into_string()
            .map_err(|name| format!("the name {} is not UTF-8; rename the file", name.display()))
    })
}

/// Which scene, and where its probes are.
#[derive(Debug, Args)]
pub(crate) struct SceneArguments {
    #[command(flatten)]
    pub(crate) source: SceneSource,
    /// A volume of probes in place of the scene's own: its cells, and, if it is not to span the
    /// scene, its centre and size in metres. May be given several times.
    #[arg(long = "volume", value_name = "NXxNYxNZ[@X,Y,Z:SX,SY,SZ]")]
    pub(crate) volumes: Vec<VolumeArgument>,
    /// Highest band of the spherical harmonics, 1 to 4, in place of the volumes' own.
    #[arg(long, value_parser = parse_order)]
    pub(crate) order: Option<Order>,
}

impl SceneArguments {
    /// The volumes given, in the order given, or else the scene's own or the default one. Warns of those
    /// that are in the wrong place.
    pub(crate) fn volumes(
        &self,
        scene: &mut Scene,
        gatherer: &mut dyn Gather,
    ) -> Result<Vec<VolumeSpec>> {
        let mut volumes = Vec::new();
        for volume in &self.volumes {
            volumes.push(volume.in_scene(scene).context("--volume")?);
        }
        if volumes.is_empty() {
            volumes = lumencast_solve::volumes(scene, gatherer)?;
        }
        for (number, volume) in volumes.iter_mut().enumerate() {
            volume.order = self.order.unwrap_or(volume.order);
            let survey = lumencast_solve::survey(&scene.snapshot(), volume, gatherer)?;
            if survey.is_mostly_useless() {
                let Survey { probes, buried, lost } = survey;
                tell!(
                    "warning: of the {probes} probes of volume {number}, {buried} are within \
                     something and {lost} see no surface: say where probes are to be, by --volume or \
                     in the scene's settings"
                );
            }
        }
        // Light that nobody can be sent, or save, need not be computed.
        check_volumes(&volumes)?;
        Ok(volumes)
    }
}
