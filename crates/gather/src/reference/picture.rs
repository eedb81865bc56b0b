//! Pictures by path tracing.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use glam::{UVec2, Vec3};
use lumencast_scene::{Snapshot, View};
use rayon::prelude::*;

use super::{Film, Filter};
use crate::accel::{ItemBuffer, Kernel, Pyramid};
use crate::path_trace::beam::Beam;
use crate::path_trace::integrator::Integrator;
use crate::path_trace::paths::{Look, Paths, Seen, Shortcuts};
use crate::path_trace::{Levels, MaterialModel};
use crate::sampling::Sampler;
use crate::world::{World, WorldCache};

/// Pixels along the side of what a thread takes at a time.
const TILE: u32 = 16;
/// Samples a pixel that are added to a film at once. Part of the result: sums are grouped by it.
pub const PASS: u32 = 4;

/// Which light a picture shows. Direct and indirect add up to all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parts {
    /// What clients draw by themselves: light of punctual lights scattered once, emission and
    /// environment where the camera sees them.
    Direct,
    /// What fields hold: light of emissive surfaces and the environment, and all light
    /// scattered more than once.
    Indirect,
    /// Both.
    #[default]
    All,
}

/// What to draw and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureSettings {
    /// Pixels in width and height, at least 1.
    pub size: UVec2,
    /// Surface scattering events on a path: 1 is direct light.
    pub bounces: u32,
    /// As in [`crate::Job::clamp`], of light that is scattered twice or more: what a probe sees scattered
    /// once, a camera sees scattered twice.
    pub clamp: f32,
    /// Scattering events from which on paths may end by chance, in favour of others (Russian
    /// roulette); none do before, and never where it is `u32::MAX`.
    pub roulette_from: u32,
    /// Whether paths may be connected to what a directional light has been followed to, where that
    /// finds indirect light sooner.
    pub follow_sun: bool,
    /// Which light.
    pub parts: Parts,
    /// Which materials to believe.
    pub materials: MaterialModel,
    /// What a pixel sees.
    pub filter: Filter,
    /// Other seeds give other, independent noise.
    pub seed: u64,
    /// Threads; as many as there are cores when absent. The result does not depend on it.
    pub threads: Option<NonZeroUsize>,
}

impl Default for PictureSettings {
    fn default() -> Self {
        Self {
            size: UVec2::new(1280, 720),
            bounces: 4,
            clamp: f32::INFINITY,
            roulette_from: 4,
            follow_sun: true,
            parts: Parts::All,
            materials: MaterialModel::Full,
            filter: Filter::Box,
            seed: 1,
            threads: None,
        }
    }
}

/// What a pass has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traced {
    /// Paths from the camera.
    pub paths: u64,
    /// Rays: camera, bounce and shadow rays.
    pub rays: u64,
}

/// Draws one moment of a scene.
///
/// ```
/// use glam::{UVec2, Vec3};
/// use lumencast_gather::reference::{Film, PictureSettings, Renderer};
/// use lumencast_scene::{Scene, View};
///
/// let scene = Scene::open("cornell")?.snapshot();
/// let view = View::look_at(Vec3::new(0.0, 1.0, 3.0), Vec3::Y, 0.7).expect("two points");
/// let settings = PictureSettings { size: UVec2::new(32, 24), ..PictureSettings::default() };
/// let renderer = Renderer::new(&scene, view, settings)?;
/// let mut film = Film::new(settings.size, 16);
/// while film.samples() < 16 {
///     renderer.pass(&mut film, 16, &|_| true);
/// }
/// assert!(film.picture().iter().all(|radiance| radiance.is_finite()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Renderer {
    pub(super) world: World,
    /// In the world's places, which are relative to the snapshot's origin.
    view: View,
    pub(super) settings: PictureSettings,
    /// Found when the first paths are to be followed.
    beam: OnceLock<Option<Beam>>,
    /// Found when the first pass begins.
    items: OnceLock<Option<ItemBuffer>>,
    pool: rayon::ThreadPool,
}

impl Renderer {
    /// Makes the scene ready for tracing.
    ///
    /// # Errors
    /// Where the system gives no threads.
    pub fn new(
        scene: &Arc<Snapshot>,
        view: View,
        settings: PictureSettings,
    ) -> std::io::Result<Self> {
        let threads = settings.threads.map_or(0, NonZeroUsize::get);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("render {i}"))
            .build()
            .map_err(std::io::Error::other)?;
        let build = || {
            World::new(
                scene.clone(),
                settings.materials,
                Kernel::detect(),
                &mut WorldCache::new(Levels::One),
            )
        };
        let (world, view) = (pool.install(build), view.relative_to(scene.origin));
        Ok(Self { world, view, settings, beam: OnceLock::new(), items: OnceLock::new(), pool })
    }

    /// Whether paths are connected to what a directional light has been followed to: as
    /// [`PictureSettings::follow_sun`] allows, and a trial has shown to be worth it.
    pub fn follows_sun(&self) -> bool {
        self.beam().is_some()
    }

    /// Adds up to [`PASS`] samples a pixel to a film, but none beyond `until` a pixel. `going` is told, from
    /// any thread, the share of the pass that is done, 0 to 1; when it answers no, the pass ends, the
    /// film stays as it was and the result is `None`.
    ///
    /// What a film holds after a number of samples depends on the scene and the settings, not on
    /// threads nor on when it was saved and gone on with.
    pub fn pass(
        &self,
        film: &mut Film,
        until: u32,
        going: &(dyn Fn(f32) -> bool + Sync),
    ) -> Option<Traced> {
        let (half, first) = film.next_half();
        // The end of each half is fixed by `until`, so that the last passes are whole as well.
        let share = if half == 0 { until.div_ceil(2) } else { until / 2 };
        let samples = share.saturating_sub(first).min(PASS);
        let places: Vec<u32> = (first..first + samples).map(|n| film.place(half, n)).collect();
        let tiles = self.tile_count();
        let paths = self.paths(Shortcuts { items: self.items(), ..Shortcuts::default() });
        let (done, stopped, rays) = (AtomicU64::new(0), AtomicBool::new(false), AtomicU64::new(0));
        let found = self.tiles(paths, |integrator, corner| {
            if stopped.load(Ordering::Relaxed) {
                return Vec::new();
            }
            let (sums, traced) = self.tile(corner, &places, integrator);
            rays.fetch_add(traced, Ordering::Relaxed);
            let share = (done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / tiles as f32;
            if !going(share) {
                stopped.store(true, Ordering::Relaxed);
            }
            sums
        });
        if stopped.into_inner() && done.into_inner() < u64::from(tiles) {
            return None;
        }
        let size = self.settings.size;
        film.add(half, &assemble(size, &found), samples);
        let paths = u64::from(size.x) * u64::from(size.y) * u64::from(samples);
        Some(Traced { paths, rays: rays.into_inner() })
    }

    /// Sums over the pixels of one tile, row by row, of the samples at some places of their sequences,
    /// and the rays that it took.
    fn tile(
        &self,
        corner: UVec2,
        places: &[u32],
        integrator: &mut Integrator<'_>,
    ) -> (Vec<Vec3>, u64) {
        let rays_before = integrator.rays;
        let looks = self.looks(corner, places);
        let parts = self.settings.parts;
        let found: Vec<Vec3> = integrator.radiance(looks).map(|seen| part(&seen, parts)).collect();
        let sums = found.chunks_exact(places.len().max(1)).map(|c| c.iter().sum()).collect();
        (sums, integrator.rays - rays_before)
    }

    fn tile_count(&self) -> u32 {
        self.settings.size.x.div_ceil(TILE) * self.settings.size.y.div_ceil(TILE)
    }

    /// What `of` makes of each tile, given its upper left pixel, on all threads.
    pub(super) fn tiles<T: Send>(
        &self,
        paths: Paths<'_>,
        of: impl Fn(&mut Integrator<'_>, UVec2) -> Vec<T> + Sync,
    ) -> Vec<Vec<T>> {
        let across = self.settings.size.x.div_ceil(TILE);
        let shortcuts = Shortcuts { beam: self.beam(), ..paths.shortcuts };
        let paths = Paths { shortcuts, ..paths };
        self.batches(paths, self.tile_count(), |integrator, tile| {
            of(integrator, TILE * UVec2::new(tile % across, tile / across))
        })
    }

    fn beam(&self) -> Option<&Beam> {
        self.beam.get_or_init(|| self.find_beam()).as_ref()
    }

    fn items(&self) -> Option<&ItemBuffer> {
        let find = || {
            let pyramid = pyramid(&self.view, self.settings.size)?;
            self.pool.install(|| self.world.item_buffer(&pyramid))
        };
        self.items.get_or_init(find).as_ref()
    }

    /// The paths to follow, on these shortcuts.
    pub(super) fn paths<'a>(&self, shortcuts: Shortcuts<'a>) -> Paths<'a> {
        let s = &self.settings;
        Paths {
            clamp: s.clamp,
            clamp_from: 2,
            roulette_from: s.roulette_from,
            shortcuts,
            ..Paths::new(s.bounces)
        }
    }

    /// Batches of camera rays on all threads, in order: what `of` makes of each.
    pub(super) fn batches<T: Send>(
        &self,
        paths: Paths<'_>,
        count: u32,
        of: impl Fn(&mut Integrator<'_>, u32) -> T + Sync + Send,
    ) -> Vec<T> {
        let integrator = || Integrator::new(&self.world, paths);
        let batches = (0..count).into_par_iter();
        self.pool.install(|| batches.map_init(integrator, of).collect())
    }

    /// The camera rays of a tile, row by row: for each pixel those at some places of its sequence.
    pub(super) fn looks(&self, corner: UVec2, places: &[u32]) -> impl Iterator<Item = Look> {
        let s = &self.settings;
        let end = (corner + TILE).min(s.size);
        let pixels =
            (corner.y..end.y).flat_map(move |y| (corner.x..end.x).map(move |x| UVec2::new(x, y)));
        let look = self.look(s.seed);
        pixels
            .flat_map(move |pixel| places.iter().map(move |&sample| (pixel, sample)))
            .map(move |(pixel, sample)| look(pixel, sample))
    }

    /// The camera ray of a pixel's sample.
    pub(super) fn look(&self, seed: u64) -> impl Fn(UVec2, u32) -> Look {
        let s = &self.settings;
        let rays = self.view.rays(s.size.x as f32 / s.size.y as f32);
        move |pixel, sample| {
            let mut sampler = Sampler::new(seed, pixel.y * s.size.x + pixel.x, sample);
            let place = pixel.as_vec2() + 0.5 + s.filter.place(sampler.square());
            let (origin, direction) = rays.through(place / s.size.as_vec2());
            Look { origin, direction, pdf: f32::INFINITY, sampler }
        }
    }
}

/// The camera rays of a perspective view.
fn pyramid(view: &View, size: UVec2) -> Option<Pyramid> {
    let rays = view.rays(size.x as f32 / size.y as f32);
    let half = [rays.right.length(), rays.up.length()];
    let pixel = 2.0 * half[1] / size.y as f32;
    rays.is_perspective.then(|| Pyramid {
        eye: rays.eye,
        axes: [rays.right / half[0], rays.up / half[1], rays.forward],
        // Filters reach beyond the picture.
        half: half.map(|half| half + 2.0 * pixel),
        pixel,
    })
}

fn part(seen: &Seen, parts: Parts) -> Vec3 {
    match parts {
        Parts::Direct => seen.direct,
        Parts::Indirect => seen.indirect,
        Parts::All => seen.radiance(),
    }
}

/// Rows of pixels out of tiles.
pub(super) fn assemble<T: Copy>(size: UVec2, tiles: &[Vec<T>]) -> Vec<T> {
    let across = size.x.div_ceil(TILE);
    let mut pixels = Vec::with_capacity(size.x as usize * size.y as usize);
    for y in 0..size.y {
        for tile in 0..across {
            let width = (size.x - tile * TILE).min(TILE) as usize;
            let row = (y % TILE) as usize * width;
            let of_tile = &tiles[(y / TILE * across + tile) as usize];
            pixels.extend_from_slice(&of_tile[row..row + width]);
        }
    }
    pixels
}
