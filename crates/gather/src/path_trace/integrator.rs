//! The path integrator: light arriving at a point from a direction.
//!
//! Unidirectional, with next-event estimation at every vertex and multiple importance sampling
//! (Veach 1997) where a source can also be met by chance. Russian roulette is for pictures with many
//! bounces only: paths of probes all have the same length, so that every sample counts alike. What
//! happens at the vertices is in [`super::group`].

use glam::Vec3;
use lumencast_light::LightField;

use super::beam::{Beam, Found, Lit, solid_angle};
use super::group::{Group, Shader};
use crate::accel::{Hit, ItemBuffer, Kernel, Ray, Stacks};
use crate::sampling::Sampler;
use crate::world::{Itself, Passing, World};

/// Which paths to follow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paths<'a> {
    /// Scattering events on a path.
    pub(crate) bounces: u32,
    /// Upper limit of the luminance that a vertex adds to scattered light, cd/m².
    pub(crate) clamp: f32,
    /// Scattering events from which on that holds. Light that is scattered once is direct light to a
    /// camera and indirect light to a probe: so both are held to the limit alike.
    pub(crate) clamp_from: u32,
    /// Scattering events from which on paths may end by chance.
    pub(crate) roulette_from: u32,
    /// The light that the last surface of a path scatters, beside that of punctual lights; without
    /// it, that surface only shines itself.
    pub(crate) previous: Option<&'a LightField>,
    /// The rays of a light that paths are connected to.
    pub(crate) beam: Option<&'a Beam>,
    /// What most paths' first rays meet.
    pub(crate) items: Option<&'a ItemBuffer>,
    /// The punctual light of which to note where paths found it, by its number.
    pub(crate) learn: Option<usize>,
}

impl Paths<'_> {
    /// Paths of so many scattering events, nothing else to be seen to.
    pub(crate) fn new(bounces: u32) -> Self {
        Self {
            bounces,
            clamp: f32::INFINITY,
            clamp_from: 1,
            roulette_from: u32::MAX,
            previous: None,
            beam: None,
            items: None,
            learn: None,
        }
    }
}

/// Where to look from, and where to.
#[derive(Clone, Debug)]
pub(crate) struct Look {
    /// Metres.
    pub(crate) origin: Vec3,
    /// Unit.
    pub(crate) direction: Vec3,
    /// Density per steradian with which that was chosen, where sources are reached for from the origin
    /// too ([`super::aim::Aim::reach`]); infinite where they are not.
    pub(crate) pdf: f32,
    /// The numbers of the path that begins here.
    pub(crate) sampler: Sampler,
}

/// What a path found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// Radiance, cd/m², of what a client that holds punctual lights draws by itself, had it a camera
    /// here: sources seen, and punctual lights scattered once.
    pub(crate) direct: Vec3,
    /// The rest: all light that a light field would have to bring.
    pub(crate) indirect: Vec3,
    /// Metres to the first surface; infinite where there is none.
    pub(crate) distance: f32,
    /// Unit normal of the first surface on the side that is seen; zero where there is none.
    pub(crate) normal: Vec3,
    /// The first surface is seen from its front.
    pub(crate) front: bool,
    /// The first surface shows a back that nobody is meant to see.
    pub(crate) culled: bool,
}

impl Seen {
    const NOTHING: Self = Self {
        direct: Vec3::ZERO,
        indirect: Vec3::ZERO,
        distance: f32::INFINITY,
        normal: Vec3::ZERO,
        front: false,
        culled: false,
    };

    /// Arriving radiance, cd/m².
    pub(crate) fn radiance(&self) -> Vec3 {
        self.direct + self.indirect
    }

    pub(super) fn add(&mut self, part: Part, light: Vec3) {
        match part {
            Part::Direct => self.direct += light,
            Part::Indirect => self.indirect += light,
        }
    }
}

/// The two parts of [`Seen`].
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    Direct,
    Indirect,
}

impl Part {
    /// Of a source that is met after so many scattering events, or of a punctual light that is
    /// scattered once more.
    pub(super) fn after(scattered: u32) -> Self {
        if scattered == 0 { Self::Direct } else { Self::Indirect }
    }
}

/// The ray in hand, and what is known of how it was chosen.
#[derive(Debug)]
pub(super) struct Segment {
    pub(super) ray: Ray,
    /// The triangle that it starts at.
    pub(super) from: Option<Itself>,
    /// Density per steradian with which the BSDF chose it; infinite where nothing else could have
    /// found the same light.
    pub(super) pdf: f32,
    /// Unit normal of the triangle that it starts at, and density per square metre with which the path
    /// chose the point there, infinite at its beginning; of use only beside a [`Beam`].
    pub(super) left: (Vec3, f32),
}

impl Segment {
    /// Density per square metre with which it arrives at a point so many metres away, on a surface
    /// with this unit normal.
    #[inline]
    pub(super) fn density_on(&self, distance: f32, normal: Vec3) -> f32 {
        self.pdf * solid_angle(self.ray.direction, normal, distance * distance)
    }
}

/// A path on its way.
#[derive(Debug)]
pub(super) struct Path {
    pub(super) sampler: Sampler,
    key: u64,
    pub(super) segment: Segment,
    pub(super) throughput: Vec3,
    pub(super) seen: Seen,
}

/// Light that a path receives if nothing is in between.
#[derive(Debug)]
pub(super) struct Connection {
    pub(super) path: u32,
    pub(super) part: Part,
    pub(super) light: Vec3,
    pub(super) ray: Ray,
    pub(super) passing: Passing,
}

/// Follows paths through a world, many at a time: all their rays are traced, then all that they met
/// is shaded, then all shadow rays are traced. What a path finds does not depend on the others.
///
/// Followed one by one to their ends, paths on Sponza take 1.25 times as long: half of shading is
/// waiting for vertices and texels, which this way are asked for before they are needed.
pub(crate) struct Integrator<'a> {
    world: &'a World,
    limits: Paths<'a>,
    stacks: Stacks,
    /// Rays traced so far.
    pub(crate) rays: u64,
    paths: Vec<Path>,
    /// Where the paths' segments end.
    hits: Vec<Option<Hit>>,
    /// Indices of the paths that go on.
    alive: Vec<u32>,
    group: Group<'a>,
    connections: Vec<Connection>,
    /// Whether something lies on them.
    occluded: Vec<bool>,
    /// The points that the beam lights, one for each path; none without a beam.
    lit: Vec<Option<Lit>>,
    /// Connections to the light to learn of, and where from.
    noted: Vec<(u32, Found)>,
    /// Those that nothing lies on, since last taken.
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

    /// Light arriving at each origin from its direction, scattered at most `bounces` times, in order.
    /// Punctual lights are seen only through the surfaces that they light.
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
                left: (Vec3::ZERO, f32::INFINITY),
            },
            throughput: Vec3::ONE,
            seen: Seen::NOTHING,
        }));
        self.hits.resize(self.paths.len(), None);
        self.alive.clear();
        self.alive.extend(0..self.paths.len() as u32);
    }

    /// Which of these rays nothing lies on.
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
        let Some(beam) = limits.beam else { return };
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

    /// Traces the rays in hand.
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
        match limits.items.filter(|_| depth == 0) {
            Some(items) => world.closest_seen(items, rays, stacks, passing, found),
            None => world.closest(rays, stacks, passing, found),
        }
    }

    /// Traces the shadow rays and adds the light of those that arrive.
    fn connect(&mut self) {
        let Self { world, connections, occluded, paths, stacks, noted, found, .. } = self;
        self.rays += connections.len() as u64;
        occluded.resize(connections.len(), false);
        let rays = connections.iter().zip(0..).map(|(c, n)| (c.ray, n));
        let passing = |n: u32| connections[n as usize].passing;
        world.occluded(rays, stacks, passing, |n, found| occluded[n as usize] = found);
        found.extend(noted.drain(..).filter(|(n, _)| !occluded[*n as usize]).map(|(_, f)| f));
        // In order, so that sums do not depend on which ray was done first.
        for (c, occluded) in connections.drain(..).zip(occluded) {
            if !*occluded {
                paths[c.path as usize].seen.add(c.part, c.light);
            }
        }
    }

    /// Goes one scattering event further on every path.
    fn shade(&mut self, depth: u32) {
        match self.world.kernel() {
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2(_) => {
                #[expect(unsafe_code, reason = "calls code compiled for AVX2")]
                // SAFETY: `Avx2` is made only by `Kernel::detect`, after the check for what it needs.
                unsafe {
                    shade_avx2(self, depth);
                }
            }
            _ => self.shade_with(depth),
        }
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

/// [`Integrator::shade_with`] compiled for AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,popcnt")]
fn shade_avx2(integrator: &mut Integrator<'_>, depth: u32) {
    integrator.shade_with(depth);
}

impl Path {
    /// Four keys for each segment, for decisions about surfaces that cover in part.
    pub(super) fn key(&self, depth: u32) -> u64 {
        self.key.wrapping_add(u64::from(depth) * 4)
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use lumencast_scene::{Light, LightKind, Material};
    use lumencast_testkit::scenes::{Stage, lambert};

    use super::*;
    use crate::sampling::sphere;
    use crate::surface::MaterialModel;
    use crate::world::WorldCache;

    /// A room of several materials with so many lights, every other of them with a size.
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
            let light = Light { kind, color: Vec3::ONE, intensity: 2.0, range: Some(9.0) };
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

    /// Vector instructions find what single numbers find, bit for bit.
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
            let limits = Paths { beam: beam.as_ref(), ..Paths::new(3) };
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
