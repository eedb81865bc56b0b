//! Measures how fast this machine traces rays and paths.
//!
//! Closest-hit rays are incoherent: each leaves the second surface of a camera path in a diffuse
//! direction. They are shuffled, so neighbours in the list share nothing. Any-hit rays start at the
//! same points and go towards the lights.

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Instant;

use glam::{Affine3A, Vec2, Vec3};
use lumencast_scene::{Instance, Snapshot, View};
use rayon::prelude::*;

use crate::accel::{AccelCache, Hit, Kernel, Ray, Stacks};
use crate::bsdf::frame;
use crate::path_trace::{Levels, MaterialModel, Options, Trees};
use crate::sampling::{Sampler, cosine_hemisphere, mix2};
use crate::world::{Passing, World, WorldCache, itself};

/// Name of the instruction set that rays are traced with on this machine, for display.
#[must_use]
pub fn instructions() -> &'static str {
    match Kernel::detect() {
        Kernel::Portable => "portable code: it has neither AVX2, FMA and POPCNT nor NEON",
        #[cfg(target_arch = "x86_64")]
        Kernel::Avx2(_) => "AVX2",
        #[cfg(target_arch = "aarch64")]
        Kernel::Neon => "NEON",
    }
}

/// Number of rays that a thread takes at a time.
const CHUNK: usize = 1024;

/// Upper limit of rounds. Each round tries as many paths as rays are wanted; in open scenes many
/// leave.
const ROUNDS: usize = 8;

/// A ray for measurements, relative to the snapshot's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestRay {
    /// Metres.
    pub origin: Vec3,
    /// Unit.
    pub direction: Vec3,
    /// Metres; infinite for closest-hit rays.
    pub t_max: f32,
}

/// Where a [`TestRay`] met a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestHit {
    /// Metres.
    pub t: f32,
    /// Index of the triangle in [`RayBench::triangles`].
    pub triangle: u32,
}

fn numbered(rays: &[TestRay]) -> impl Iterator<Item = (Ray, usize)> + '_ {
    let ray = |r: &TestRay| Ray { origin: r.origin, direction: r.direction, t_max: r.t_max };
    rays.iter().enumerate().map(move |(n, r)| (ray(r), n))
}

/// A scene with rays to trace through it. Alpha masks and blending are ignored.
#[derive(Debug)]
pub struct RayBench {
    world: World,
    pool: rayon::ThreadPool,
    /// For each instance, the index of each primitive's first triangle in [`RayBench::triangles`].
    first_triangle: Vec<Vec<u32>>,
    /// Rays for [`RayBench::trace_closest`].
    pub closest: Vec<TestRay>,
    /// Rays for [`RayBench::trace_any`].
    pub any: Vec<TestRay>,
}

impl RayBench {
    /// Builds the acceleration structure and finds about `count` rays of each kind. It finds fewer
    /// where paths leave the scene.
    ///
    /// # Errors
    /// Where the system gives no threads.
    pub fn new(
        scene: &Arc<Snapshot>,
        view: View,
        count: usize,
        options: &Options,
        trees: Trees,
    ) -> std::io::Result<Self> {
        let Options { threads, levels, .. } = *options;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.map_or(0, NonZeroUsize::get))
            .build()
            .map_err(std::io::Error::other)?;
        let world = pool.install(|| world(scene, levels, trees));
        let mut next = 0;
        let mut count_from = |n: usize| {
            next += n as u32;
            next - n as u32
        };
        let first_triangle = scene.instances.iter().map(|instance| {
            let primitives = instance.mesh.primitives.iter();
            primitives.map(|p| count_from(p.triangles.len())).collect()
        });
        let first_triangle = first_triangle.collect();
        let mut bench = Self { world, pool, first_triangle, closest: Vec::new(), any: Vec::new() };
        bench.find_rays(view.relative_to(scene.origin), count);
        Ok(bench)
    }

    fn find_rays(&mut self, view: View, count: usize) {
        let find = |stacks: &mut Stacks, i: usize| self.rays_of_path(view, i as u64, stacks);
        let mut found: Vec<(u64, TestRay, Option<TestRay>)> = Vec::new();
        for round in 0..ROUNDS {
            if found.len() >= count {
                break;
            }
            let attempts = (round * count..(round + 1) * count).into_par_iter();
            found.extend(self.pool.install(|| {
                attempts.map_init(Stacks::default, find).flatten().collect::<Vec<_>>()
            }));
        }
        found.sort_unstable_by_key(|(key, ..)| *key);
        found.truncate(count);
        self.any = found.iter().filter_map(|(_, _, shadow)| *shadow).collect();
        self.closest = found.into_iter().map(|(_, ray, _)| ray).collect();
    }

    /// The bounce ray and the shadow ray that leave a camera path's second surface. The first
    /// number is a key to shuffle by.
    fn rays_of_path(
        &self,
        view: View,
        number: u64,
        stacks: &mut Stacks,
    ) -> Option<(u64, TestRay, Option<TestRay>)> {
        let mut sampler = Sampler::new(77, number as u32, 0);
        let (mut origin, mut direction) = view.ray(sampler.square(), 16.0 / 9.0);
        let mut from = None;
        for _ in 0..2 {
            let ray = Ray { origin, direction, t_max: f32::INFINITY };
            let mut hit = None;
            let passing = |_| Passing { ends: [from, None], key: 0 };
            self.world.closest(std::iter::once((ray, 0)), stacks, passing, |_, found| hit = found);
            let hit = hit?;
            let point = self.world.point(&hit, direction)?.place;
            direction = frame(point.normal) * cosine_hemisphere(sampler.square());
            origin = point.leave(direction);
            from = Some(itself(&hit));
            if point.position.is_nan() {
                return None;
            }
        }
        let ray = TestRay { origin, direction, t_max: f32::INFINITY };
        let shadow = self.towards_light(origin, sampler.number(), sampler.square());
        Some((mix2(5, number), ray, shadow))
    }

    fn towards_light(&self, from: Vec3, choice: f32, u: Vec2) -> Option<TestRay> {
        let Ray { origin, direction, t_max } = self.world.aim(from, choice, u)?;
        Some(TestRay { origin, direction, t_max })
    }

    /// World-space corners of every triangle.
    #[must_use]
    pub fn triangles(&self) -> Vec<[Vec3; 3]> {
        self.world.world_triangles()
    }

    /// The nearest triangle of each of the rays.
    #[must_use]
    pub fn trace_closest(&self, rays: &[TestRay]) -> Vec<Option<TestHit>> {
        let accel = self.world.accel();
        self.trace(rays, None, |rays, stacks, found| {
            accel.closest(
                numbered(rays),
                stacks,
                |_, _| true,
                |n, hit| {
                    let triangle = |hit: Hit| TestHit { t: hit.t, triangle: self.number(&hit) };
                    found[n] = hit.map(triangle);
                },
            );
        })
    }

    /// Whether anything lies on each of the rays.
    #[must_use]
    pub fn trace_any(&self, rays: &[TestRay]) -> Vec<bool> {
        let accel = self.world.accel();
        self.trace(rays, false, |rays, stacks, found| {
            accel.occluded(numbered(rays), stacks, |_, _| true, |n, occluded| found[n] = occluded);
        })
    }

    /// Calls `chunk` for slices of the rays on all threads. Each result is `nothing` until `chunk`
    /// sets it.
    fn trace<T: Send + Sync + Clone>(
        &self,
        rays: &[TestRay],
        nothing: T,
        chunk: impl Fn(&[TestRay], &mut Stacks, &mut [T]) + Sync,
    ) -> Vec<T> {
        let mut found = vec![nothing; rays.len()];
        let chunks = rays.par_chunks(CHUNK).zip(found.par_chunks_mut(CHUNK));
        self.pool.install(|| {
            chunks
                .for_each_init(Stacks::default, |stacks, (rays, found)| chunk(rays, stacks, found));
        });
        found
    }

    fn number(&self, hit: &Hit) -> u32 {
        self.first_triangle[hit.instance as usize][hit.primitive as usize] + hit.triangle
    }

    /// Bytes that the acceleration structures take.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.world.accel().bytes()
    }

    /// Runs a closure in the thread pool that traces the rays.
    pub fn install<T: Send>(&self, run: impl FnOnce() -> T + Send) -> T {
        self.pool.install(run)
    }
}

fn world(scene: &Arc<Snapshot>, levels: Levels, trees: Trees) -> World {
    let mut cache = WorldCache::new(levels).with_trees(trees);
    World::new(scene.clone(), MaterialModel::Lambert, Kernel::detect(), &mut cache)
}

/// Seconds to build all hierarchies of a scene from nothing, on the calling thread's pool.
#[must_use]
pub fn build_seconds(scene: &Arc<Snapshot>, levels: Levels, trees: Trees) -> f64 {
    update_seconds(&mut AccelCache::new(levels).with_trees(trees), scene)
}

/// Peak of additional memory, bytes, while all hierarchies of a scene are built; it includes what
/// is kept. Call it before other work frees memory that the build could reuse. `None` where the
/// system does not tell.
#[must_use]
pub fn build_peak_bytes(scene: &Arc<Snapshot>, levels: Levels) -> Option<u64> {
    // This resets the peak on Linux (man 5 proc_pid_clear_refs).
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    let before = memory("VmRSS:")?;
    update_seconds(&mut AccelCache::new(levels), scene);
    Some(memory("VmHWM:")?.saturating_sub(before))
}

/// Reads one line of this process's status, in bytes.
fn memory(line: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let value = status.lines().find_map(|l| l.strip_prefix(line))?;
    Some(1024 * value.trim().strip_suffix(" kB")?.parse::<u64>().ok()?)
}

/// Seconds to build the top level over `count` instances of a scene's first mesh. The instances
/// overlap a little ([`scattered`]).
#[must_use]
pub fn top_level_seconds(scene: &Snapshot, count: u32) -> f64 {
    let Some(instance) = scene.instances.first() else { return 0.0 };
    let mut cache = AccelCache::default();
    let mut many = Snapshot::clone(scene);
    let place = |world_from_object| Instance { world_from_object, ..instance.clone() };
    many.instances = scattered(scene, count).into_iter().map(place).collect();
    let many = Arc::new(many);
    update_seconds(&mut cache, &many);
    update_seconds(&mut cache, &many)
}

/// Transforms that scatter `count` copies of a scene's first instance in a cube of 100 m.
#[must_use]
pub fn scattered(scene: &Snapshot, count: u32) -> Vec<Affine3A> {
    let Some(instance) = scene.instances.first() else { return Vec::new() };
    let place = |i| {
        let mut sampler = Sampler::new(3, i, 0);
        let at = sampler.square().extend(sampler.number()) * 100.0;
        Affine3A::from_translation(at) * instance.world_from_object
    };
    (0..count).map(place).collect()
}

/// Seconds to update a cache to a scene, without the time to drop the result.
fn update_seconds(cache: &mut AccelCache, scene: &Arc<Snapshot>) -> f64 {
    let start = Instant::now();
    let accel = cache.update(scene, Kernel::detect());
    let seconds = start.elapsed().as_secs_f64();
    drop(accel);
    seconds
}
