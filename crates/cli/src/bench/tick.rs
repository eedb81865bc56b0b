//! `lumencast bench tick`: the server's tick.

use std::collections::BTreeMap;

use anyhow::Result;
use clap::Args;
use lumencast_codec::{Catalog, EncodedRegion, ProbeHeader};
use lumencast_gather::path_trace::Levels;
use lumencast_server::{Mail, Outlet, Report, Stage, Tick};
use serde_json::{Value, json};

use super::cast::Cast;
use super::quantile;
use crate::arguments::{GatherArguments, SceneArguments, TickArguments};
use crate::charting::Lumels;
use crate::output::{self, say};

/// Runs the server's tick without network and prints its times, samples and bytes.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bench tick cornell
  lumencast bench tick cornell --seconds 60 --edits benches/minute.jsonl --live --json

One tick follows another at once, and waits for the light of its lumels; the scene's time moves by a
period each. With --live the scene's time is that of the clock, as a server's is, and no tick waits for
lumels: bytes a second are then what this machine sends. Every region counts as watched. Times on a
machine that does other things besides are not worth much.")]
pub(crate) struct BenchTick {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    gather: GatherArguments,
    /// Seconds of scene time to run.
    #[arg(long, default_value_t = 20.0)]
    seconds: f64,
    #[command(flatten)]
    tick: TickArguments,
    /// Keeps the pace of a server.
    #[arg(long)]
    live: bool,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

/// The number of samples settles within so many ticks, which the figures of time leave out.
const SETTLING: usize = 25;
/// Bytes of a probe of L2 in half floats: the second paper's, and its published implementation's.
const RAW_BYTES: [(&str, u64); 2] = [("paper", 56), ("implementation", 72)];

impl BenchTick {
    pub(crate) fn run(self) -> Result<()> {
        let mut scene = self.scene.source.open()?;
        let mut gatherer = self.gather.gatherer(Levels::Two)?;
        let options = self.tick.options(&mut scene, &self.scene, &self.gather, &mut *gatherer)?;
        let period = options.period;
        let pages = options.lightmap.as_ref().map(Lumels::of);
        let mut cast = Cast::new(scene, gatherer, options)?;
        let end = SETTLING as f64 * period + self.seconds.max(period);
        let bar = output::bar((end / period).ceil() as u64, "Ticks");
        let lightmaps = cast.tick.light().lightmaps().map(|lightmap| lightmap.id.0).collect();
        let mut sent = Sent { lightmaps, ..Sent::default() };
        let mut first_half = None;
        let mut reports: Vec<Report> = Vec::new();
        let mut now = 0.0;
        // Half a period: sums of periods are not exact.
        while now < end - 0.5 * period {
            if now >= 0.5 * end {
                first_half.get_or_insert(sent.lumels);
            }
            let mail = Mail::default();
            if self.live {
                reports.push(cast.step(now, mail, &mut sent));
                cast.rest();
                now = cast.now();
            } else {
                reports.push(cast.tick.step(now, mail, &mut sent));
                now = reports.len() as f64 * period;
            }
            bar.set_position((now / period) as u64);
        }
        bar.finish_and_clear();
        let tick = &cast.tick;
        let settled = &reports[SETTLING.min(reports.len() - 1)..];
        let mut figures = self.figures(tick, settled, &sent, reports.len() as u64);
        let lumels: usize =
            tick.light().lightmaps().map(|lightmap| lightmap.irradiance.len()).sum();
        if lumels > 0 {
            let of_second_half = sent.lumels - first_half.unwrap_or_default();
            figures["lightmap"] = json!({
                "pages": pages,
                "lumels": lumels,
                "bytes_a_second": sent.lumels as f64 / end,
                "bytes_a_second_of_second_half": of_second_half as f64 / (0.5 * end),
            });
        }
        if self.json {
            return output::json(&figures);
        }
        print_figures(&figures, pages);
        Ok(())
    }

    fn figures(&self, tick: &Tick, reports: &[Report], sent: &Sent, updates: u64) -> Value {
        let milliseconds = |seconds: &dyn Fn(&Report) -> f64| {
            let mut times: Vec<f64> = reports.iter().map(|r| seconds(r) * 1e3).collect();
            times.sort_by(f64::total_cmp);
            json!({ "median": quantile(&times, 0.5), "p99": quantile(&times, 0.99) })
        };
        let stages: BTreeMap<String, Value> = Stage::ALL
            .iter()
            .map(|&stage| (stage.to_string(), milliseconds(&|r| r.stage(stage))))
            .collect();
        let mut samples: Vec<f64> = reports.iter().map(|r| r.samples_a_probe.into()).collect();
        samples.sort_by(f64::total_cmp);
        let gathering: f64 = reports.iter().map(|r| r.stage(Stage::Gather)).sum();
        let per_second = |n: &dyn Fn(&Report) -> u64| {
            reports.iter().map(|r| n(r) as f64).sum::<f64>() / gathering.max(1e-9)
        };
        let in_time = reports.iter().filter(|r| !r.late).count();
        let fields: Vec<Value> = tick
            .light()
            .volumes()
            .map(|volume| {
                let id = volume.id.0;
                let probes = volume.grid.probe_count() as u64;
                let bytes: Vec<u64> = (0..3).map(|l| sent.bytes(id, l)).collect();
                let update = bytes.iter().sum::<u64>() as f64 / updates as f64;
                let raw: BTreeMap<_, _> =
                    RAW_BYTES.iter().map(|(name, bytes)| (*name, probes * bytes)).collect();
                json!({
                    "id": id,
                    "resolution": volume.grid.resolution.to_array(),
                    "order": volume.order,
                    "probes": probes,
                    "bytes_an_update": update,
                    "bytes_a_probe_and_update": update / probes as f64,
                    "bytes_by_layer": bytes,
                    "raw_bytes_an_update": raw,
                })
            })
            .collect();
        json!({
            "scene": tick.scene().name(),
            "cores": std::thread::available_parallelism().map_or(1, |n| n.get()),
            "rate": self.tick.rate,
            "ticks": reports.len(),
            "tick_ms": milliseconds(&Report::total_seconds),
            "stages_ms": stages,
            "share_in_time": in_time as f64 / reports.len() as f64,
            "bounces": self.gather.bounces,
            "samples_a_probe": {
                "min": samples.first(), "median": quantile(&samples, 0.5), "max": samples.last(),
            },
            "samples_a_second": per_second(&|r| r.samples),
            "rays_a_second": per_second(&|r| r.rays),
            "fields": fields,
            "codec_rms_error_of_c0": sent.rms_error(),
            "edits_accepted": reports.iter().map(|r| r.accepted).sum::<u64>(),
            "edits_refused": reports.iter().map(|r| r.refused).sum::<u64>(),
            "state_bytes_a_tick": sent.state as f64 / updates as f64,
            "catalog_bytes_a_tick": sent.catalog as f64 / updates as f64,
        })
    }
}

/// Counts what a tick sends.
#[derive(Debug, Default)]
struct Sent {
    state: u64,
    catalog: u64,
    /// Bytes of probes by field and layer.
    probes: BTreeMap<(u32, u8), u64>,
    /// Fields that are lightmaps.
    lightmaps: Vec<u32>,
    /// Bytes of their frames.
    lumels: u64,
    /// The sum over probes of the squared error relative to c0; `weight` is their number.
    squared_error: f64,
    weight: f64,
}

impl Sent {
    fn bytes(&self, field: u32, layer: u8) -> u64 {
        self.probes.get(&(field, layer)).copied().unwrap_or(0)
    }

    fn rms_error(&self) -> f64 {
        (self.squared_error / self.weight.max(1.0)).sqrt()
    }
}

impl Outlet for Sent {
    fn is_watched(&self, _: u32, _: u32) -> bool {
        true
    }

    fn catalog(&mut self, catalog: &Catalog) {
        self.catalog += catalog.encode().len() as u64;
    }

    fn state(&mut self, frame: Vec<u8>, _: bool) {
        self.state += frame.len() as u64;
    }

    fn light(&mut self, field: u32, frame: EncodedRegion) {
        let bytes = frame.bytes.len() as u64;
        if self.lightmaps.contains(&field) {
            self.lumels += bytes;
            return;
        }
        *self.probes.entry((field, frame.layer)).or_default() += bytes;
        let probes = ProbeHeader::read(&frame.bytes).map_or(0, |header| header.probes()) as f64;
        self.squared_error += f64::from(frame.error).powi(2) * probes;
        self.weight += probes;
    }
}

fn print_figures(figures: &Value, pages: Option<Lumels>) {
    let number =
        |pointer: &str| figures.pointer(pointer).and_then(Value::as_f64).unwrap_or(f64::NAN);
    say!(
        "{}: {} ticks at {} Hz on {} cores, {} bounces",
        figures["scene"].as_str().unwrap_or_default(),
        figures["ticks"],
        figures["rate"],
        figures["cores"],
        figures["bounces"],
    );
    say!(
        "tick        median {:.2} ms, p99 {:.2} ms, {:.1} % in time",
        number("/tick_ms/median"),
        number("/tick_ms/p99"),
        100.0 * number("/share_in_time"),
    );
    for stage in Stage::ALL {
        let (median, p99) = (
            number(&format!("/stages_ms/{stage}/median")),
            number(&format!("/stages_ms/{stage}/p99")),
        );
        say!("  {:<11} median {median:.3} ms, p99 {p99:.3} ms", stage.to_string());
    }
    say!(
        "samples     {} to {} a probe, median {}; {:.2} M a second, {:.2} M rays a second",
        figures["samples_a_probe"]["min"],
        figures["samples_a_probe"]["max"],
        figures["samples_a_probe"]["median"],
        number("/samples_a_second") / 1e6,
        number("/rays_a_second") / 1e6,
    );
    for field in figures["fields"].as_array().into_iter().flatten() {
        say!(
            "field {}     {} probes: {:.0} bytes an update, {:.2} a probe (raw {} or {}); layers {}",
            field["id"],
            field["probes"],
            field["bytes_an_update"].as_f64().unwrap_or(f64::NAN),
            field["bytes_a_probe_and_update"].as_f64().unwrap_or(f64::NAN),
            field["raw_bytes_an_update"]["paper"],
            field["raw_bytes_an_update"]["implementation"],
            field["bytes_by_layer"],
        );
    }
    if let Some((lumels, pages)) = figures["lightmap"]["lumels"].as_u64().zip(pages) {
        say!(
            "lightmap    {pages}, {lumels} lumels: {:.1} KB/s, in the second half {:.1} KB/s",
            number("/lightmap/bytes_a_second") / 1e3,
            number("/lightmap/bytes_a_second_of_second_half") / 1e3,
        );
    }
    say!("codec       RMS error {:.3} % of c0", 100.0 * number("/codec_rms_error_of_c0"));
    say!(
        "edits       {} accepted, {} refused; state {:.0} bytes a tick, catalogs {:.0}",
        figures["edits_accepted"],
        figures["edits_refused"],
        number("/state_bytes_a_tick"),
        number("/catalog_bytes_a_tick"),
    );
}
