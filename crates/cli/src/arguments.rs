//! Arguments that several commands share.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, Result, ensure};
use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::{Args, ValueEnum};
use glam::{Quat, UVec3, Vec3};
use lumencast_codec::check_volumes;
use lumencast_gather::Gather;
use lumencast_gather::path_trace::{CpuPathTracer, Levels, MaterialModel, Options};
use lumencast_light::{Grid, Offset, Order};
use lumencast_scene::{Edit, FileContents, Scene, Script, VolumeSpec};
use lumencast_server::{SampleRange, TickOptions};
#[cfg(feature = "gpu")]
use lumencast_shade::Occlusion;
use lumencast_solve::blend::BlendSettings;
use lumencast_solve::{Effort, FitOptions, GatherOptions, Survey};

use crate::environment::EnvironmentArgument;
use crate::output::tell;
use crate::values::{
    parse_list, parse_offset, parse_order, parse_point, parse_positive, parse_rate, parse_samples,
    parse_share,
};
use crate::{output, warnings};

/// The port of `serve` unless told otherwise.
pub(crate) const DEFAULT_PORT: u16 = 4443;

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
    /// The scene, with what there is to be said of it said.
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

/// Names are passed on as text, to servers and pages too.
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

/// Points a probe of light that is computed once, unless told otherwise.
const POINTS: u32 = 256;
/// Where fitted light is read unless told otherwise. Farther off, points on both sides of an edge read
/// the same place; at the surface itself, both sides of a wall do (`docs/results/walls.md`).
const NEAR: Offset = Offset::Cells(0.125);

/// Samples of a probe, at most, unless told otherwise.
pub(crate) const MOST_SAMPLES: u32 = 32_768;
/// How noisy light may be that is computed once, unless told otherwise: codes of 0 to 255.
const NOISE: &str = "0.5";

/// The noise at which computing ends, if it is to end by that.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoiseArgument(Option<f32>);

impl FromStr for NoiseArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "off" => Ok(Self(None)),
            _ => Ok(Self(Some(parse_positive(text).map_err(|why| format!("{why}, or off"))?))),
        }
    }
}

/// How long light is computed that is computed once.
#[derive(Debug, Args)]
pub(crate) struct EffortArguments {
    /// The noise at which computing ends: root of the mean square of what noise adds to surfaces as
    /// they are displayed, in codes of 0 to 255; off to take all samples.
    #[arg(long, value_name = "CODES|off", default_value = NOISE)]
    noise: NoiseArgument,
}

impl EffortArguments {
    /// With so many samples a probe at most.
    pub(crate) fn with(&self, samples: u32) -> Effort {
        Effort { samples, noise: self.noise.0 }
    }
}

/// Where on surfaces light is read, and whether it is fitted to be read there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    pub(crate) fit: Option<FitOptions>,
    pub(crate) offset: Offset,
}

impl Reading {
    pub(crate) fn gathered(self, bounces: u32, clamp: f32, blend: BlendSettings) -> GatherOptions {
        GatherOptions { bounces, clamp, blend, fit: self.fit, offset: self.offset }
    }
}

/// How surfaces read light.
#[derive(Debug, Args)]
pub(crate) struct ReadingArguments {
    /// Fits probes to the surfaces about them, so that light leaks through no walls: so many points of
    /// surfaces a probe, 0 to leave probes with what arrives at them. Takes as many samples again.
    /// Unless given, 256 where light is computed once, and none where it is live.
    #[arg(long, value_name = "POINTS", value_parser = clap::value_parser!(u32).range(0..=4096))]
    fit: Option<u32>,
    /// Where in front of a surface light is read: none, half-cell, N-cells or metres. Unless given,
    /// where the light says; light that is computed says half a cell, which is three.js's rule, but
    /// 0.125 cells where it is fitted and drawn at once.
    #[arg(long, value_name = "none|half-cell|N-cells|METRES", value_parser = parse_offset)]
    pub(crate) offset: Option<Offset>,
}

impl ReadingArguments {
    /// For pages, live.
    pub(crate) fn served(&self) -> Reading {
        Reading { fit: self.fit(0), offset: self.offset.unwrap_or_default() }
    }

    /// For whoever has the file.
    pub(crate) fn baked(&self) -> Reading {
        Reading { fit: self.fit(POINTS), offset: self.offset.unwrap_or_default() }
    }

    /// For our own renderer.
    pub(crate) fn drawn(&self) -> Reading {
        let fit = self.fit(POINTS);
        let usual = if fit.is_some() { NEAR } else { Offset::default() };
        Reading { fit, offset: self.offset.unwrap_or(usual) }
    }

    /// What is compared with what: light as it is gathered, and fitted where that is asked for.
    pub(crate) fn compared(&self) -> Vec<Reading> {
        let gathered = Reading { fit: None, offset: self.offset.unwrap_or_default() };
        let fitted = Some(self.drawn()).filter(|reading| reading.fit.is_some());
        [gathered].into_iter().chain(fitted).collect()
    }

    fn fit(&self, usual: u32) -> Option<FitOptions> {
        let points = self.fit.unwrap_or(usual);
        (points > 0).then_some(FitOptions { points })
    }
}

/// How ticks follow one another.
#[derive(Debug, Args)]
pub(crate) struct TickArguments {
    /// Ticks a second.
    #[arg(long, default_value = "25", value_name = "HZ", value_parser = parse_rate)]
    pub(crate) rate: f64,
    /// Samples a probe and tick: fixed, or between two bounds so that the tick fits its period.
    #[arg(long, default_value = "4..256", value_name = "N|MIN..MAX", value_parser = parse_samples)]
    samples: SampleRange,
    /// Least weight of a new update: lower is calmer, higher follows small changes sooner.
    #[arg(long, default_value = "0.01", value_parser = parse_share)]
    ratio: f32,
    /// Standard deviations by which a change stands out to be followed at once; inf to follow by
    /// the ratio alone.
    #[arg(long, default_value = "3.5", value_parser = parse_positive)]
    significance: f32,
    /// Lets paths go on, where they end, in the light of the tick before: all bounces for the price
    /// of few, as coarse as the probes are.
    #[arg(long)]
    feedback: bool,
    /// A script of edits (JSON lines, {"at": seconds, "edit": …}), played by scene time.
    #[arg(long, value_name = "FILE")]
    pub(crate) edits: Option<PathBuf>,
}

impl TickArguments {
    /// All that a tick needs to know.
    pub(crate) fn options(
        &self,
        scene: &mut Scene,
        volumes: &SceneArguments,
        gather: &GatherArguments,
        gatherer: &mut dyn Gather,
    ) -> Result<TickOptions> {
        let blend = BlendSettings { ratio: self.ratio, significance: self.significance };
        let feedback = if self.feedback { ", feedback" } else { "" };
        let gather = gather.options(blend, gather.reading.served());
        Ok(TickOptions {
            period: 1.0 / self.rate,
            samples: self.samples,
            source: source(&gather) + feedback,
            gather,
            feedback: self.feedback,
            volumes: volumes.volumes(scene, gatherer)?,
            script: self.edits.as_deref().map(read_script).transpose()?,
        })
    }
}

/// How surfaces reflect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Materials {
    /// As their materials say.
    Full,
    /// As opaque two-sided Lambert with their base colour, for comparisons.
    Lambert,
}

impl Materials {
    pub(crate) fn model(self) -> MaterialModel {
        match self {
            Self::Full => MaterialModel::Full,
            Self::Lambert => MaterialModel::Lambert,
        }
    }

    /// The same for what an adapter draws.
    #[cfg(feature = "gpu")]
    pub(crate) fn drawn(self) -> lumencast_shade::Materials {
        match self {
            Self::Full => lumencast_shade::Materials::Full,
            Self::Lambert => lumencast_shade::Materials::Lambert,
        }
    }
}

impl fmt::Display for Materials {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Full => "full",
            Self::Lambert => "lambert",
        })
    }
}

/// A factor on radiance, or none where it is to be found from a picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exposure(pub(crate) Option<f32>);

impl FromStr for Exposure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self(None));
        }
        match text.parse() {
            Ok(factor) if factor > 0.0 && f32::is_finite(factor) => Ok(Self(Some(factor))),
            _ => Err("give auto or a positive number".into()),
        }
    }
}

/// Reads a script of edits.
fn read_script(path: &Path) -> Result<Script> {
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("cannot read the edits in {}", path.display()))?;
    Script::parse(&text).with_context(|| path.display().to_string())
}

/// A volume as given on the command line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VolumeArgument {
    /// Cells along each axis.
    pub(crate) resolution: UVec3,
    /// Centre and size; the scene's bounds if absent.
    pub(crate) place: Option<(Vec3, Vec3)>,
}

impl VolumeArgument {
    /// The volume in a scene: without a place of its own it spans the scene's bounds.
    pub(crate) fn in_scene(&self, scene: &Scene) -> Result<VolumeSpec> {
        let bounds = scene.bounds();
        let (center, size) = self.place.unwrap_or((
            0.5 * (bounds.min + bounds.max),
            (bounds.max - bounds.min).max(Vec3::splat(1e-3)),
        ));
        let grid = Grid { center, rotation: Quat::IDENTITY, size, resolution: self.resolution };
        let volume = VolumeSpec { grid, order: Order::default() };
        volume.check().map_err(anyhow::Error::msg)?;
        Ok(volume)
    }
}

impl FromStr for VolumeArgument {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let (cells, place) = match text.split_once('@') {
            Some((cells, place)) => (cells, Some(place)),
            None => (text, None),
        };
        let resolution: [u32; 3] = parse_list(cells, 'x')
            .with_context(|| format!("{cells:?}: cells are given as 10x6x7"))?;
        ensure!(resolution.iter().all(|n| *n > 0), "{cells:?}: at least one cell along each axis");
        let place = place.map(|place| -> Result<_> {
            let (center, size) = place
                .split_once(':')
                .with_context(|| format!("{place:?}: a place is given as X,Y,Z:SX,SY,SZ"))?;
            let (center, size) = (parse_point(center)?, parse_point(size)?);
            ensure!(size.cmpgt(Vec3::ZERO).all(), "a volume's size is more than 0 along each axis");
            Ok((center, size))
        });
        Ok(Self { resolution: resolution.into(), place: place.transpose()? })
    }
}

/// Ambient occlusion that reaches so far.
#[cfg(feature = "gpu")]
pub(crate) fn occlusion(radius: f32) -> Option<Occlusion> {
    (radius > 0.0).then(|| Occlusion { radius, ..Occlusion::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes() {
        let v: VolumeArgument = "10x6x7".parse().expect("cells only");
        assert_eq!(v, VolumeArgument { resolution: UVec3::new(10, 6, 7), place: None });
        let v: VolumeArgument = "1x2x3@0,-1.5,2:4,5,6".parse().expect("cells and place");
        assert_eq!(v.place, Some((Vec3::new(0.0, -1.5, 2.0), Vec3::new(4.0, 5.0, 6.0))));
        for wrong in
            ["", "8", "8x8", "0x1x1", "8x8x8@", "8x8x8@0,0,0", "8x8x8@0,0,0:1,1,0", "axbxc"]
        {
            assert!(wrong.parse::<VolumeArgument>().is_err(), "{wrong}");
        }
        assert!(parse_point("1,2,inf").is_err());
    }

    #[test]
    fn samples() {
        assert_eq!(parse_samples("16").expect("one number"), SampleRange { min: 16, max: 16 });
        assert_eq!(parse_samples("4..64").expect("a range"), SampleRange { min: 4, max: 64 });
        for wrong in ["", "0", "64..4", "..", "-1", "4..x", "99999999"] {
            assert!(parse_samples(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn offsets() {
        assert_eq!(parse_offset("none"), Ok(Offset::NONE));
        assert_eq!(parse_offset("half-cell"), parse_offset("0.5-cells"));
        assert_eq!(parse_offset("0.25"), Ok(Offset::Metres(0.25)));
        for wrong in ["inf", "half", "-cells", "nan-cells", "0.5-metres"] {
            assert!(parse_offset(wrong).is_err(), "{wrong}");
        }
    }
}
