//! `lumencast render`: a picture of a scene.

#[cfg(feature = "gpu")]
mod raster;
mod raster_arguments;
mod reference;

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use lumencast_picture::{Picture, ToneMap};

use crate::arguments::{Exposure, SceneArguments};
use crate::camera::{self, PictureArguments};
use crate::values::parse_positive;
use crate::{light_source, out_file};

/// Draws a picture of a scene.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast render cornell -o cornell.png
  lumencast render cornell --lighting field -o field.png
  lumencast render sponza.glb --lighting field --light sponza.light --samples 8 -o sponza.png
  lumencast render sponza.glb --camera nave --spp 1024 --size 1920x1080 -o sponza.exr -o sponza.png
  lumencast render sponza.glb --camera 2,1.5,0,0,1.5,0,60 --parts indirect --bounces 4 -o i.exr

The reference is path-traced: every sample follows one path of at most --bounces surface scattering
events, 1 being direct light. It is done when every pixel has its samples; Ctrl-C, or a crash, leaves
what there is beside the picture (FILE.part), and the same command goes on from there, also with more
samples than before. The noise told is the error that is left, from the difference of the two halves
of its samples.

Field, direct, indirect and none are drawn as a client draws them, by a graphics adapter (in software
where there is no other): direct light with shadow maps, indirect light from fields. Without
--light the field is computed first, with one bounce less than --bounces, since a probe sees light
that has been scattered once where a camera sees it scattered twice.

EXR holds linear radiance in cd/m²; PNG is shown by exposure and tone map.")]
pub(crate) struct Render {
    #[command(flatten)]
    scene: SceneArguments,
    /// How light is computed: reference unless given, but field where --light or --views are.
    #[arg(long, value_enum)]
    lighting: Option<Lighting>,
    /// The picture's file, .exr or .png; may be given several times.
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Samples a pixel: four times as many halve the noise. 64 of the reference, 8 of pictures that
    /// an adapter draws.
    #[arg(long, visible_alias = "samples", value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    spp: Option<u32>,
    #[command(flatten)]
    picture: PictureArguments,
    #[command(flatten)]
    raster: raster_arguments::RasterArguments,
    /// Which light of the reference: direct is what clients draw themselves, indirect what light
    /// fields hold.
    #[arg(long, value_enum, default_value_t = PartsArgument::All)]
    parts: PartsArgument,
    /// How a pixel weighs what it sees.
    #[arg(long, value_enum, default_value_t = FilterArgument::Box)]
    filter: FilterArgument,
    /// Upper limit of one path vertex's contribution to light scattered twice or more, cd/m², against
    /// bright speckles.
    #[arg(long, value_name = "CD/M2", default_value = "inf", value_parser = parse_positive)]
    clamp: f32,
    /// Scattering events from which on paths may end by chance.
    #[arg(long, value_name = "N", default_value_t = 4)]
    roulette_from: u32,
    /// Whether paths of the reference may be connected to what the sun shines on, where a short trial
    /// shows that indirect light is found sooner so.
    #[arg(long, value_name = "BOOL", default_value_t = true, action = clap::ArgAction::Set)]
    follow_sun: bool,
    /// Scene time, seconds: animations are shown as they stand then.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = parse_time)]
    time: f64,
    /// Factor on radiance before the tone map: a number, or auto: 1 over the 99th percentile of
    /// luminance. For PNG only.
    #[arg(long, value_name = "auto|NUMBER", default_value = "auto")]
    exposure: Exposure,
    /// Tone map of PNG: gamma, srgb, reinhard, filmic or neutral.
    #[arg(long, value_name = "NAME", default_value_t = ToneMap::Srgb)]
    tone_map: ToneMap,
    /// Another seed gives other, independent noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Begins anew where an unfinished picture is there.
    #[arg(long)]
    restart: bool,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

/// How light is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Lighting {
    /// By path tracing every pixel.
    Reference,
    /// As a client does: direct light, and indirect light from fields.
    Field,
    /// Direct light alone.
    Direct,
    /// Light of the field alone.
    Indirect,
    /// Only what shines by itself.
    None,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PartsArgument {
    All,
    Direct,
    Indirect,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FilterArgument {
    /// The pixel's own square.
    Box,
    /// Falls to nothing at the neighbours' centres.
    Tent,
    /// σ of half a pixel.
    Gaussian,
}

impl Render {
    pub(crate) fn run(self) -> Result<()> {
        if let (Lighting::Reference, Some(asked)) = (self.lighting(), self.raster.asked_for()) {
            bail!("{asked} is for pictures that an adapter draws; give --lighting field");
        }
        self.check_outputs()?;
        let light = self.raster.light.as_deref().map(light_source::light).transpose()?;
        let edits = light.as_ref().map_or(&[][..], |light| &light.edits);
        let mut scene = self.scene.source.open_edited(edits)?;
        let mut inputs = self.scene.source.files(&scene);
        inputs.extend(self.raster.light_file());
        out_file::check_apart(&self.output, &inputs)?;
        scene.advance(self.time);
        let view = camera::view(&scene, self.picture.camera.as_ref())?;
        match self.lighting() {
            Lighting::Reference => self.trace_picture(&mut scene, view),
            #[cfg(feature = "gpu")]
            _ => self.draw_picture(&mut scene, view, light),
            #[cfg(not(feature = "gpu"))]
            _ => bail!("{}", crate::absent::GPU),
        }
    }

    fn lighting(&self) -> Lighting {
        let unless_given = match self.raster.asked_for() {
            Some(_) => Lighting::Field,
            None => Lighting::Reference,
        };
        self.lighting.unwrap_or(unless_given)
    }

    /// Checks where pictures go: people learn that before hours of work, not after.
    fn check_outputs(&self) -> Result<()> {
        for path in &self.output {
            let extension = path.extension().map(|e| e.to_ascii_lowercase());
            match extension.as_ref().and_then(|e| e.to_str()) {
                Some("png" | "exr") => {}
                _ => bail!("{}: pictures are written as .exr or .png", path.display()),
            }
            out_file::check(path)?;
        }
        Ok(())
    }

    fn write(&self, picture: &Picture, exposure: f32) -> Result<()> {
        for path in &self.output {
            if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
                picture.write_png(path, self.tone_map, exposure)?;
            } else {
                picture.write_exr(path)?;
            }
        }
        Ok(())
    }
}

fn parse_time(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(time) if time >= 0.0 && time.is_finite() => Ok(time),
        _ => Err("seconds from 0 on".into()),
    }
}
