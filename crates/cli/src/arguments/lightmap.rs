//! How densely lumels lie.

use clap::Args;
use lumencast_scene::{LightmapSpec, Scene};

/// How densely lumels lie on the surfaces of a scene.
#[derive(Clone, Debug, Args)]
pub(crate) struct LightmapArguments {
    /// One page of so many lumels a side, as densely as they fit it, in place of the scene's own
    /// density.
    #[arg(long, value_name = "SIZE", value_parser = size, conflicts_with = "texel")]
    lightmap: Option<LightmapSpec>,
    /// A lumel every so many metres, in place of the scene's own density. Where that has none, 0.1 or,
    /// where pages have room, less.
    #[arg(long, value_name = "METRES", value_parser = texel)]
    texel: Option<LightmapSpec>,
}

impl LightmapArguments {
    /// The density that is asked for, here or by the scene.
    pub(crate) fn spec(&self, scene: &Scene) -> Option<LightmapSpec> {
        self.lightmap.or(self.texel).or(scene.lightmap())
    }
}

fn size(text: &str) -> Result<LightmapSpec, String> {
    checked(LightmapSpec::Size(text.parse().map_err(|_| "not a whole number".to_owned())?))
}

fn texel(text: &str) -> Result<LightmapSpec, String> {
    checked(LightmapSpec::Texel(text.parse().map_err(|_| "not a number".to_owned())?))
}

fn checked(spec: LightmapSpec) -> Result<LightmapSpec, String> {
    spec.check().map(|()| spec)
}
