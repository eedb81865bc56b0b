//! From where a picture is taken, how large it is, and how far its paths go.

use std::num::NonZeroUsize;
use std::str::FromStr;

use anyhow::{Result, bail};
use clap::Args;
use glam::{UVec2, Vec3};
use lumencast_gather::path_trace::{Levels, Options};
use lumencast_gather::reference::PictureSettings;
use lumencast_scene::{NamedView, Scene, View};

use crate::arguments::Materials;

/// What every path-traced picture needs to know.
#[derive(Debug, Args)]
pub(crate) struct PictureArguments {
    /// Surface scattering events on a path, seen from the camera.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(0..=1024))]
    pub(crate) bounces: u32,
    /// Width and height, pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub(crate) size: UVec2,
    /// A camera of the scene by name or number, or eye, target and vertical field of view in
    /// degrees; the scene's first camera unless given.
    #[arg(long, value_name = "NAME|INDEX|EYE,TARGET[,FOV]", allow_hyphen_values = true)]
    pub(crate) camera: Option<CameraArgument>,
    /// How surfaces reflect: as their materials say, or all as opaque two-sided Lambert.
    #[arg(long, value_enum, default_value_t = Materials::Full)]
    pub(crate) materials: Materials,
    /// Threads; all cores unless given.
    #[arg(long)]
    pub(crate) threads: Option<NonZeroUsize>,
}

impl PictureArguments {
    /// How probes of the same picture are traced.
    pub(crate) fn tracing(&self) -> Options {
        let (materials, threads) = (self.materials.model(), self.threads);
        Options { materials, threads, levels: Levels::One }
    }

    pub(crate) fn settings(&self) -> PictureSettings {
        PictureSettings {
            size: self.size,
            bounces: self.bounces,
            materials: self.materials.model(),
            threads: self.threads,
            ..PictureSettings::default()
        }
    }
}

/// Vertical field of view where none is given, degrees.
const FIELD_OF_VIEW: f32 = 50.0;

/// A camera as given on the command line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum CameraArgument {
    /// A camera of the scene, by its name, its node's name or its number.
    Named(String),
    /// From an eye to a target.
    LookAt(View),
}

impl FromStr for CameraArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f32>, _> = text.split(',').map(|n| n.trim().parse()).collect();
        match numbers.as_deref() {
            Ok([a, b, c, d, e, f, rest @ ..]) if rest.len() <= 1 => {
                let fov = rest.first().copied().unwrap_or(FIELD_OF_VIEW);
                let (eye, target) = (Vec3::new(*a, *b, *c), Vec3::new(*d, *e, *f));
                match View::look_at(eye, target, fov.to_radians()) {
                    Some(view) => Ok(Self::LookAt(view)),
                    None => Err("eye and target have to differ, the field of view to lie between \
                                 0 and 180 degrees"
                        .into()),
                }
            }
            Ok([_, _, ..]) => {
                Err("a camera is given as NAME, INDEX or EX,EY,EZ,TX,TY,TZ[,FOV]".into())
            }
            _ => Ok(Self::Named(text.to_owned())),
        }
    }
}

/// The view of the camera asked for; of the scene's first where none was; of the whole scene where
/// it has none.
pub(crate) fn view(scene: &Scene, camera: Option<&CameraArgument>) -> Result<View> {
    let views = scene.views();
    match camera {
        Some(camera) => among(&views, camera),
        None => Ok(views[0].view),
    }
}

/// The view asked for, among those of a scene.
pub(crate) fn among(views: &[NamedView], camera: &CameraArgument) -> Result<View> {
    let name = match camera {
        CameraArgument::LookAt(view) => return Ok(*view),
        CameraArgument::Named(name) => name,
    };
    let named = views.iter().find(|v| v.name == *name || v.node_name == *name);
    let numbered = || views.get(name.parse::<usize>().ok()?);
    match named.or_else(numbered) {
        Some(found) => Ok(found.view),
        None => {
            let known: Vec<_> =
                views.iter().enumerate().map(|(i, v)| format!("{i} ({})", v.name)).collect();
            bail!(
                "there is no camera {name:?}; there are {}, and EX,EY,EZ,TX,TY,TZ[,FOV]",
                known.join(", ")
            )
        }
    }
}

/// `WxH`
pub(crate) fn parse_size(text: &str) -> Result<UVec2, String> {
    const LARGEST: u32 = 16_384;
    let wrong = || format!("{text:?}: a size is given as 1280x720, each side from 1 to {LARGEST}");
    let (width, height) = text.split_once('x').ok_or_else(wrong)?;
    let side = |text: &str| match text.parse() {
        Ok(n) if (1..=LARGEST).contains(&n) => Ok(n),
        _ => Err(wrong()),
    };
    Ok(UVec2::new(side(width)?, side(height)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras() {
        let parse = |text: &str| text.parse::<CameraArgument>();
        assert_eq!(parse("nave"), Ok(CameraArgument::Named("nave".into())));
        assert_eq!(parse("1"), Ok(CameraArgument::Named("1".into())));
        let given = |eye: Vec3, fov: f32| {
            let view = View::look_at(eye, Vec3::Y, fov.to_radians()).expect("two points");
            Ok(CameraArgument::LookAt(view))
        };
        assert_eq!(parse("0,1,3,0,1,0"), given(Vec3::new(0.0, 1.0, 3.0), 50.0));
        assert_eq!(parse("0, 1, -3.5, 0, 1, 0, 35"), given(Vec3::new(0.0, 1.0, -3.5), 35.0));
        for wrong in ["1,2", "1,2,3,1,2,3", "0,0,0,1,1,1,180", "0,0,nan,1,1,1", "1,2,3,4,5,6,7,8"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn found_in_a_scene() {
        let scene = Scene::open("cornell").expect("a built-in scene");
        let first = view(&scene, None).expect("its first");
        let zero = view(&scene, Some(&CameraArgument::Named("0".into()))).expect("the same");
        assert_eq!(first, zero);
        let error = view(&scene, Some(&CameraArgument::Named("x".into()))).expect_err("none");
        assert!(error.to_string().contains("0 ("), "{error}");
    }
}
