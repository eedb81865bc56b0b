//! Counters of a running server, as text for Prometheus.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};

use lumencast_transport::{RefusalKind, Refusals};

use crate::report::{Report, Stage};

/// Upper bounds of the histograms' buckets, seconds: around the period of 25 Hz and its share.
const BUCKETS: [f64; 12] =
    [0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.03, 0.034, 0.04, 0.06, 0.1, 0.25];

/// What has been counted since the start. Shared between the tick and the HTTP router.
#[derive(Debug, Default)]
pub struct Metrics {
    counted: Mutex<Counted>,
}

#[derive(Debug, Default)]
struct Counted {
    stages: [Histogram; Stage::ALL.len()],
    tick: Histogram,
    late: u64,
    samples: u64,
    rays: u64,
    accepted: u64,
    refused: u64,
    track_bytes: BTreeMap<String, u64>,
    clients: u64,
    refusals: [u64; RefusalKind::ALL.len()],
    probes: u64,
    buried: u64,
    samples_a_probe: u32,
    scene_version: u64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Histogram {
    buckets: [u64; BUCKETS.len()],
    count: u64,
    sum: f64,
}

impl Histogram {
    fn record(&mut self, seconds: f64) {
        self.count += 1;
        self.sum += seconds;
        if let Some(i) = BUCKETS.iter().position(|bound| seconds <= *bound) {
            self.buckets[i] += 1;
        }
    }
}

impl Metrics {
    /// Takes in one tick.
    pub fn record(&self, report: &Report) {
        let mut c = self.lock();
        for (histogram, seconds) in c.stages.iter_mut().zip(report.seconds) {
            histogram.record(seconds);
        }
        c.tick.record(report.total_seconds());
        c.late += u64::from(report.late);
        c.samples += report.samples;
        c.rays += report.rays;
        c.accepted += report.accepted;
        c.refused += report.refused;
        c.probes = report.probes;
        c.buried = report.buried;
        c.samples_a_probe = report.samples_a_probe;
        c.scene_version = report.scene_version;
    }

    /// Counts bytes written to a track.
    pub fn sent(&self, track: &str, bytes: usize) {
        let mut c = self.lock();
        match c.track_bytes.get_mut(track) {
            Some(total) => *total += bytes as u64,
            None => drop(c.track_bytes.insert(track.to_owned(), bytes as u64)),
        }
    }

    /// Sets the number of clients connected now, and of those who were refused.
    pub fn set_network(&self, clients: usize, refusals: &Refusals) {
        let mut c = self.lock();
        c.clients = clients as u64;
        c.refusals = RefusalKind::ALL.map(|kind| refusals.of(kind));
    }

    /// The text format of Prometheus, version 0.0.4.
    pub fn render(&self) -> String {
        let c = self.lock();
        let mut out = String::with_capacity(8192);
        let ticks = c.tick.count;
        out.push_str("# HELP lumencast_tick_seconds Time of a tick.\n");
        out.push_str("# TYPE lumencast_tick_seconds histogram\n");
        histogram(&mut out, "lumencast_tick_seconds", "", &c.tick);
        out.push_str("# HELP lumencast_stage_seconds Time of a tick by stage.\n");
        out.push_str("# TYPE lumencast_stage_seconds histogram\n");
        for (stage, h) in Stage::ALL.iter().zip(&c.stages) {
            histogram(&mut out, "lumencast_stage_seconds", &format!("stage=\"{stage}\""), h);
        }
        let scalars = [
            ("ticks_total", "counter", "Ticks.", ticks),
            ("late_ticks_total", "counter", "Ticks that took longer than their period.", c.late),
            ("samples_total", "counter", "Samples taken by probes.", c.samples),
            ("rays_total", "counter", "Path segments traced.", c.rays),
            ("edits_accepted_total", "counter", "Edits applied.", c.accepted),
            ("edits_refused_total", "counter", "Edits refused.", c.refused),
            ("clients", "gauge", "Clients connected.", c.clients),
            ("probes", "gauge", "Probes of all volumes.", c.probes),
            ("buried_probes", "gauge", "Probes inside walls.", c.buried),
            ("samples_per_probe", "gauge", "Samples a probe.", c.samples_a_probe.into()),
            ("scene_version", "gauge", "Version of the scene.", c.scene_version),
        ];
        for (name, kind, help, value) in scalars {
            let _ = writeln!(out, "# HELP lumencast_{name} {help}");
            let _ = writeln!(out, "# TYPE lumencast_{name} {kind}\nlumencast_{name} {value}");
        }
        out.push_str(
            "# HELP lumencast_refusals_total Connections, requests and sessions refused.\n",
        );
        out.push_str("# TYPE lumencast_refusals_total counter\n");
        for (kind, count) in RefusalKind::ALL.iter().zip(c.refusals) {
            let kind = kind.name();
            let _ = writeln!(out, "lumencast_refusals_total{{kind=\"{kind}\"}} {count}");
        }
        out.push_str("# HELP lumencast_track_bytes_total Bytes published by track.\n");
        out.push_str("# TYPE lumencast_track_bytes_total counter\n");
        for (track, bytes) in &c.track_bytes {
            // Track names are ours: letters, digits and slashes, nothing to escape.
            let _ = writeln!(out, "lumencast_track_bytes_total{{track=\"{track}\"}} {bytes}");
        }
        out
    }

    /// Counters are plain numbers: a panic elsewhere leaves nothing half done.
    fn lock(&self) -> MutexGuard<'_, Counted> {
        self.counted.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn histogram(out: &mut String, name: &str, label: &str, h: &Histogram) {
    let comma = if label.is_empty() { "" } else { "," };
    let mut below = 0;
    for (bound, n) in BUCKETS.iter().zip(h.buckets) {
        below += n;
        let _ = writeln!(out, "{name}_bucket{{{label}{comma}le=\"{bound}\"}} {below}");
    }
    let _ = writeln!(out, "{name}_bucket{{{label}{comma}le=\"+Inf\"}} {}", h.count);
    let braces = if label.is_empty() { String::new() } else { format!("{{{label}}}") };
    let _ = writeln!(out, "{name}_sum{braces} {}\n{name}_count{braces} {}", h.sum, h.count);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(gather: f64, late: bool) -> Report {
        let mut report = Report { late, samples: 100, rays: 300, ..Report::default() };
        report.seconds[Stage::Gather as usize] = gather;
        report
    }

    #[test]
    fn text_holds_what_was_counted() {
        let metrics = Metrics::default();
        metrics.record(&report(0.015, false));
        metrics.record(&report(0.5, true));
        metrics.sent("f0/r0/l0", 40);
        metrics.sent("f0/r0/l0", 2);
        let text = metrics.render();
        for line in [
            "lumencast_ticks_total 2",
            "lumencast_late_ticks_total 1",
            "lumencast_rays_total 600",
            "lumencast_tick_seconds_bucket{le=\"0.01\"} 0",
            "lumencast_tick_seconds_bucket{le=\"0.02\"} 1",
            "lumencast_tick_seconds_bucket{le=\"0.25\"} 1",
            "lumencast_tick_seconds_bucket{le=\"+Inf\"} 2",
            "lumencast_tick_seconds_sum 0.515",
            "lumencast_stage_seconds_bucket{stage=\"gather\",le=\"+Inf\"} 2",
            "lumencast_stage_seconds_count{stage=\"encode\"} 2",
            "lumencast_refusals_total{kind=\"origin\"} 0",
            "lumencast_track_bytes_total{track=\"f0/r0/l0\"} 42",
        ] {
            assert!(text.lines().any(|l| l == line), "missing: {line}\n{text}");
        }
    }

    #[test]
    fn every_line_is_a_comment_or_a_sample() {
        let metrics = Metrics::default();
        metrics.sent("state", 1);
        for line in metrics.render().lines().filter(|l| !l.starts_with('#')) {
            let (name, value) = line.rsplit_once(' ').expect("name and value");
            assert!(name.starts_with("lumencast_") && value.parse::<f64>().is_ok(), "{line}");
        }
    }
}
