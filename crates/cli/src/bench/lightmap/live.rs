//! How lumels follow a scene that is live: from cold, and after a light has moved.

use anyhow::Result;
use lumencast_charts::lumels_on_pages;
use lumencast_gather::Gather;
use lumencast_light::{Layout, Light, Lightmap, luminance};
use lumencast_scene::{Edit, Scene};
use lumencast_server::TickOptions;
use serde_json::{Value, json};

use super::display::{code, most};
use crate::bench::cast::Cast;
use crate::output::{self, say};

/// Seconds of each part.
const SECONDS: f64 = 10.0;
/// Seconds at a part's end over which flicker is looked at.
const CALM: f64 = 2.0;
/// A picture is coarse once so much of its light is there.
const COARSE: f64 = 0.5;
/// All lumels are refreshed but for those in which no light arrives, or the same.
const NEARLY_ALL: f64 = 0.99;
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
    /// Seconds until nearly all lumels had other light than at the edit.
    refreshed: Option<f64>,
    /// How near light is after ten seconds, decibels.
    settled: f64,
}

/// Casts a scene at the pace of a server. The scene's time stands still.
pub(super) fn measure(
    scene: Scene,
    gatherer: Box<dyn Gather>,
    options: TickOptions,
    goals: &Goals,
) -> Result<Live> {
    let bar = output::spinner("Casting lumels".to_owned());
    let mut cast = Cast::new(scene, gatherer, options)?;
    let cold = Lightmap::dark(goals.before.id, goals.before.layout.clone());
    let first = Part::of(&mut cast, &[], [&cold, &goals.before], goals.white);
    let followed = goals.after.as_ref().map(|(edit, after)| {
        let edits = std::slice::from_ref(edit);
        let part = Part::of(&mut cast, edits, [&goals.before, after], goals.white);
        Followed {
            half: part.reached(0.5),
            most: part.reached(0.95),
            refreshed: part.refreshed,
            settled: part.settled,
        }
    });
    bar.finish_and_clear();
    let coarse = first.reached(COARSE);
    Ok(Live { coarse, settled: first.settled, flicker: first.flicker, followed })
}

/// What was seen in a part.
struct Part {
    /// Seconds, and the share of the change that was there.
    shares: Vec<(f64, f64)>,
    refreshed: Option<f64>,
    settled: f64,
    flicker: f64,
}

impl Part {
    /// Ten seconds that begin with edits, on the way from one light to another.
    fn of(cast: &mut Cast, edits: &[Edit], [from, to]: [&Lightmap; 2], white: f32) -> Self {
        let covered = covered(&to.layout);
        let seen = |lightmap: &Lightmap| -> Vec<f32> {
            covered.iter().map(|lumel| luminance(lightmap.irradiance[*lumel])).collect()
        };
        let [from, to] = [from, to].map(seen);
        let (mut shares, mut changes) = (Vec::new(), Vec::new());
        let shown = cast.tick.light().lightmaps().next().map_or_else(|| from.clone(), seen);
        let (mut last, mut refresh) = (shown.clone(), Refresh::of(shown));
        cast.go_on(edits, SECONDS, |light: &Light, seconds| {
            let shown = light.lightmaps().next().map_or_else(Vec::new, seen);
            shares.push((seconds, share(&from, &to, &shown)));
            refresh.look(&shown, seconds);
            if seconds > SECONDS - CALM {
                let both = last.iter().zip(&shown);
                changes
                    .extend(both.map(|(a, b)| f64::from(code(*a, white) - code(*b, white)).abs()));
            }
            last = shown;
        });
        let flicker = most(changes).unwrap_or(0.0);
        let squares =
            last.iter().zip(&to).map(|(a, b)| f64::from(code(*a, white) - code(*b, white)).powi(2));
        let settled =
            20.0 * 255.0f64.log10() - 10.0 * (squares.sum::<f64>() / to.len() as f64).log10();
        Self { shares, refreshed: refresh.done, settled, flicker }
    }

    /// Seconds from which on so much of the change was there.
    fn reached(&self, share: f64) -> Option<f64> {
        let missing = self.shares.iter().rposition(|(_, reached)| *reached < share);
        self.shares.get(missing.map_or(0, |at| at + 1)).map(|(seconds, _)| *seconds)
    }
}

/// Which lumels still show the light that they had first.
struct Refresh {
    first: Vec<f32>,
    stale: Vec<usize>,
    done: Option<f64>,
}

impl Refresh {
    fn of(first: Vec<f32>) -> Self {
        Self { stale: (0..first.len()).collect(), first, done: None }
    }

    /// What lumels show at a time, seconds.
    fn look(&mut self, shown: &[f32], seconds: f64) {
        let Self { first, stale, done } = self;
        stale.retain(|lumel| shown.get(*lumel) == Some(&first[*lumel]));
        if (stale.len() as f64) < (1.0 - NEARLY_ALL) * first.len() as f64 {
            done.get_or_insert(seconds);
        }
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
                "refresh_seconds": followed.refreshed,
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
                "a moved light: half after {}, 95 % after {}, all refreshed after {}, {:.1} dB after 10 s",
                seconds(followed.half),
                seconds(followed.most),
                seconds(followed.refreshed),
                followed.settled
            );
        }
    }
}
