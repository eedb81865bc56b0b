//! What was measured, for machines as it is serialised, for people as text.

use std::fmt::{self, Write};

use lumencast_light::Order;
use serde::Serialize;

use super::subjects::{Published, Rival};
use crate::bench::judge::{Deviation, Psnr};
use crate::charting::Lumels;

#[derive(Serialize)]
pub(super) struct Report {
    pub(super) adapter: String,
    pub(super) probe_samples: u32,
    pub(super) lumel_samples: u32,
    pub(super) bounces: u32,
    pub(super) scenes: Vec<Table>,
}

/// What is measured of a scene.
#[derive(Serialize)]
pub(super) struct Table {
    pub(super) scene: &'static str,
    pub(super) published: Published,
    pub(super) without_indirect: Psnr,
    pub(super) fields: Vec<Field>,
}

/// What is measured of one field.
#[derive(Serialize)]
pub(super) struct Field {
    pub(super) grid: String,
    pub(super) order: Order,
    /// Points a probe that it is fitted to, if it is.
    pub(super) fit: Option<u32>,
    /// Lumels that still surfaces take their light from in place of probes.
    pub(super) lumels: Option<Lumels>,
    pub(super) psnr: Psnr,
    /// Of its indirect part alone, beside the path tracer's.
    pub(super) indirect: Psnr,
    pub(super) faults: Vec<Fault>,
}

#[derive(Serialize)]
pub(super) struct Fault {
    pub(super) fault: &'static str,
    #[serde(flatten)]
    pub(super) deviation: Deviation,
}

impl Report {
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        for table in &self.scenes {
            // Writing to a string does not fail.
            let _ = table.write(&mut text);
        }
        let Self { adapter, probe_samples, lumel_samples, bounces, .. } = self;
        text + &format!(
            "{probe_samples} samples a probe, {lumel_samples} a lumel, {bounces} bounces; {adapter}\n"
        )
    }
}

impl Table {
    fn write(&self, out: &mut String) -> fmt::Result {
        let Published { as_it_comes, best_settings, three } = self.published;
        writeln!(out, "{}\n  published: {as_it_comes}, best {best_settings}", self.scene)?;
        for Rival { name, whole, indirect } in three {
            writeln!(out, "  three.js r187, {name}: {whole}, indirect part {indirect}")?;
        }
        writeln!(out, "  without indirect light: {}", self.without_indirect)?;
        for field in &self.fields {
            let above = field.psnr.sharp - best_settings.sharp;
            let how = match field.fit {
                Some(points) => format!("fitted to {points} points a probe"),
                None => "as gathered".to_owned(),
            };
            let lumels = field.lumels.as_ref().map_or_else(String::new, |of| format!(", {of}"));
            let order = u8::from(field.order);
            writeln!(out, "  {} L{order}, {how}{lumels}: {}, {above:+.1}", field.grid, field.psnr)?;
            writeln!(out, "    indirect part {}", field.indirect)?;
            for Fault { fault, deviation: Deviation { mean, rms } } in &field.faults {
                let [r, g, b] = mean.to_array();
                writeln!(out, "    {fault}: {r:+.1} {g:+.1} {b:+.1}, rms {rms:.1}")?;
            }
        }
        writeln!(out)
    }
}
