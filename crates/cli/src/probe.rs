//! `lumencast probe`: the light that arrives at points.

use anyhow::{Context, Result};
use clap::Args;
use glam::Vec3;
use lumencast_gather::reference::{ProbeEstimate, ProbeSettings, probe_sh};
use lumencast_light::Order;
use serde_json::{Value, json};

use crate::arguments::{Materials, SceneSource};
use crate::output::{self, say};
use crate::values::{parse_order, parse_point};

/// Computes the spherical-harmonic coefficients of the radiance that arrives at points.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast probe cornell --at 0,1,0 --order 2 --samples 65536 --bounces 3 --json
  lumencast probe room.gltf --at 0,1,0 --at 1,1,0 --materials lambert --json

Coefficients are in the order l(l+1)+m, world axes, cd/m². Bounces count surface scattering events on
a path seen from the point: 0 sees emission and environment only. Light of punctual lights that
arrives directly is not in it.")]
pub(crate) struct Probe {
    #[command(flatten)]
    scene: SceneSource,
    /// A point, metres; may be given several times.
    #[arg(long = "at", value_name = "X,Y,Z", required = true, value_parser = parse_point,
          allow_hyphen_values = true)]
    points: Vec<Vec3>,
    /// Highest band, 1 to 4.
    #[arg(long, default_value = "2", value_parser = parse_order)]
    order: Order,
    /// Samples a point, shared out to 16 lattices.
    #[arg(long, default_value_t = 16_384, value_parser = clap::value_parser!(u32).range(1..))]
    samples: u32,
    /// Surface scattering events on a path.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=64))]
    bounces: u32,
    /// How surfaces reflect: as their materials say, or all as opaque two-sided Lambert.
    #[arg(long, value_enum, default_value_t = Materials::Full)]
    materials: Materials,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

/// Independently rotated lattices, from whose scatter the standard errors come.
const LATTICES: u32 = 16;

impl Probe {
    pub(crate) fn run(self) -> Result<()> {
        let mut scene = self.scene.open()?;
        let snapshot = scene.snapshot();
        let settings = ProbeSettings {
            order: self.order,
            samples: self.samples.div_ceil(LATTICES),
            lattices: LATTICES,
            bounces: self.bounces,
            materials: self.materials.model(),
            ..ProbeSettings::default()
        };
        let estimates = probe_sh(&snapshot, &self.points, &settings)
            .context("cannot start the threads that trace")?;
        if self.json {
            return output::json(&self.report(&estimates));
        }
        for (point, estimate) in self.points.iter().zip(&estimates) {
            say!("at {}, {}, {}", point.x, point.y, point.z);
            say!("   l   m {:>33}   standard error", "r, g, b");
            for (i, (sh, error)) in estimate.sh.iter().zip(&estimate.standard_error).enumerate() {
                let l = i.isqrt();
                let m = i as i64 - (l * (l + 1)) as i64;
                let error = format!("{:.5} {:.5} {:.5}", error.x, error.y, error.z);
                say!("{l:>4} {m:>3} {:>10.5} {:>10.5} {:>10.5}   {error}", sh.x, sh.y, sh.z);
            }
        }
        Ok(())
    }

    fn report(&self, estimates: &[ProbeEstimate]) -> Value {
        let rgb = |values: &[Vec3]| values.iter().map(|v| v.to_array()).collect::<Vec<_>>();
        let probes: Vec<Value> = self
            .points
            .iter()
            .zip(estimates)
            .map(|(point, estimate)| {
                json!({
                    "at": point.to_array(),
                    "sh": rgb(&estimate.sh),
                    "standard_error": rgb(&estimate.standard_error),
                })
            })
            .collect();
        json!({
            "order": self.order,
            "samples": self.samples,
            "bounces": self.bounces,
            "lattices": LATTICES,
            "materials": self.materials.to_string(),
            "probes": probes,
        })
    }
}
