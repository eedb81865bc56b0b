//! Runs a job: many paths for each receiver, spread over all cores and summed in a fixed order.

use std::sync::atomic::Ordering;

use glam::{DVec2, DVec3, Vec2, Vec3};
use lumencast_light::sh;
use rayon::prelude::*;

use super::aim::{Aim, Reach};
use super::integrator::Integrator;
use super::paths::{Look, Paths, Seen};
use crate::queue::Watch;
use crate::sampling::luminance;
use crate::world::World;
use crate::{Job, Sums, SumsAt, SurfacePoint};

/// Number of samples that a thread takes at a time, of one receiver or of several with fewer
/// samples. Sums are grouped by it, so results do not depend on the number of threads.
const TILE: u32 = 64;

/// The samples `first..end` of a receiver.
#[derive(Clone, Copy, Debug)]
struct Tile {
    /// Index into [`Job::budgets`].
    entry: u32,
    first: u32,
    end: u32,
}

impl Tile {
    fn samples(&self) -> u32 {
        self.end - self.first
    }
}

/// Sums of the tiles of a batch, in columns.
#[derive(Debug, Default)]
struct BatchSums {
    sum: Vec<Vec3>,
    squares: Vec<f32>,
    /// Sums of distances and of their squares; empty unless the job asks for them.
    distances: Vec<Vec2>,
    /// Empty unless the job asks for them.
    surfaces: Vec<Option<SurfacePoint>>,
    /// For each tile, the number of samples that first met a back, and the number that first met
    /// the back of a single-sided material.
    backs: Vec<[u32; 2]>,
    rays: u64,
}

/// Gathers a job's light. Returns the sums and the number of rays; `None` when cancelled.
pub(super) fn gather(job: &Job, world: &World, watch: &Watch) -> Option<(Sums, u64)> {
    let tiles = tiles(job);
    let paths =
        Paths { clamp: job.clamp, previous: job.previous.as_deref(), ..Paths::new(job.bounces) };
    let batches = batches(&tiles);
    let found: Option<Vec<BatchSums>> = batches
        .par_iter()
        .map_init(
            || Integrator::new(world, paths),
            |integrator, batch| {
                if watch.cancelled.load(Ordering::Relaxed) {
                    return None;
                }
                let rays_before = integrator.rays;
                let mut sums = trace(job, batch, integrator);
                sums.rays = integrator.rays - rays_before;
                let samples: u32 = batch.iter().map(Tile::samples).sum();
                watch.samples_done.fetch_add(u64::from(samples), Ordering::Relaxed);
                Some(sums)
            },
        )
        .collect();
    let found = found?;
    let rays = found.iter().map(|batch| batch.rays).sum();
    Some((reduce(job, &batches, &found), rays))
}

fn tiles(job: &Job) -> Vec<Tile> {
    let mut tiles = Vec::new();
    for (entry, budget) in (0..).zip(&job.budgets) {
        for first in (0..budget.samples).step_by(TILE as usize) {
            tiles.push(Tile { entry, first, end: budget.samples.min(first.saturating_add(TILE)) });
        }
    }
    tiles
}

/// Groups tiles to be traced together, up to the samples of a whole tile. Rays are faster when more
/// are traced together.
fn batches(tiles: &[Tile]) -> Vec<&[Tile]> {
    let mut batches = Vec::new();
    let (mut first, mut samples) = (0, 0);
    for (next, tile) in tiles.iter().enumerate() {
        if samples + tile.samples() > TILE && next > first {
            batches.push(&tiles[first..next]);
            (first, samples) = (next, 0);
        }
        samples += tile.samples();
    }
    if first < tiles.len() {
        batches.push(&tiles[first..]);
    }
    batches
}

fn trace(job: &Job, batch: &[Tile], integrator: &mut Integrator<'_>) -> BatchSums {
    let world = integrator.world();
    let aims: Vec<Aim> =
        batch.iter().map(|tile| Aim::new(job, job.budgets[tile.entry as usize], world)).collect();
    let samples = || {
        let tiles = batch.iter().zip(&aims);
        tiles.flat_map(|(tile, aim)| (tile.first..tile.end).map(move |sample| (aim, sample)))
    };
    let sources = samples().map(|(aim, sample)| aim.reach(sample, world)).collect();
    let mut reached = reach(integrator, sources);
    let mut seen = integrator.radiance(samples().map(|(aim, sample)| aim.look(sample)));
    let mut sums = BatchSums::default();
    for (tile, aim) in batch.iter().zip(&aims) {
        sums.add(job, tile, aim, &mut seen, &mut reached);
    }
    sums
}

/// Direction and light of each sample's source, where it has one and nothing occludes it.
fn reach(
    integrator: &mut Integrator<'_>,
    sources: Vec<Option<Reach>>,
) -> impl Iterator<Item = Option<(Vec3, Vec3)>> + use<> {
    let rays: Vec<_> =
        sources.iter().flatten().map(|source| (source.ray, source.passing)).collect();
    let mut arrives = integrator.arrive(&rays).into_iter();
    sources.into_iter().map(move |source| {
        let source = source.filter(|_| arrives.next() == Some(true))?;
        Some((source.ray.direction, source.light))
    })
}

impl BatchSums {
    /// Adds up the next samples as one tile.
    fn add(
        &mut self,
        job: &Job,
        tile: &Tile,
        aim: &Aim,
        seen: &mut impl Iterator<Item = Seen>,
        reached: &mut impl Iterator<Item = Option<(Vec3, Vec3)>>,
    ) {
        let count = terms(job, tile.entry);
        let mut sum = [Vec3::ZERO; sh::MAX_COEFFICIENTS];
        let mut squares = [0.0; sh::MAX_COEFFICIENTS];
        let mut distances = [Vec2::ZERO; sh::MAX_COEFFICIENTS];
        let (mut dark_backs, mut culled) = (0, 0);
        for ((sample, seen), reached) in (tile.first..tile.end).zip(seen).zip(reached) {
            let radiance = seen.radiance();
            let terms = aim.terms(sample);
            let terms = &terms[..count];
            let source = reached.map(|(direction, light)| (aim.integrand(direction), light));
            for (k, factor) in terms.iter().enumerate() {
                let reached = source.map_or(Vec3::ZERO, |(integrand, light)| integrand[k] * light);
                let term = *factor * radiance + reached;
                sum[k] += term;
                squares[k] += luminance(term).powi(2);
            }
            if let Some(farthest) = job.distances {
                let distance = seen.distance.min(farthest);
                for (sum, factor) in distances.iter_mut().zip(terms) {
                    *sum += *factor * Vec2::new(distance, distance * distance);
                }
            }
            if job.surfaces {
                let Look { origin, direction, .. } = aim.look(sample);
                self.surfaces.push((seen.normal != Vec3::ZERO).then(|| SurfacePoint {
                    position: origin + seen.distance * direction + job.scene.origin,
                    normal: seen.normal,
                    front: seen.front,
                }));
            }
            let is_back = seen.normal != Vec3::ZERO && !seen.front;
            dark_backs += u32::from(is_back && (seen.shines || !seen.lit));
            culled += u32::from(seen.culled);
        }
        self.sum.extend_from_slice(&sum[..count]);
        self.squares.extend_from_slice(&squares[..count]);
        if job.distances.is_some() {
            self.distances.extend_from_slice(&distances[..count]);
        }
        self.backs.push([dark_backs, culled]);
    }
}

/// Number of terms of an entry's receiver.
fn terms(job: &Job, entry: u32) -> usize {
    job.receivers[job.budgets[entry as usize].receiver as usize].terms(job.order)
}

/// Running totals of an entry.
#[derive(Default)]
struct Total {
    sum: [DVec3; sh::MAX_COEFFICIENTS],
    squares: [f64; sh::MAX_COEFFICIENTS],
    distances: [DVec2; sh::MAX_COEFFICIENTS],
    surfaces: Vec<Option<SurfacePoint>>,
    count: u32,
    backs: [u32; 2],
}

impl Total {
    /// Moves the totals into `sums` as an entry of `terms` terms.
    fn finish(&mut self, job: &Job, terms: usize, sums: &mut Sums) {
        let mut sum = [Vec3::ZERO; sh::MAX_COEFFICIENTS];
        let mut squares = [0.0; sh::MAX_COEFFICIENTS];
        let mut distances = [[0.0; 2]; sh::MAX_COEFFICIENTS];
        for k in 0..terms {
            sum[k] = std::mem::take(&mut self.sum[k]).as_vec3();
            squares[k] = std::mem::take(&mut self.squares[k]) as f32;
            distances[k] = std::mem::take(&mut self.distances[k]).as_vec2().to_array();
        }
        let share = |n: u32| n as f32 / self.count.max(1) as f32;
        let asked = if job.distances.is_some() { terms } else { 0 };
        sums.push(SumsAt {
            sum: &sum[..terms],
            squares: &squares[..terms],
            count: self.count,
            dark_back_fraction: share(self.backs[0]),
            culled_fraction: share(self.backs[1]),
            distances: &distances[..asked],
            surfaces: &self.surfaces,
        });
        self.surfaces.clear();
        (self.count, self.backs) = (0, [0; 2]);
    }
}

/// Adds up each entry's tiles, in order.
fn reduce(job: &Job, batches: &[&[Tile]], found: &[BatchSums]) -> Sums {
    let (mut sums, mut total, mut entry) = (Sums::default(), Total::default(), 0);
    for (batch, of_batch) in batches.iter().zip(found) {
        let (mut term, mut surface) = (0, 0);
        for (tile, backs) in batch.iter().zip(&of_batch.backs) {
            while entry < tile.entry {
                total.finish(job, terms(job, entry), &mut sums);
                entry += 1;
            }
            let next = term + terms(job, entry);
            for (k, own) in (term..next).enumerate() {
                total.sum[k] += of_batch.sum[own].as_dvec3();
                total.squares[k] += f64::from(of_batch.squares[own]);
                if job.distances.is_some() {
                    total.distances[k] += of_batch.distances[own].as_dvec2();
                }
            }
            term = next;
            if job.surfaces {
                let end = surface + tile.samples() as usize;
                total.surfaces.extend_from_slice(&of_batch.surfaces[surface..end]);
                surface = end;
            }
            total.count += tile.samples();
            total.backs = [0, 1].map(|k| total.backs[k] + backs[k]);
        }
    }
    while (entry as usize) < job.budgets.len() {
        total.finish(job, terms(job, entry), &mut sums);
        entry += 1;
    }
    sums
}
