//! How lumels follow a scene that is live: from cold, and after a lamp has become brighter.

use std::time::{Duration, Instant};

use anyhow::Result;
use lumencast_charts::lumels_on_pages;
use lumencast_codec::Epoch;
use lumencast_gather::Gather;
use lumencast_light::{Layout, Lightmap, luminance};
use lumencast_scene::{Edit, LightSpec, Scene};
use lumencast_server::{Beat, Mail, Received, Tick, TickOptions};
use serde_json::{Value, json};

use super::display::{code, most};
use crate::bench::Nobody;
use crate::output::{self, say};

/// Seconds of each part.
const SECONDS: f64 = 10.0;
/// Seconds at a part's end over which flicker is looked at.
const CALM: f64 = 2.0;
/// A picture is coarse once so much of its light is there.
const COARSE: f64 = 0.5;
/// A server's tick waits for light as long.
const PATIENCE: Duration = Duration::from_millis(200);
/// One lumel of so many is looked at.
const STRIDE: usize = 5;

/// What is to be reached.
pub(super) struct Goals {
    /// The light of the scene as it stands.
    pub(super) before: Lightmap,
    /// The edit, and the light that it makes; nothing where the scene has no lamp.
    pub(super) after: Option<(Edit, Lightmap)>,
    /// What is displayed as white, lux.
    pub(super) white: f32,
}

/// What was seen.
pub(super) struct Live {
    /// Seconds until a coarse picture was there, from cold.
    coarse: Option<f64>,
    /// How near light is after ten seconds, decibels.
    settled: f64,
    /// By how many codes a lumel changes from tick to tick then, in the 99th percentile.
    flicker: f64,
    followed: Option<Followed>,
}

/// How an edit was followed.
struct Followed {
    /// Seconds until half of its light was there, and nearly all.
    half: Option<f64>,
    most: Option<f64>,
    /// How near light is after ten seconds, decibels.
    settled: f64,
}

/// The edit that makes the first lamp of a scene twice as bright.
pub(super) fn brighter(scene: &Scene) -> Option<Edit> {
    let node = scene.nodes().find(|node| node.light.is_some())?;
    let intensity = 2.0 * node.light?.intensity;
    let light = LightSpec { intensity: Some(intensity), ..LightSpec::default() };
    Some(Edit::SetLight { node: node.id, light })
}

/// Casts a scene at the pace of a server. The scene's time stands still.
pub(super) fn measure(
    scene: Scene,
    gatherer: Box<dyn Gather>,
    options: TickOptions,
    goals: &Goals,
) -> Result<Live> {
    let period = options.period;
    let tick = Tick::new(scene, gatherer, options, Epoch(0))?;
    let covered = covered(&goals.before.layout);
    let start = Instant::now();
    let mut cast = Cast { tick, covered, start, beat: Beat::new(period, 0.0), seq: 0 };
    let bar = output::spinner("Casting lumels".to_owned());
    let cold = Lightmap::dark(goals.before.id, goals.before.layout.clone());
    let first = cast.part(Vec::new(), &cold, &goals.before, goals.white);
    let followed = goals.after.as_ref().map(|(edit, after)| {
        let part = cast.part(vec![edit.clone()], &goals.before, after, goals.white);
        Followed { half: part.reached(0.5), most: part.reached(0.95), settled: part.settled }
    });
    bar.finish_and_clear();
    let coarse = first.reached(COARSE);
    Ok(Live { coarse, settled: first.settled, flicker: first.flicker, followed })
}

/// A server without network.
struct Cast {
    tick: Tick,
    /// The lumels that are looked at.
    covered: Vec<usize>,
    start: Instant,
    beat: Beat,
    seq: u64,
}

/// What was seen in a part.
struct Part {
    /// Seconds, and the share of the change that was there.
    shares: Vec<(f64, f64)>,
    settled: f64,
    flicker: f64,
}

impl Cast {
    /// Ten seconds that begin with edits, on the way from one light to another.
    fn part(&mut self, edits: Vec<Edit>, from: &Lightmap, to: &Lightmap, white: f32) -> Part {
        let began = self.start.elapsed().as_secs_f64();
        let mut mail = Mail::default();
        for edit in edits {
            self.seq += 1;
            let client = "bench".into();
            mail.edits.push(Received { client, seq: self.seq, edit, temporary: false });
        }
        let seen = |lightmap: &Lightmap| -> Vec<f32> {
            self.covered.iter().map(|lumel| luminance(lightmap.irradiance[*lumel])).collect()
        };
        let [from, to] = [from, to].map(seen);
        let (mut shares, mut changes, mut last) = (Vec::new(), Vec::new(), from.clone());
        loop {
            let now = self.start.elapsed().as_secs_f64();
            if now - began > SECONDS {
                break;
            }
            self.beat.start(now);
            self.tick.step_within(
                0.0,
                std::mem::take(&mut mail),
                &mut Nobody { watches: true },
                PATIENCE,
            );
            let seconds = self.start.elapsed().as_secs_f64() - began;
            let shown = self.tick.light().lightmaps().next().map_or_else(Vec::new, seen);
            shares.push((seconds, share(&from, &to, &shown)));
            if seconds > SECONDS - CALM {
                let both = last.iter().zip(&shown);
                changes
                    .extend(both.map(|(a, b)| f64::from(code(*a, white) - code(*b, white)).abs()));
            }
            last = shown;
            let wait = self.beat.wait(self.start.elapsed().as_secs_f64());
            std::thread::sleep(Duration::from_secs_f64(wait));
        }
        let flicker = most(changes).unwrap_or(0.0);
        let squares =
            last.iter().zip(&to).map(|(a, b)| f64::from(code(*a, white) - code(*b, white)).powi(2));
        let settled =
            20.0 * 255.0f64.log10() - 10.0 * (squares.sum::<f64>() / to.len() as f64).log10();
        Part { shares, settled, flicker }
    }
}

impl Part {
    /// Seconds from which on so much of the change was there.
    fn reached(&self, share: f64) -> Option<f64> {
        let missing = self.shares.iter().rposition(|(_, reached)| *reached < share);
        self.shares.get(missing.map_or(0, |at| at + 1)).map(|(seconds, _)| *seconds)
    }
}

/// Some of the lumels that surfaces cover.
fn covered(layout: &Layout) -> Vec<usize> {
    let of_surface = |surface| lumels_on_pages(layout, surface).map(|(index, _)| index);
    layout.surfaces().iter().flat_map(of_surface).step_by(STRIDE).collect()
}

/// How far light has come from one to another: 0 to 1, by least squares.
fn share(from: &[f32], to: &[f32], shown: &[f32]) -> f64 {
    let (mut along, mut all) = (0.0, 0.0);
    for ((from, to), shown) in from.iter().zip(to).zip(shown) {
        along += f64::from((shown - from) * (to - from));
        all += f64::from((to - from) * (to - from));
    }
    if all > 0.0 { along / all } else { 1.0 }
}

impl Live {
    pub(super) fn json(&self) -> Value {
        json!({
            "coarse_seconds": self.coarse,
            "db_after_10_s": self.settled,
            "flicker_codes_p99": self.flicker,
            "edit": self.followed.as_ref().map(|followed| json!({
                "half_seconds": followed.half,
                "most_seconds": followed.most,
                "db_after_10_s": followed.settled,
            })),
        })
    }

    pub(super) fn say(&self) {
        let seconds = |seconds: Option<f64>| {
            seconds.map_or("more than 10 s".to_owned(), |seconds| format!("{seconds:.2} s"))
        };
        say!(
            "live: coarse after {}, {:.1} dB beside converged after 10 s, flicker {:.2} codes",
            seconds(self.coarse),
            self.settled,
            self.flicker
        );
        if let Some(followed) = &self.followed {
            say!(
                "a brighter lamp: half after {}, 95 % after {}, {:.1} dB after 10 s",
                seconds(followed.half),
                seconds(followed.most),
                followed.settled
            );
        }
    }
}
