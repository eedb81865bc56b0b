//! A snapshot made ready for tracing.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use lumencast_light::{OnTriangle, SurfaceId};
use lumencast_scene::{AlphaMode, Instance, Material, PlacedLight, Snapshot};

use crate::accel::{
    Accel, AccelCache, Hit, ItemBuffer, Kernel, Levels, LightBuffer, Pyramid, Ray, Stacks, Trees,
};
use crate::bsdf::Scatter;
use crate::lights::emission::EmissionCache;
use crate::lights::environment::{Sky, SkyCache};
use crate::lights::punctual::{Candidate, Punctual};
use crate::lights::{AreaSample, Lights, emitters};
use crate::sampling::{luminance, mix2, unit};
use crate::surface::{Frames, MaterialModel, Point, Triangle};

/// Structures that are reused from one snapshot to the next.
#[derive(Debug, Default)]
pub(crate) struct WorldCache {
    accel: AccelCache,
    sky: SkyCache,
    emission: EmissionCache,
    light_buffers: LightBufferCache,
}

impl WorldCache {
    pub(crate) fn new(levels: Levels) -> Self {
        Self { accel: AccelCache::new(levels), ..Self::default() }
    }

    pub(crate) fn with_trees(self, trees: Trees) -> Self {
        Self { accel: self.accel.with_trees(trees), ..self }
    }
}

/// The light buffers of the last snapshot, reused while the snapshot is the same.
#[derive(Debug, Default)]
struct LightBufferCache(Option<(Arc<Snapshot>, MaterialModel, Arc<[LightBuffer]>)>);

impl LightBufferCache {
    fn of(&mut self, world: &World) -> Arc<[LightBuffer]> {
        if let Some((snapshot, model, buffers)) = &self.0
            && Arc::ptr_eq(snapshot, &world.snapshot)
            && *model == world.model
        {
            return buffers.clone();
        }
        let buffers = world.make_light_buffers();
        self.0 = Some((world.snapshot.clone(), world.model, buffers.clone()));
        buffers
    }
}

/// Most directional lights that get a light buffer. Rays towards others walk the hierarchy.
const LIGHT_BUFFERS: usize = 4;

/// A snapshot with its acceleration structure and tables of lights. All positions are relative to
/// the snapshot's origin. Receivers, cameras and fields have world positions; callers convert them.
#[derive(Debug)]
pub(crate) struct World {
    snapshot: Arc<Snapshot>,
    accel: Accel,
    light_buffers: Arc<[LightBuffer]>,
    pub(crate) lights: Lights,
    pub(crate) model: MaterialModel,
    frames: Vec<Frames>,
    /// Index into `parts` of each instance's first primitive.
    first_part: Vec<u32>,
    parts: Vec<Part>,
    fallback: Material,
}

/// One primitive of one instance.
#[derive(Clone, Copy, Debug)]
struct Part {
    material: u32,
    opaque: bool,
    /// Index of its first triangle among the emitters; `None` where it does not emit.
    emitters: Option<u32>,
}

/// The triangle that a ray starts at or is aimed at: instance, primitive, triangle. The ray ignores
/// it.
pub(crate) type Itself = (u32, u32, u32);

/// The surfaces that a ray ignores.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passing {
    /// The triangles that the ray starts at and is aimed at.
    pub(crate) ends: [Option<Itself>; 2],
    /// Decides by hash whether a partly transparent surface stops the ray.
    pub(crate) key: u64,
}

impl World {
    pub(crate) fn new(
        snapshot: Arc<Snapshot>,
        model: MaterialModel,
        kernel: Kernel,
        cache: &mut WorldCache,
    ) -> Self {
        let accel = cache.accel.update(&snapshot, kernel);
        let bounds = accel.bounds();
        let radius = if bounds.is_empty() { 0.0 } else { 0.5 * (bounds.max - bounds.min).length() };
        let lights = Lights {
            punctual: Punctual::new(&snapshot.lights, radius),
            emitters: emitters::Emitters::default(),
            sky: Sky::new(&snapshot.environment, &mut cache.sky),
        };
        let frames = snapshot.instances.iter().map(|i| Frames::new(i.world_from_object)).collect();
        let fallback = Material::default();
        let mut world = Self {
            snapshot,
            accel,
            light_buffers: Arc::default(),
            lights,
            model,
            frames,
            first_part: Vec::new(),
            parts: Vec::new(),
            fallback,
        };
        world.find_emitters(&mut cache.emission);
        if cache.accel.levels() == Levels::One {
            world.light_buffers = cache.light_buffers.of(&world);
        }
        world
    }

    fn make_light_buffers(&self) -> Arc<[LightBuffer]> {
        let extent = self.extent();
        let slack = self.frames.iter().map(|f| f.error_within(extent)).fold(0.0, f32::max);
        let is_opaque = |instance, primitive| self.part(instance, primitive).opaque;
        let towards = self.lights.punctual.directions().take(LIGHT_BUFFERS);
        towards.filter_map(|to| LightBuffer::new(&self.accel, to, slack, is_opaque)).collect()
    }

    /// Finds what the rays through a picture meet first; worth its cost for many rays. `None` where
    /// the scene has several hierarchies or no surfaces.
    pub(crate) fn item_buffer(&self, pyramid: &Pyramid) -> Option<ItemBuffer> {
        ItemBuffer::new(&self.accel, pyramid, |instance, primitive| {
            self.part(instance, primitive).opaque
        })
    }

    /// The largest absolute coordinate of any surface, metres; 0 without surfaces.
    pub(crate) fn extent(&self) -> f32 {
        let bounds = self.accel.bounds();
        if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element() }
    }

    fn find_emitters(&mut self, cache: &mut EmissionCache) {
        let mut emitters = emitters::Emitters::default();
        for (index, instance) in (0..).zip(&self.snapshot.instances) {
            self.first_part.push(self.parts.len() as u32);
            for (p, primitive) in (0..).zip(&instance.mesh.primitives) {
                let id = primitive.material.0;
                let material = self.snapshot.materials.get(id as usize).unwrap_or(&self.fallback);
                let frames = &self.frames[index as usize];
                self.parts.push(Part {
                    material: id,
                    opaque: material.alpha_mode == AlphaMode::Opaque
                        || self.model == MaterialModel::Lambert,
                    emitters: emitters::shines(material, self.model).map(|both| {
                        let texture = material.emissive_texture.as_ref();
                        let means = texture.map(|t| cache.means(&instance.mesh, p, t));
                        let of_texture = |t: u32| means.as_ref().map_or(1.0, |m| m[t as usize]);
                        let luminance = |t| luminance(material.emissive) * of_texture(t);
                        emitters.add((index, instance), frames, p, both, luminance)
                    }),
                });
            }
        }
        cache.finish();
        emitters.finish();
        self.lights.emitters = emitters;
    }

    /// The instruction set that rays are traced with.
    pub(crate) fn kernel(&self) -> Kernel {
        self.accel.kernel()
    }

    /// The acceleration structure alone, which treats every surface as opaque.
    pub(crate) fn accel(&self) -> &Accel {
        &self.accel
    }

    /// World-space corners of every triangle: instance by instance, primitive by primitive.
    pub(crate) fn world_triangles(&self) -> Vec<[Vec3; 3]> {
        let mut triangles = Vec::new();
        for (instance, frames) in self.snapshot.instances.iter().zip(&self.frames) {
            for (p, primitive) in (0..).zip(&instance.mesh.primitives) {
                let count = primitive.triangles.len() as u32;
                let corners = |t| Triangle::new(instance, p, t).positions();
                triangles.extend((0..count).map(|t| corners(t).map(|c| frames.position(c))));
            }
        }
        triangles
    }

    /// A shadow ray to a light chosen at random, from a point without a surface of its own.
    pub(crate) fn aim(&self, from: Vec3, choice: f32, u: Vec2) -> Option<Ray> {
        let facing = |_: Vec3| Scatter { value: Vec3::ONE, pdf: 0.0 };
        let endless = |direction| Ray { origin: from, direction, t_max: f32::INFINITY };
        if let Some(chosen) = self.lights.punctual.choose(from, choice, u, facing) {
            let Candidate { direction, distance, .. } = chosen;
            return Some(match distance == f32::INFINITY {
                true => endless(direction),
                false => Ray::reaching(from, distance * direction),
            });
        }
        match self.lights.sample_area(from, choice, u)? {
            AreaSample::Sky { direction, .. } => Some(endless(direction)),
            AreaSample::Emitter(e) => Some(Ray::reaching(from, e.position - from)),
        }
    }

    /// Chooses a point of an emissive triangle or a direction of an environment picture, as seen
    /// from `from`.
    pub(crate) fn source(&self, from: Vec3, choice: f32, u: Vec2) -> Option<AreaSource> {
        Some(match self.lights.sample_area(from, choice, u)? {
            AreaSample::Sky { direction, radiance, pdf } => {
                let ray = Ray { origin: from, direction, t_max: f32::INFINITY };
                AreaSource { ray, radiance, pdf, target: None }
            }
            AreaSample::Emitter(e) => AreaSource {
                ray: Ray::reaching(from, e.position - from),
                radiance: self.emitted(&e),
                pdf: e.pdf,
                target: Some((e.instance, e.primitive, e.triangle)),
            },
        })
    }

    /// The punctual lights.
    pub(crate) fn placed_lights(&self) -> &[PlacedLight] {
        &self.snapshot.lights
    }

    /// The world position, metres, that all positions in this struct are relative to.
    pub(crate) fn origin(&self) -> Vec3 {
        self.snapshot.origin
    }

    /// Version of the snapshot.
    pub(crate) fn version(&self) -> u64 {
        self.snapshot.version
    }

    fn part(&self, instance: u32, primitive: u32) -> &Part {
        &self.parts[(self.first_part[instance as usize] + primitive) as usize]
    }

    #[inline]
    pub(crate) fn material(&self, instance: u32, primitive: u32) -> &Material {
        let id = self.part(instance, primitive).material as usize;
        self.snapshot.materials.get(id).unwrap_or(&self.fallback)
    }

    /// Which point of the scene a hit is, on the front or the back by winding.
    pub(crate) fn on_triangle(&self, hit: &Hit, back: bool) -> OnTriangle {
        let Instance { node, copy, .. } = *self.instance(hit.instance);
        let (triangle, weights) = (hit.triangle, hit.weights());
        let surface = SurfaceId { node: node.0, copy, primitive: hit.primitive, back };
        OnTriangle { surface, triangle, weights }
    }

    fn instance(&self, index: u32) -> &Instance {
        &self.snapshot.instances[index as usize]
    }

    #[inline]
    pub(crate) fn frames(&self, instance: u32) -> &Frames {
        &self.frames[instance as usize]
    }

    /// Finds the surfaces that rays of unit direction meet first. Each ray comes with a number,
    /// which is passed to `passing` and `found`. Rays finish in no particular order.
    pub(crate) fn closest(
        &self,
        rays: impl Iterator<Item = (Ray, u32)>,
        stacks: &mut Stacks,
        passing: impl Fn(u32) -> Passing,
        found: impl FnMut(u32, Option<Hit>),
    ) {
        self.accel.closest(rays, stacks, |&n, hit| self.stops(hit, &passing(n)), found);
    }

    /// Like [`Self::closest`]; looks rays up in an item buffer and traces the rest.
    pub(crate) fn closest_seen(
        &self,
        items: &ItemBuffer,
        rays: impl Iterator<Item = (Ray, u32)>,
        stacks: &mut Stacks,
        passing: impl Fn(u32) -> Passing,
        mut found: impl FnMut(u32, Option<Hit>),
    ) {
        let stops = |&n: &u32, hit: &Hit| self.stops(hit, &passing(n));
        let mut undecided = Vec::new();
        items.closest(rays, stops, &mut found, |ray, n| undecided.push((ray, n)));
        self.accel.closest(undecided.into_iter(), stacks, stops, found);
    }

    /// Tells whether something lies on each of the rays; otherwise like [`Self::closest`].
    pub(crate) fn occluded(
        &self,
        rays: impl Iterator<Item = (Ray, u32)> + Clone,
        stacks: &mut Stacks,
        passing: impl Fn(u32) -> Passing,
        mut found: impl FnMut(u32, bool),
    ) {
        let stops = |&n: &u32, hit: &Hit| self.stops(hit, &passing(n));
        let mut undecided = Vec::new();
        for buffer in self.light_buffers.iter() {
            let its_own = rays.clone().filter(|(ray, _)| buffer.answers(ray));
            buffer.occluded(its_own, stops, &mut found, |ray, n| undecided.push((ray, n)));
        }
        let is_anyones = |ray: &Ray| self.light_buffers.iter().any(|buffer| buffer.answers(ray));
        let others = rays.filter(|(ray, _)| !is_anyones(ray));
        self.accel.occluded(others.chain(undecided), stacks, stops, found);
    }

    /// Whether a ray ends at this hit, given what it ignores.
    #[inline]
    fn stops(&self, hit: &Hit, passing: &Passing) -> bool {
        !passing.ends.contains(&Some(itself(hit))) && self.covers(hit, passing.key)
    }

    /// Whether the surface is opaque to the ray with this key. Partly transparent ones decide by
    /// hash.
    #[inline]
    fn covers(&self, hit: &Hit, key: u64) -> bool {
        let part = self.part(hit.instance, hit.primitive);
        part.opaque || self.covers_in_part(hit, key)
    }

    #[cold]
    fn covers_in_part(&self, hit: &Hit, key: u64) -> bool {
        let material = self.material(hit.instance, hit.primitive);
        let coverage = self.triangle(hit).at(material, hit.weights()).coverage();
        let place = u64::from(hit.instance) << 40
            ^ u64::from(hit.primitive) << 32
            ^ u64::from(hit.triangle);
        coverage >= 1.0 || unit(mix2(key, place) as u32) < coverage
    }

    /// Prefetches a hit's vertex indices. [`Self::point`] and its scattering read indices, vertices
    /// and texels one after the other; the prefetch overlaps that with other work.
    #[inline]
    pub(crate) fn fetch_triangle(&self, hit: &Hit) {
        Triangle::fetch(self.instance(hit.instance), hit.primitive, hit.triangle);
    }

    /// A hit's triangle.
    #[inline]
    pub(crate) fn triangle(&self, hit: &Hit) -> Triangle<'_> {
        Triangle::new(self.instance(hit.instance), hit.primitive, hit.triangle)
    }

    /// Position, normals and material of a hit; `None` for triangles so thin that they have no
    /// normal.
    pub(crate) fn point(&self, hit: &Hit, direction: Vec3) -> Option<Point<'_>> {
        let material = self.material(hit.instance, hit.primitive);
        Point::new(hit, self.triangle(hit), self.frames(hit.instance), material, direction)
    }

    /// The index of a hit's triangle among the emitters; `None` where it does not emit.
    pub(crate) fn emitter(&self, hit: &Hit) -> Option<u32> {
        Some(self.part(hit.instance, hit.primitive).emitters? + hit.triangle)
    }

    /// Radiance (cd/m²) of a point of an emitter, times the coverage of the surface there.
    pub(crate) fn emitted(&self, sample: &emitters::EmitterSample) -> Vec3 {
        let triangle =
            Triangle::new(self.instance(sample.instance), sample.primitive, sample.triangle);
        let material = self.material(sample.instance, sample.primitive);
        let spot = triangle.at(material, sample.weights);
        let coverage = match self.model {
            MaterialModel::Full => spot.coverage(),
            MaterialModel::Lambert => 1.0,
        };
        coverage * spot.emission()
    }
}

/// A light source with an extent, as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AreaSource {
    /// The shadow ray to the source.
    pub(crate) ray: Ray,
    /// cd/m².
    pub(crate) radiance: Vec3,
    /// Density per steradian of the choice.
    pub(crate) pdf: f32,
    /// The source's triangle, which the ray ignores; `None` for the environment.
    pub(crate) target: Option<Itself>,
}

/// The name of a hit's triangle.
pub(crate) fn itself(hit: &Hit) -> Itself {
    (hit.instance, hit.primitive, hit.triangle)
}

#[cfg(test)]
mod tests {
    use lumencast_scene::{LightKind, PunctualLight};
    use lumencast_testkit::scenes::{Stage, lambert};

    use super::*;

    /// A sheet of 50 % coverage over a floor, under suns of these angular diameters.
    fn sheet_over_floor(angles: &[f32]) -> Arc<Snapshot> {
        let mut stage = Stage::default();
        let grey = lambert(Vec3::splat(0.5), Vec3::ZERO);
        let half = Material {
            alpha_mode: AlphaMode::Blend,
            base_color: Vec3::splat(0.5).extend(0.5),
            ..grey.clone()
        };
        let [grey, half] = [grey, half].map(|material| stage.material(material));
        stage.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, grey);
        stage.quad(Vec3::new(-1.0, 1.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, half);
        for &angle in angles {
            let kind = LightKind::Directional { angle };
            let light = PunctualLight { kind, color: Vec3::ONE, intensity: 1.0, range: None };
            stage.light(light, Vec3::ZERO, Vec3::new(0.1, -1.0, 0.2));
        }
        stage.snapshot()
    }

    fn world(snapshot: &Arc<Snapshot>, model: MaterialModel, cache: &mut WorldCache) -> World {
        World::new(snapshot.clone(), model, Kernel::detect(), cache)
    }

    #[test]
    fn suns_without_a_size_have_light_buffers_in_one_hierarchy() {
        let snapshot = sheet_over_floor(&[0.0, 0.1, 0.0]);
        let [one, two] = [Levels::One, Levels::Two].map(WorldCache::new);
        let (mut one, mut two) = (one, two);
        assert!(world(&snapshot, MaterialModel::Full, &mut two).light_buffers.is_empty());
        let found = world(&snapshot, MaterialModel::Full, &mut one).light_buffers;
        assert_eq!(found.len(), 2);
        let again = world(&snapshot, MaterialModel::Full, &mut one).light_buffers;
        assert!(Arc::ptr_eq(&found, &again));
        // Another material model makes other surfaces opaque, so the buffers differ.
        let lambert = world(&snapshot, MaterialModel::Lambert, &mut one).light_buffers;
        assert!(!Arc::ptr_eq(&found, &lambert));
        let many = sheet_over_floor(&[0.0; 2 * LIGHT_BUFFERS]);
        let many = world(&many, MaterialModel::Full, &mut one).light_buffers;
        assert_eq!(many.len(), LIGHT_BUFFERS);
    }

    /// Partly transparent surfaces let the same rays pass, whichever structure answers.
    #[test]
    fn rays_pass_sheets_by_their_keys() {
        let world = &world(
            &sheet_over_floor(&[0.0]),
            MaterialModel::Full,
            &mut WorldCache::new(Levels::One),
        );
        let direction = world.lights.punctual.directions().next().expect("a sun");
        let origin = |n: u32| Vec3::new(0.04 * (n % 100) as f32 - 1.98, 1e-4, 0.3);
        let ray = |n: u32| Ray { origin: origin(n), direction, t_max: f32::INFINITY };
        let passing = |n: u32| Passing { ends: [None; 2], key: mix2(3, n.into()) };
        let rays = (0..1000).map(|n| (ray(n), n));
        let stops = |&n: &u32, hit: &Hit| world.stops(hit, &passing(n));
        let [mut found, mut by_tree] = [0, 1].map(|_| vec![None; 1000]);
        let mut stacks = Stacks::default();
        world.occluded(rays.clone(), &mut stacks, passing, |n, hit| found[n as usize] = Some(hit));
        world.accel.occluded(rays, &mut stacks, stops, |n, hit| by_tree[n as usize] = Some(hit));
        assert_eq!(found, by_tree);
        let occluded = found.iter().filter(|hit| **hit == Some(true)).count();
        assert!((150..350).contains(&occluded), "about half of half: {occluded}");
    }
}
