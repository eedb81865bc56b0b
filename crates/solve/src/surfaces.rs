//! The surfaces about a volume, to which its probes are fitted.

use std::ops::Range;
use std::sync::Arc;

use glam::{IVec3, Vec3};
use lumencast_gather::{Budget, Draws, Job, Receiver, Sums, SumsAt, SurfacePoint};
use lumencast_light::{Grid, Place};
use lumencast_scene::Snapshot;

use crate::blend::{BlendSettings, History};
use crate::fit::Surroundings;
use crate::options::FitOptions;

/// What a point's light is known from begins anew when the point has moved by more than this share of
/// a cell, or its normal turned by more than the angle of this cosine.
const MOVED: f32 = 0.1;
const TURNED: f32 = 0.95;
/// The directions in which surfaces are looked for are always the same, so that points stay where
/// nothing moves.
const SEED: u64 = 0x5f17;
/// Points of a volume, at most; where it has many probes, each has the fewer. They cost a kilobyte
/// each.
const MOST_POINTS: usize = 1 << 20;
/// Samples that a point takes at a time, at least: with fewer for all of them, points take turns.
const SAMPLES_A_TURN: u32 = 4;

/// Points of surfaces, with what is known of the light there.
#[derive(Clone)]
pub(crate) struct Surfaces {
    /// Where they are looked for from: the volume's probes, and places about it.
    lookouts: Arc<[Receiver]>,
    /// How many of them are probes.
    probes: usize,
    points_a_lookout: u32,
    around: Surroundings,
    /// Where the points were when their histories began.
    began: Vec<Option<SurfacePoint>>,
    history: History,
    /// [`Snapshot::version`] of the scene that was looked at.
    seen: Option<u64>,
    /// Number of the next turn.
    turn: usize,
}

impl Surfaces {
    pub(crate) fn new(options: FitOptions, blend: BlendSettings, grid: &Grid) -> Self {
        let lookouts: Arc<[Receiver]> =
            grid.positions().chain(about(grid)).map(Receiver::probe).collect();
        let each = (options.points as usize).min(MOST_POINTS / lookouts.len().max(1)).max(1);
        let points = lookouts.len() * each;
        Self {
            lookouts,
            probes: grid.probe_count(),
            points_a_lookout: each as u32,
            around: Surroundings::default(),
            began: vec![None; points],
            history: History::new(blend, points, 1),
            seen: None,
            turn: 0,
        }
    }

    /// What to ask for to find the surfaces of a scene; `None` while it is the one that was seen.
    pub(crate) fn look(&self, scene: &Arc<Snapshot>) -> Option<Job> {
        (self.seen != Some(scene.version)).then(|| Job {
            bounces: 0,
            surfaces: true,
            seed: SEED,
            ..Job::new(scene.clone(), self.lookouts.clone(), self.points_a_lookout)
        })
    }

    /// Takes in what a look has found. `cell` is the shortest side of a cell, metres.
    pub(crate) fn found(&mut self, sums: &Sums, scene_version: u64, cell: f32) {
        self.around = Surroundings::new(sums);
        self.seen = Some(scene_version);
        for (number, now) in self.around.points().iter().enumerate() {
            let same = match (self.began[number], now) {
                (Some(was), Some(now)) => {
                    was.position.distance(now.position) <= MOVED * cell
                        && was.normal.dot(now.normal) >= TURNED
                }
                (was, now) => was.is_none() && now.is_none(),
            };
            if !same {
                self.began[number] = *now;
                self.history.forget(number);
            }
        }
    }

    /// All points as receivers of light.
    pub(crate) fn receivers(&self) -> impl Iterator<Item = Receiver> + '_ {
        self.around.receivers()
    }

    /// At which points to gather next, `samples` a probe in all: at all that count, or at those whose
    /// turn it is.
    pub(crate) fn budgets(&mut self, samples: u32) -> impl Iterator<Item = Budget> + '_ {
        let points = self.points_a_lookout;
        let turns = (SAMPLES_A_TURN * points).div_ceil(samples.max(1)).max(1);
        let each = (samples * turns).div_ceil(points);
        let turn = self.turn % turns as usize;
        self.turn += 1;
        let around = &self.around;
        (turn..around.points().len())
            .step_by(turns as usize)
            .filter(|point| around.counts(*point))
            .map(move |point| Budget { receiver: point as u32, samples: each, draws: Draws::Own })
    }

    /// The scene was edited: light may be another from now on.
    pub(crate) fn expect_change(&mut self) {
        self.history.expect_change();
    }

    /// Blends in what arrived at the points with these numbers.
    pub(crate) fn blend<'a>(&mut self, entries: impl IntoIterator<Item = (usize, SumsAt<'a>)>) {
        self.history.update_at(entries);
    }

    /// What the probes see.
    pub(crate) fn around(&self) -> &Surroundings {
        &self.around
    }

    /// The points that count, with their normals: those that probes see, where there are any, and else
    /// those that are seen from about the volume. The outsides of a closed room, as dark as they may be,
    /// are nobody's business.
    pub(crate) fn places(&self) -> Vec<Place> {
        let counting = |points: Range<usize>| -> Vec<Place> {
            let points = points.filter(|number| self.around.counts(*number));
            let places = points.filter_map(|number| self.around.points()[number]);
            places.map(|at| Place::on_surface(at.position, at.normal)).collect()
        };
        let all = self.around.points().len();
        let own = (self.probes * self.points_a_lookout as usize).min(all);
        let seen = counting(0..own);
        if seen.is_empty() { counting(own..all) } else { seen }
    }

    /// The irradiance at each point, lux; nothing where none was gathered.
    pub(crate) fn irradiance(&self) -> Vec<Option<Vec3>> {
        let known = |point| self.history.effective_samples(point) > 0.0;
        let irradiance = |point| known(point).then(|| self.history.coefficients(point)[0]);
        (0..self.history.len()).map(irradiance).collect()
    }
}

/// Places half a cell in front of a volume's outer faces, one for each of the cells there: what stands
/// on its border is not seen from within.
fn about(grid: &Grid) -> impl Iterator<Item = Vec3> {
    let cells = grid.resolution.as_ivec3();
    let beyond = (0..3).flat_map(move |axis| {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let faces = [-1, cells[axis]].into_iter();
        faces.flat_map(move |depth| {
            (0..cells[u] * cells[v]).map(move |i| {
                let mut cell = IVec3::ZERO;
                (cell[axis], cell[u], cell[v]) = (depth, i % cells[u], i / cells[u]);
                cell
            })
        })
    });
    beyond.map(|cell| grid.world_from_cell(cell.as_vec3()))
}
