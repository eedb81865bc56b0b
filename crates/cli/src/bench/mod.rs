//! `lumencast bench`: figures of this machine.

#[cfg(feature = "gpu")]
mod bmfr;
mod cast;
#[cfg(feature = "gpu")]
mod drawing;
#[cfg(feature = "gpu")]
mod judge;
mod lightmap;
mod paths;
#[cfg(feature = "gpu")]
mod peers;
#[cfg(feature = "gpu")]
mod quality;
mod rays;
#[cfg(feature = "gpu")]
mod scenes;
#[cfg(feature = "gpu")]
mod section;
mod tick;
#[cfg(feature = "gpu")]
mod traced;

use anyhow::Result;
use clap::Subcommand;
use lumencast_codec::{Catalog, EncodedRegion};
use lumencast_server::Outlet;

/// Measures what this machine does.
#[derive(Debug, Subcommand)]
pub(crate) enum Bench {
    Tick(tick::BenchTick),
    Rays(rays::BenchRays),
    Paths(paths::BenchPaths),
    Lightmap(lightmap::BenchLightmap),
    #[cfg(feature = "gpu")]
    Quality(Box<quality::BenchQuality>),
    #[cfg(feature = "gpu")]
    Peers(peers::BenchPeers),
    #[cfg(feature = "gpu")]
    Scenes(scenes::BenchScenes),
    #[cfg(not(feature = "gpu"))]
    #[command(aliases = ["peers", "scenes"])]
    Quality(crate::absent::Drawing),
}

impl Bench {
    pub(crate) fn run(self) -> Result<()> {
        match self {
            Self::Tick(command) => command.run(),
            Self::Rays(command) => command.run(),
            Self::Paths(command) => command.run(),
            Self::Lightmap(command) => command.run(),
            Self::Quality(command) => command.run(),
            #[cfg(feature = "gpu")]
            Self::Peers(command) => command.run(),
            #[cfg(feature = "gpu")]
            Self::Scenes(command) => command.run(),
        }
    }
}

/// The value below which the share `q` of sorted values lies.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    match sorted.len() {
        0 => f64::NAN,
        n => sorted[((n - 1) as f64 * q).round() as usize],
    }
}

/// An outlet that keeps nothing of what a tick sends.
struct Nobody {
    /// Whether all regions count as watched, so that they are encoded.
    watches: bool,
}

impl Outlet for Nobody {
    fn is_watched(&self, _: u32, _: u32) -> bool {
        self.watches
    }

    fn catalog(&mut self, _: &Catalog) {}

    fn state(&mut self, _: Vec<u8>, _: bool) {}

    fn light(&mut self, _: u32, _: EncodedRegion) {}
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
