//! One job: many paths a receiver, spread over all cores, summed in a fixed order.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::{DVec2, DVec3, Vec2, Vec3};
use lumencast_light::sh;
use rayon::prelude::*;

use super::aim::{Aim, Reach};
use super::integrator::Integrator;
use super::paths::{Look, Paths, Seen};
use crate::world::World;
use crate::{Job, Sums, SurfacePoint};

/// Samples of one receiver that a thread takes at a time, or of several that have fewer. Sums are
/// grouped by it, so results do not depend on how many threads there are.
const TILE: u32 = 64;

/// How far a job is.
#[derive(Debug, Default)]
pub(super) struct Watch {
    pub(super) samples_done: AtomicU64,
    pub(super) cancelled: AtomicBool,
}

/// Sums over the samples `first..end` of a receiver.
#[derive(Clone, Copy, Debug)]
struct Tile {
    receiver: u32,
    first: u32,
    end: u32,
}

impl Tile {
    fn samples(&self) -> u32 {
        self.end - self.first
    }
}

/// What a tile found.
#[derive(Clone, Debug)]
struct TileSums {
    sum: [Vec3; sh::MAX_COEFFICIENTS],
    squares: [Vec3; sh::MAX_COEFFICIENTS],
    /// Of distances and their squares.
    distances: [Vec2; sh::MAX_COEFFICIENTS],
    surfaces: Vec<Option<SurfacePoint>>,
    backs: u32,
    culled: u32,
}

/// Gathers; `None` when cancelled. Returns the sums and the number of rays.
pub(super) fn gather(job: &Job, world: &World, watch: &Watch) -> Option<(Vec<Sums>, u64)> {
    let tiles = tiles(job);
    let paths =
        Paths { clamp: job.clamp, previous: job.previous.as_deref(), ..Paths::new(job.bounces) };
    let integrator = || Integrator::new(world, paths);
    let found: Option<Vec<(Vec<TileSums>, u64)>> = batches(&tiles)
        .into_par_iter()
        .map_init(integrator, |integrator, batch| {
            if watch.cancelled.load(Ordering::Relaxed) {
                return None;
            }
            let rays_before = integrator.rays;
            let sums = trace(job, batch, integrator);
            let samples: u32 = batch.iter().map(Tile::samples).sum();
            watch.samples_done.fetch_add(u64::from(samples), Ordering::Relaxed);
            Some((sums, integrator.rays - rays_before))
        })
        .collect();
    let found = found?;
    let rays = found.iter().map(|(_, rays)| rays).sum();
    let found = found.iter().flat_map(|(tiles, _)| tiles);
    let mut rest = tiles.iter().zip(found).peekable();
    let mut sums = Vec::with_capacity(job.receivers.len());
    for receiver in 0..job.receivers.len() as u32 {
        let mut of_receiver = Vec::new();
        while let Some((tile, t)) = rest.next_if(|(tile, _)| tile.receiver == receiver) {
            of_receiver.push((tile.samples(), t));
        }
        sums.push(reduce(
            job,
            job.receivers[receiver as usize].place.terms(job.order),
            &of_receiver,
        ));
    }
    Some((sums, rays))
}

fn tiles(job: &Job) -> Vec<Tile> {
    let mut tiles = Vec::new();
    for (receiver, r) in (0..).zip(job.receivers.iter()) {
        for first in (0..r.samples).step_by(TILE as usize) {
            tiles.push(Tile { receiver, first, end: r.samples.min(first.saturating_add(TILE)) });
        }
    }
    tiles
}

/// Tiles that are traced together: as many as have no more samples than a whole one, since rays are
/// the quicker the more of them are under way.
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

fn trace(job: &Job, batch: &[Tile], integrator: &mut Integrator<'_>) -> Vec<TileSums> {
    let world = integrator.world();
    let aims: Vec<Aim> = batch.iter().map(|tile| Aim::new(job, tile.receiver, world)).collect();
    let samples = || {
        let tiles = batch.iter().zip(&aims);
        tiles.flat_map(|(tile, aim)| (tile.first..tile.end).map(move |sample| (aim, sample)))
    };
    let sources = samples().map(|(aim, sample)| aim.reach(sample, world)).collect();
    let mut reached = reach(integrator, sources);
    let mut seen = integrator.radiance(samples().map(|(aim, sample)| aim.look(sample)));
    let sum = |(tile, aim)| sum(job, tile, aim, &mut seen, &mut reached);
    batch.iter().zip(&aims).map(sum).collect()
}

/// The direction and the light of each sample's source, where it has one and nothing hides it.
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

/// Sums up what a tile's samples have seen, which come next.
fn sum(
    job: &Job,
    tile: &Tile,
    aim: &Aim,
    seen: &mut impl Iterator<Item = Seen>,
    reached: &mut impl Iterator<Item = Option<(Vec3, Vec3)>>,
) -> TileSums {
    let count = job.receivers[tile.receiver as usize].place.terms(job.order);
    let mut t = TileSums {
        sum: [Vec3::ZERO; sh::MAX_COEFFICIENTS],
        squares: [Vec3::ZERO; sh::MAX_COEFFICIENTS],
        distances: [Vec2::ZERO; sh::MAX_COEFFICIENTS],
        surfaces: Vec::new(),
        backs: 0,
        culled: 0,
    };
    for ((sample, seen), reached) in (tile.first..tile.end).zip(seen).zip(reached) {
        let radiance = seen.radiance();
        let terms = aim.terms(sample);
        let terms = &terms[..count];
        let source = reached.map(|(direction, light)| (aim.integrand(direction), light));
        for (k, factor) in terms.iter().enumerate() {
            let reached = source.map_or(Vec3::ZERO, |(integrand, light)| integrand[k] * light);
            let term = *factor * radiance + reached;
            t.sum[k] += term;
            t.squares[k] += term * term;
        }
        if let Some(farthest) = job.distances {
            let distance = seen.distance.min(farthest);
            for (sum, factor) in t.distances.iter_mut().zip(terms) {
                *sum += *factor * Vec2::new(distance, distance * distance);
            }
        }
        if job.surfaces {
            let Look { origin, direction, .. } = aim.look(sample);
            t.surfaces.push((seen.normal != Vec3::ZERO).then(|| SurfacePoint {
                position: origin + seen.distance * direction + job.scene.origin,
                normal: seen.normal,
                front: seen.front,
            }));
        }
        t.backs += u32::from(seen.normal != Vec3::ZERO && !seen.front);
        t.culled += u32::from(seen.culled);
    }
    t
}

/// Adds a receiver's tiles up, in order.
fn reduce(job: &Job, terms: usize, tiles: &[(u32, &TileSums)]) -> Sums {
    let add = |of: &dyn Fn(&TileSums) -> Vec3| {
        tiles.iter().map(|(_, t)| of(t).as_dvec3()).sum::<DVec3>().as_vec3()
    };
    let distances = |k: usize| {
        let sum: DVec2 = tiles.iter().map(|(_, t)| t.distances[k].as_dvec2()).sum();
        sum.as_vec2().to_array()
    };
    let count: u32 = tiles.iter().map(|(n, _)| n).sum();
    let share = |of: &dyn Fn(&TileSums) -> u32| {
        tiles.iter().map(|(_, t)| of(t)).sum::<u32>() as f32 / count.max(1) as f32
    };
    Sums {
        sum: (0..terms).map(|k| add(&|t| t.sum[k])).collect(),
        sum_of_squares: (0..terms).map(|k| add(&|t| t.squares[k])).collect(),
        count,
        back_face_fraction: share(&|t| t.backs),
        culled_fraction: share(&|t| t.culled),
        distances: job.distances.map_or_else(Vec::new, |_| (0..terms).map(distances).collect()),
        surfaces: tiles.iter().flat_map(|(_, t)| &t.surfaces).copied().collect(),
    }
}
