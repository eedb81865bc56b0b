//! Settings of a scene for Lumencast: its environment, its probe volumes, and how densely lumels lie.
//!
//! They are `extras.lumencast` of the glTF's scene, or a TOML file beside it named
//! `<stem>.lumencast.toml`. The file has precedence:
//!
//! ```toml
//! [environment]
//! type = "sky"
//! zenith = [0.3, 0.5, 1.0]
//! horizon = [0.8, 0.9, 1.0]
//! ground = [0.2, 0.2, 0.2]
//!
//! [[volume]]
//! center = [0.0, 1.0, 0.0]
//! size = [2.0, 2.0, 2.0]
//! resolution = [8, 8, 8]
//! order = 2
//!
//! [lightmap]
//! texel = 0.1
//! ```

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::error::{At, Fault, invalid};
use crate::gltf::source::read_file;
use crate::lightmap::LightmapSpec;
use crate::limits;
use crate::volume::VolumeSpec;
use crate::{Environment, SceneError};

/// Settings of a scene, from its extras or a file beside it.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Settings {
    pub(crate) environment: Option<Environment>,
    #[serde(rename = "volumes", alias = "volume")]
    pub(crate) volumes: Vec<VolumeSpec>,
    pub(crate) lightmap: Option<LightmapSpec>,
}

impl Settings {
    pub(crate) fn check(&self) -> Result<(), Fault> {
        if let Some(environment) = &self.environment {
            environment.check().map_err(invalid).at(|| "environment".into())?;
        }
        if self.volumes.len() > limits::VOLUMES {
            return Err(Fault::TooLarge { what: "volumes".into(), limit: limits::VOLUMES as u64 });
        }
        if let Some(lightmap) = &self.lightmap {
            lightmap.check().map_err(invalid).at(|| "lightmap".into())?;
        }
        for (index, volume) in self.volumes.iter().enumerate() {
            volume.check().map_err(invalid).at(|| format!("volume {index}"))?;
        }
        Ok(())
    }
}

/// Reads the settings beside a scene; `None` when there is no such file.
pub(crate) fn beside(scene: &Path) -> Result<Option<(PathBuf, Settings)>, SceneError> {
    let path = scene.with_extension("lumencast.toml");
    if !path.exists() {
        return Ok(None);
    }
    let read = || {
        let bytes = read_file(&path, limits::FILE_BYTES).map_err(Fault::Read)?;
        let text = String::from_utf8(bytes).map_err(|_| invalid("is not UTF-8"))?;
        let settings: Settings = toml::from_str(&text).map_err(Fault::Toml)?;
        settings.check()?;
        Ok(settings)
    };
    match read() {
        Ok(settings) => Ok(Some((path, settings))),
        Err(fault) => Err(Fault::of(fault, path)),
    }
}
