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

/// Side in pixels of the tiles that threads take.
const TILE: u32 = 16;
/// Number of samples a pixel that one pass adds to a film. Results depend on it, since sums are
/// grouped by passes.
pub const PASS: u32 = 4;

/// The part of the light that a picture shows. Direct and indirect add up to all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parts {
    /// The light that clients compute themselves: punctual lights scattered once, and emission and
    /// environment where the camera sees them.
    Direct,
    /// The light that fields hold: light of emissive surfaces and the environment, and all light
    /// scattered more than once.
    Indirect,
    /// Both.
    #[default]
    All,
}

/// Settings of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureSettings {
    /// Width and height in pixels, at least 1.
    pub size: UVec2,
    /// Largest number of surface scattering events on a path; 1 is direct light.
    pub bounces: u32,
    /// As in [`crate::Job::clamp`], for light that is scattered twice or more. What a probe sees
    /// scattered once, a camera sees scattered twice.
    pub clamp: f32,
    /// Number of scattering events from which on Russian roulette may end paths; `u32::MAX`
    /// disables it.
    pub roulette_from: u32,
    /// Whether paths may connect to points that a directional light lights. They do so where a
    /// trial shows that it reduces the noise of indirect light.
    pub follow_sun: bool,
    /// The part of the light to show.
    pub parts: Parts,
    /// The material model.
    pub materials: MaterialModel,
    /// The reconstruction filter of pixels.
    pub filter: Filter,
    /// Seed of the noise; different seeds give independent noise.
    pub seed: u64,
    /// Number of threads; `None` for the number of cores. The result does not depend on it.
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

/// Numbers of paths and rays of a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traced {
    /// Number of paths from the camera.
    pub paths: u64,
    /// Number of rays: camera, bounce and shadow rays.
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
    /// The view, relative to the snapshot's origin.
    view: View,
    pub(super) settings: PictureSettings,
    /// Computed when the first paths are followed.
    beam: OnceLock<Option<Beam>>,
    /// Computed when the first pass begins.
    items: OnceLock<Option<ItemBuffer>>,
    pool: rayon::ThreadPool,
}

impl Renderer {
    /// Prepares the scene for tracing.
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

    /// Whether paths connect to points that a directional light lights.
    /// [`PictureSettings::follow_sun`] must allow it, and a trial must have shown that it pays.
    pub fn follows_sun(&self) -> bool {
        self.beam().is_some()
    }

    /// Adds up to [`PASS`] samples a pixel to a film, but none beyond `until` a pixel. Any thread
    /// may call `going` with the share of the pass that is done, 0 to 1. Where `going` returns
    /// false, the pass ends, the film stays unchanged and the result is `None`.
    ///
    /// A film's content after a number of samples depends on the scene and the settings. It depends
    /// neither on threads nor on whether the film was saved and continued.
    pub fn pass(
        &self,
        film: &mut Film,
        until: u32,
        going: &(dyn Fn(f32) -> bool + Sync),
    ) -> Option<Traced> {
        let (half, first) = film.next_half();
        // `until` sets the end of each half, so that the last passes are full too.
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

    /// Sums of radiance for each pixel of one tile, row by row, and the number of rays. `places`
    /// are the samples' indices in each pixel's sequence.
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

    /// Calls `of` for each tile, given by its upper left pixel, on all threads; returns the results
    /// in order.
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

    /// The paths of this picture's settings with these shortcuts.
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

    /// Calls `of` for each batch of camera rays on all threads; returns the results in order.
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

    /// The camera rays of a tile, row by row; `places` are the samples' indices in each pixel's
    /// sequence.
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

    /// Returns a function from a pixel and a sample's index to the camera ray.
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

/// The camera rays of a perspective view; `None` for other views.
fn pyramid(view: &View, size: UVec2) -> Option<Pyramid> {
    let rays = view.rays(size.x as f32 / size.y as f32);
    let half = [rays.right.length(), rays.up.length()];
    let pixel = 2.0 * half[1] / size.y as f32;
    rays.is_perspective.then(|| Pyramid {
        eye: rays.eye,
        axes: [rays.right / half[0], rays.up / half[1], rays.forward],
        // Filters reach beyond the picture's edge.
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

/// Puts tiles of pixels together into rows.
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
