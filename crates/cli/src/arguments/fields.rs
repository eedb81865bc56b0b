//! Which kinds of fields hold the light.

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use lumencast_charts::LaidOut;
use lumencast_codec::{LumelCoding, Qp};
use lumencast_gather::Gather;
use lumencast_scene::{Scene, VolumeSpec};
use lumencast_solve::Effort;

use super::effort::EffortArguments;
use super::lightmap::LightmapArguments;
use super::scene::SceneArguments;
use crate::charting;
use crate::output::tell;

/// A lumel takes so many samples at most, unless told otherwise.
const LUMEL_SAMPLES: u32 = 256;

/// Which kinds of fields hold the light.
#[derive(Debug, Args)]
pub(crate) struct FieldsArguments {
    /// What holds the light: lumels of still surfaces (lightmap), probes for all else (volume).
    #[arg(
        long,
        value_name = "KIND,KIND",
        value_enum,
        value_delimiter = ',',
        default_value = "lightmap,volume"
    )]
    fields: Vec<FieldKind>,
    /// Samples a lumel where the light is computed, at most, and no more than a probe takes.
    #[arg(long, value_name = "N", default_value_t = LUMEL_SAMPLES,
          value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    lumel_samples: u32,
    /// Lets lumels also tell how light depends on the normal, for surfaces with normal maps. Takes about
    /// twice the bytes.
    #[arg(long)]
    pub(crate) directional: bool,
    #[command(flatten)]
    pub(crate) lightmap: LightmapArguments,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FieldKind {
    Lightmap,
    Volume,
}

/// Which kinds of fields hold live light.
#[derive(Debug, Args)]
pub(crate) struct LiveFieldsArguments {
    /// What holds the light: lumels of still surfaces and probes for all else (lightmap,volume), or
    /// probes alone (volume), which follow changes twice as fast.
    #[arg(
        long,
        value_name = "KIND,KIND",
        value_enum,
        value_delimiter = ',',
        default_value = "lightmap,volume"
    )]
    fields: Vec<FieldKind>,
    /// How lumels are sent: as video, with colour at half the resolution (h264) or at full
    /// (h264-stacked), or as they are (halves), which takes a fast link.
    #[arg(long, value_enum, default_value_t = SentAs::H264)]
    lumel_coding: SentAs,
    /// How coarse the video is; 6 more make half the bytes or less. Unless given, 9 for pages of up to
    /// 256² lumels, 12 for those of up to 512², and 18 for larger ones.
    #[arg(long, value_name = "6..36", value_parser = qp)]
    qp: Option<Qp>,
    /// Lets lumels also tell how light depends on the normal, for surfaces with normal maps. Takes about
    /// twice the bytes.
    #[arg(long)]
    pub(crate) directional: bool,
    #[command(flatten)]
    lightmap: LightmapArguments,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SentAs {
    #[value(name = "h264")]
    H264,
    #[value(name = "h264-stacked")]
    H264Stacked,
    Halves,
}

fn qp(text: &str) -> Result<Qp, String> {
    let (least, most) = (Qp::RANGE.start(), Qp::RANGE.end());
    let qp = text.parse().ok().and_then(Qp::new);
    qp.ok_or_else(|| format!("a whole number from {least} to {most}"))
}

impl LiveFieldsArguments {
    /// How lumels on pages of so many a side are sent.
    pub(crate) fn coding(&self, page_size: u32) -> LumelCoding {
        let qp = self.qp.unwrap_or(Qp::for_pages(page_size));
        match self.lumel_coding {
            SentAs::H264 => LumelCoding::H264(qp),
            SentAs::H264Stacked => LumelCoding::H264Stacked(qp),
            SentAs::Halves => LumelCoding::Halves,
        }
    }

    /// The lumels of a scene, if there are to be some. Where it has no surfaces for them, there is room
    /// for such as are added.
    pub(crate) fn lumels(
        &self,
        scene: &mut Scene,
        gatherer: &mut dyn Gather,
    ) -> Result<Option<LaidOut>> {
        if !self.fields.contains(&FieldKind::Volume) {
            tell!("note: volumes are computed too, since probes light what moves");
        }
        if !self.fields.contains(&FieldKind::Lightmap) {
            return Ok(None);
        }
        let spec = self.lightmap.spec(scene);
        let laid_out = charting::lay_out(&scene.snapshot(), spec, gatherer)?;
        Ok(Some(laid_out.unwrap_or_else(|| LaidOut::empty(spec.unwrap_or_default()))))
    }
}

/// Where light is to be computed.
pub(crate) struct Wanted {
    pub(crate) volumes: Vec<VolumeSpec>,
    pub(crate) lightmap: Option<LaidOut>,
    /// Whether lumels also tell how light depends on the normal.
    pub(crate) directional: bool,
}

impl FieldsArguments {
    /// Where light of a scene is to be computed. People are told what has no lumels, and why.
    pub(crate) fn wanted(
        &self,
        scene: &mut Scene,
        volumes: &SceneArguments,
        gatherer: &mut dyn Gather,
    ) -> Result<Wanted> {
        let volumes = if self.volumes() { volumes.volumes(scene, gatherer)? } else { Vec::new() };
        let lightmap = self.lumels(scene, gatherer)?;
        if volumes.is_empty() && lightmap.is_none() {
            bail!(
                "nothing can hold the light: no surface has lumels (--fields lightmap,volume adds probes)"
            );
        }
        Ok(Wanted { volumes, lightmap, directional: self.directional })
    }

    /// Whether there are to be volumes.
    pub(crate) fn volumes(&self) -> bool {
        self.fields.contains(&FieldKind::Volume)
    }

    /// The lumels of a scene, if there are to be some and it has surfaces for them.
    pub(crate) fn lumels(
        &self,
        scene: &mut Scene,
        gatherer: &mut dyn Gather,
    ) -> Result<Option<LaidOut>> {
        if !self.fields.contains(&FieldKind::Lightmap) {
            return Ok(None);
        }
        charting::lay_out(&scene.snapshot(), self.lightmap.spec(scene), gatherer)
    }

    /// How long light is computed: at most so many samples a probe.
    pub(crate) fn effort(&self, effort: &EffortArguments, samples: u32) -> Effort {
        let lumel_samples = self.lumel_samples.min(samples);
        Effort { lumel_samples, ..effort.with(samples) }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        fields: LiveFieldsArguments,
    }

    /// How pages are sent that have these lumels a side.
    fn coding(words: &[&str], page_size: u32) -> LumelCoding {
        let words = ["lumencast"].iter().chain(words);
        Command::try_parse_from(words).expect("arguments").fields.coding(page_size)
    }

    #[test]
    fn lumels_are_sent_as_told() {
        let qp = |qp: u8| Qp::new(qp).expect("a parameter");
        for (page_size, usual) in [(64, 9), (256, 9), (512, 12), (1024, 18)] {
            assert_eq!(coding(&[], page_size), LumelCoding::H264(qp(usual)));
        }
        let stacked = ["--lumel-coding", "h264-stacked", "--qp", "20"];
        assert_eq!(coding(&stacked, 256), LumelCoding::H264Stacked(qp(20)));
        assert_eq!(coding(&["--lumel-coding", "halves"], 256), LumelCoding::Halves);
        assert!(Command::try_parse_from(["lumencast", "--qp", "37"]).is_err());
    }
}
