//! One job: many paths a receiver, spread over all cores, summed in a fixed order.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::{DVec2, DVec3, Vec2, Vec3};
use lumencast_light::sh;
use rayon::prelude::*;

use super::aim::Aim;
use super::integrator::{Integrator, Look, Paths};
use crate::world::World;
use crate::{Job, Sums, SurfacePoint};

/// Samples of one receiver that a thread takes at a time. Sums are grouped by it, so results do not
/// depend on how many threads there are.
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

/// What a tile found.
#[derive(Clone, Debug)]
struct TileSums {
    sum: [Vec3; sh::MAX_COEFFICIENTS],
    squares: [Vec3; sh::MAX_COEFFICIENTS],
    /// Of distances and their squares.
    distances: [Vec2; sh::MAX_COEFFICIENTS],
    surfaces: Vec<Option<SurfacePoint>>,
    backs: u32,
    rays: u64,
}

/// Gathers; `None` when cancelled. Returns the sums and the number of rays.
pub(super) fn gather(job: &Job, world: &World, watch: &Watch) -> Option<(Vec<Sums>, u64)> {
    let tiles = tiles(job);
    let paths = Paths {
        bounces: job.bounces,
        clamp: job.clamp,
        roulette_from: u32::MAX,
        previous: job.previous.as_deref(),
    };
    let integrator = || Integrator::new(world, paths);
    let found: Option<Vec<TileSums>> = tiles
        .par_iter()
        .map_init(integrator, |integrator, tile| {
            if watch.cancelled.load(Ordering::Relaxed) {
                return None;
            }
            let sums = trace(job, tile, integrator);
            watch.samples_done.fetch_add(u64::from(tile.end - tile.first), Ordering::Relaxed);
            Some(sums)
        })
        .collect();
    let found = found?;
    let rays = found.iter().map(|t| t.rays).sum();
    let mut rest = tiles.iter().zip(&found).peekable();
    let mut sums = Vec::with_capacity(job.receivers.len());
    for receiver in 0..job.receivers.len() as u32 {
        let mut of_receiver = Vec::new();
        while let Some((tile, t)) = rest.next_if(|(tile, _)| tile.receiver == receiver) {
            of_receiver.push((tile.end - tile.first, t));
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

fn trace(job: &Job, tile: &Tile, integrator: &mut Integrator<'_>) -> TileSums {
    let aim = Aim::new(job, tile.receiver, integrator.extent());
    let count = job.receivers[tile.receiver as usize].place.terms(job.order);
    let rays_before = integrator.rays;
    let mut t = TileSums {
        sum: [Vec3::ZERO; sh::MAX_COEFFICIENTS],
        squares: [Vec3::ZERO; sh::MAX_COEFFICIENTS],
        distances: [Vec2::ZERO; sh::MAX_COEFFICIENTS],
        surfaces: Vec::new(),
        backs: 0,
        rays: 0,
    };
    let samples = tile.first..tile.end;
    let looks = samples.clone().map(|sample| aim.look(sample));
    for (seen, sample) in integrator.radiance(looks).zip(samples) {
        let radiance = seen.radiance();
        let terms = aim.terms(sample);
        let terms = &terms[..count];
        for (k, factor) in terms.iter().enumerate() {
            let term = *factor * radiance;
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
                position: origin + seen.distance * direction,
                normal: seen.normal,
                front: seen.front,
            }));
        }
        t.backs += u32::from(seen.back);
    }
    t.rays = integrator.rays - rays_before;
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
    let backs: u32 = tiles.iter().map(|(_, t)| t.backs).sum();
    Sums {
        sum: (0..terms).map(|k| add(&|t| t.sum[k])).collect(),
        sum_of_squares: (0..terms).map(|k| add(&|t| t.squares[k])).collect(),
        count,
        back_face_fraction: backs as f32 / count.max(1) as f32,
        distances: job.distances.map_or_else(Vec::new, |_| (0..terms).map(distances).collect()),
        surfaces: tiles.iter().flat_map(|(_, t)| &t.surfaces).copied().collect(),
    }
}
