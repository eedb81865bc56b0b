//! The path integrator: light that arrives at a point from a direction.
//!
//! Paths are unidirectional, with next-event estimation at every vertex. Multiple importance
//! sampling (Veach 1997) weighs sources that BSDF rays can also meet. Russian roulette serves
//! pictures with many bounces. Paths of probes do without it, so that every sample counts alike.
//! [`super::group`] shades the vertices.

use glam::Vec3;

use super::beam::{Found, Lit};
use super::group::{Group, Shader};
use super::paths::{Connection, Look, Path, Paths, Seen, Segment, Start};
use crate::accel::{Hit, Ray, Stacks};
use crate::world::{Passing, World};

/// Follows many paths through a world together. For each scattering event it traces all rays,
/// shades all hits and then traces all shadow rays. A path's result does not depend on the others.
///
/// Paths followed one by one take 1.25 times as long on Sponza. Half of shading is waiting for
/// vertices and texels, which this order allows to prefetch.
pub(crate) struct Integrator<'a> {
    world: &'a World,
    limits: Paths<'a>,
    stacks: Stacks,
    /// Number of rays traced so far.
    pub(crate) rays: u64,
    paths: Vec<Path>,
    /// Hits of the paths' current segments.
    hits: Vec<Option<Hit>>,
    /// Indices of the paths that go on.
    alive: Vec<u32>,
    group: Group<'a>,
    connections: Vec<Connection>,
    /// Whether each connection is occluded.
    occluded: Vec<bool>,
    /// A point that the beam lights for each path; empty without a beam.
    lit: Vec<Option<Lit>>,
    /// Connections to the light to learn of, with their origins.
    noted: Vec<(u32, Found)>,
    /// Unoccluded ones of them, since the list was last taken.
    pub(crate) found: Vec<Found>,
}

impl<'a> Integrator<'a> {
    pub(crate) fn new(world: &'a World, limits: Paths<'a>) -> Self {
        Self {
            world,
            limits,
            stacks: Stacks::default(),
            rays: 0,
            paths: Vec::new(),
            hits: Vec::new(),
            alive: Vec::new(),
            group: Group::default(),
            connections: Vec::new(),
            occluded: Vec::new(),
            lit: Vec::new(),
            noted: Vec::new(),
            found: Vec::new(),
        }
    }

    /// Computes the light that arrives at each origin from its direction, scattered at most
    /// `bounces` times. Results are in order. Punctual lights are seen only through the surfaces
    /// that they light.
    pub(crate) fn radiance(
        &mut self,
        looks: impl IntoIterator<Item = Look>,
    ) -> impl ExactSizeIterator<Item = Seen> + '_ {
        self.begin(looks);
        self.follow_beam();
        for depth in 0.. {
            self.find_surfaces(depth);
            self.shade(depth);
            self.connect();
            if self.alive.is_empty() {
                break;
            }
        }
        self.paths.iter().map(|path| path.seen)
    }

    fn begin(&mut self, looks: impl IntoIterator<Item = Look>) {
        self.paths.clear();
        self.paths.extend(looks.into_iter().map(|look| Path {
            key: look.sampler.key(),
            sampler: look.sampler,
            segment: Segment {
                ray: Ray { origin: look.origin, direction: look.direction, t_max: f32::INFINITY },
                from: None,
                pdf: look.pdf,
                start: Start::OF_PATH,
            },
            throughput: Vec3::ONE,
            seen: Seen::NOTHING,
        }));
        self.hits.resize(self.paths.len(), None);
        self.alive.clear();
        self.alive.extend(0..self.paths.len() as u32);
    }

    /// Whether each of these rays is unoccluded.
    pub(crate) fn arrive(&mut self, rays: &[(Ray, Passing)]) -> Vec<bool> {
        self.rays += rays.len() as u64;
        let mut free = vec![true; rays.len()];
        let each = rays.iter().zip(0..).map(|((ray, _), n)| (*ray, n));
        let passing = |n: u32| rays[n as usize].1;
        self.world.occluded(each, &mut self.stacks, passing, |n, found| free[n as usize] = !found);
        free
    }

    /// The world that paths go through.
    pub(crate) fn world(&self) -> &'a World {
        self.world
    }

    /// Gives each path a point that the beam lights.
    fn follow_beam(&mut self) {
        let Self { world, limits, paths, hits, lit, stacks, .. } = self;
        let Some(beam) = limits.shortcuts.beam else { return };
        self.rays += paths.len() as u64;
        let sources: Vec<_> = paths.iter().map(|path| beam.ray(path.sampler.aside())).collect();
        let rays = sources.iter().zip(0..).map(|((ray, _), n)| (*ray, n));
        let passing = |n: u32| Passing { ends: [None; 2], key: paths[n as usize].key(u32::MAX) };
        world.closest(rays, stacks, passing, |n, hit| {
            hit.iter().for_each(|hit| world.fetch_triangle(hit));
            hits[n as usize] = hit;
        });
        lit.clear();
        let met = hits.iter().zip(sources);
        lit.extend(met.map(|(hit, (_, source))| beam.lit(world, hit.as_ref()?, source)));
    }

    /// Traces the current rays of all paths.
    fn find_surfaces(&mut self, depth: u32) {
        let Self { world, limits, alive, paths, hits, stacks, .. } = self;
        self.rays += alive.len() as u64;
        let rays = alive.iter().map(|&index| (paths[index as usize].segment.ray, index));
        let passing = |index: u32| {
            let path = &paths[index as usize];
            Passing { ends: [path.segment.from, None], key: path.key(depth) }
        };
        let found = |index: u32, hit: Option<Hit>| {
            hit.iter().for_each(|hit| world.fetch_triangle(hit));
            hits[index as usize] = hit;
        };
        match limits.shortcuts.items.filter(|_| depth == 0) {
            Some(items) => world.closest_seen(items, rays, stacks, passing, found),
            None => world.closest(rays, stacks, passing, found),
        }
    }

    /// Traces the shadow rays and adds the light of unoccluded ones.
    fn connect(&mut self) {
        let Self { world, connections, occluded, paths, stacks, noted, found, .. } = self;
        self.rays += connections.len() as u64;
        occluded.resize(connections.len(), false);
        let rays = connections.iter().zip(0..).map(|(c, n)| (c.ray, n));
        let passing = |n: u32| connections[n as usize].passing;
        world.occluded(rays, stacks, passing, |n, found| occluded[n as usize] = found);
        found.extend(noted.drain(..).filter(|(n, _)| !occluded[*n as usize]).map(|(_, f)| f));
        // Light is added in order, so that sums do not depend on which ray was done first.
        for (c, occluded) in connections.drain(..).zip(occluded) {
            if !*occluded {
                paths[c.path as usize].seen.add(c.part, c.light);
            }
        }
    }

    /// Shades the hits of all paths and chooses their next rays.
    fn shade(&mut self, depth: u32) {
        self.world.kernel().run(
            #[inline(always)]
            || self.shade_with(depth),
        );
    }

    #[inline(always)]
    fn shade_with(&mut self, depth: u32) {
        let Self { world, limits, paths, hits, alive, connections, group, lit, noted, .. } = self;
        let mut shader = Shader { world, limits, depth, paths, lit, connections, noted, group };
        let mut kept = 0;
        for at in 0..alive.len() {
            let index = alive[at];
            shader.arrive(index, hits[index as usize]);
            if shader.is_ready() || at + 1 == alive.len() {
                shader.shade(|index| {
                    alive[kept] = index;
                    kept += 1;
                });
            }
        }
        alive.truncate(kept);
    }
}

impl Path {
    /// The first of four keys of a segment, for decisions about partly transparent surfaces.
    pub(super) fn key(&self, depth: u32) -> u64 {
        self.key.wrapping_add(u64::from(depth) * 4)
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use lumencast_scene::{LightKind, Material, PunctualLight};
    use lumencast_testkit::scenes::{Stage, lambert};

    use super::super::beam::Beam;
    use super::super::paths::Shortcuts;
    use super::*;
    use crate::accel::Kernel;
    use crate::sampling::{Sampler, sphere};
    use crate::surface::MaterialModel;
    use crate::world::WorldCache;

    /// A room of several materials with `lights` lights, every other one with a size.
    fn room(lights: u32) -> Stage {
        let mut stage = Stage::default();
        let grey = Material { roughness: 0.8, ..lambert(Vec3::splat(0.6), Vec3::ZERO) };
        let glass = Material { transmission: 0.8, roughness: 0.2, specular: 1.0, ..grey.clone() };
        let metal = Material { metallic: 1.0, roughness: 0.3, ..grey.clone() };
        let lamp = Material { emissive: Vec3::new(3.0, 2.0, 1.0), ..grey.clone() };
        let [grey, glass, metal, lamp] = [grey, glass, metal, lamp].map(|m| stage.material(m));
        stage.room(Vec3::ZERO, Vec3::splat(4.0), grey);
        for (n, material) in (0..).zip([grey, glass, metal, lamp]) {
            stage.sphere(Vec3::new(n as f32 - 1.5, -1.0, -0.5), 0.45, 8, material);
        }
        for n in 0..lights {
            let radius = if n % 2 == 0 { 0.0 } else { 0.1 };
            let kind = match n % 3 {
                0 => LightKind::Point { radius },
                1 => LightKind::Spot { inner: 0.3, outer: 1.2, radius },
                _ => LightKind::Directional { angle: radius },
            };
            let light = PunctualLight { kind, color: Vec3::ONE, intensity: 2.0, range: Some(9.0) };
            stage.light(light, sphere(Sampler::new(6, 0, n).square()), Vec3::NEG_Y);
        }
        stage
    }

    fn looks() -> impl Iterator<Item = Look> {
        (0..300).map(|sample| {
            let mut sampler = Sampler::new(8, 0, sample);
            let direction = sphere(sampler.square()).normalize();
            Look { origin: Vec3::new(0.1, 0.4, 1.0), direction, pdf: f32::INFINITY, sampler }
        })
    }

    /// The vector kernel finds what the portable one finds, bit for bit.
    #[test]
    fn vectors_change_nothing() {
        if Kernel::detect() == Kernel::Portable {
            return;
        }
        for lights in [0, 1, 3, 20] {
            let (scene, cache) = (room(lights).snapshot(), &mut WorldCache::default());
            let world = World::new(scene, MaterialModel::Full, Kernel::detect(), cache);
            let found = looks().map(|look| Found { at: look.direction, luminance: 1.0 });
            let beam = Beam::light(&world)
                .and_then(|light| Beam::new(&world, light, &found.collect::<Vec<_>>()));
            assert_eq!(beam.is_some(), lights == 3, "{lights}");
            let shortcuts = Shortcuts { beam: beam.as_ref(), ..Shortcuts::default() };
            let limits = Paths { shortcuts, ..Paths::new(3) };
            let [mut one, mut eight] = [0, 1].map(|_| Integrator::new(&world, limits));
            for integrator in [&mut one, &mut eight] {
                integrator.begin(looks());
                integrator.follow_beam();
            }
            for depth in 0..=limits.bounces {
                one.find_surfaces(depth);
                eight.find_surfaces(depth);
                one.shade_with(depth);
                eight.shade(depth);
                assert_eq!(one.alive, eight.alive, "{lights} {depth}");
                assert!(one.alive.len() > 100 || depth == limits.bounces, "{lights} {depth}");
                let text = |of: &Integrator<'_>| format!("{:?} {:?}", of.paths, of.connections);
                assert!(text(&one) == text(&eight), "{lights} {depth}");
                one.connect();
                eight.connect();
            }
            let light: Vec3 = one.paths.iter().map(|path| path.seen.radiance()).sum();
            assert!(light.is_finite() && light.min_element() > 0.0, "{lights}: {light}");
        }
    }
}
