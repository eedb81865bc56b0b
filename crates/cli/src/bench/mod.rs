//! `lumencast bench`: figures of this machine.

mod bmfr;
mod judge;
mod paths;
mod peers;
mod quality;
mod rays;
mod scenes;
mod section;
mod tick;

use anyhow::Result;
use clap::Subcommand;
use lumencast_picture::Picture;
use lumencast_scene::{View, VolumeSpec};
use lumencast_shade::{Lighting, Renderer, Settings};

/// Measures what this machine does.
#[derive(Debug, Subcommand)]
pub(crate) enum Bench {
    Tick(tick::BenchTick),
    Rays(rays::BenchRays),
    Paths(paths::BenchPaths),
    Quality(Box<quality::BenchQuality>),
    Peers(peers::BenchPeers),
    Scenes(scenes::BenchScenes),
}

impl Bench {
    pub(crate) fn run(self) -> Result<()> {
        match self {
            Self::Tick(command) => command.run(),
            Self::Rays(command) => command.run(),
            Self::Paths(command) => command.run(),
            Self::Quality(command) => command.run(),
            Self::Peers(command) => command.run(),
            Self::Scenes(command) => command.run(),
        }
    }
}

/// The light of two parts of a picture together.
fn sum(a: &Picture, b: &Picture) -> Picture {
    let mut sum = a.clone();
    sum.pixels_mut().iter_mut().zip(b.pixels()).for_each(|(a, b)| *a += *b);
    sum
}

/// What an adapter draws of a part of the light.
fn draw(
    renderer: &mut Renderer,
    view: View,
    settings: &Settings,
    lighting: Lighting,
) -> Result<Picture> {
    let settings = Settings { lighting, ..*settings };
    let pixels = renderer.pictures(&[view], &settings)?.remove(0);
    Ok(Picture::new(settings.size.x, settings.size.y, pixels)?)
}

/// A volume's cells as they are given on the command line.
fn cells(spec: &VolumeSpec) -> String {
    let [x, y, z] = spec.grid.resolution.to_array();
    format!("{x}x{y}x{z}")
}

/// The value below which the share `q` of sorted values lies.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    match sorted.len() {
        0 => f64::NAN,
        n => sorted[((n - 1) as f64 * q).round() as usize],
    }
}

/// Least, median and largest of some rounds.
#[derive(Debug, serde::Serialize)]
struct Spread {
    min: f64,
    median: f64,
    max: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self {
            min: quantile(&values, 0.0),
            median: quantile(&values, 0.5),
            max: quantile(&values, 1.0),
        }
    }
}
