//! The path integrator: light arriving at a point from a direction.
//!
//! Unidirectional, with next-event estimation at every vertex and multiple importance sampling
//! (Veach 1997) where a source can also be met by chance. Russian roulette is for pictures with many
//! bounces only: paths of probes all have the same length, so that every sample counts alike.

use glam::{Mat3, Vec3};

use crate::accel::{Ray, Stack};
use crate::bsdf::{Bsdf, Scatter};
use crate::lights::AreaSample;
use crate::sampling::{Sampler, luminance, mix2, power_heuristic};
use crate::surface::{MaterialModel, Point};
use crate::world::{Itself, World, itself};

/// Which paths to follow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paths {
    /// Scattering events on a path.
    pub(crate) bounces: u32,
    /// Upper limit of the luminance that a vertex adds to scattered light, cd/m².
    pub(crate) clamp: f32,
    /// Scattering events from which on paths may end by chance.
    pub(crate) roulette_from: u32,
}

/// Follows paths through a world.
pub(crate) struct Integrator<'a> {
    world: &'a World,
    paths: Paths,
    stack: Stack,
    /// Rays traced so far.
    pub(crate) rays: u64,
}

/// What a path found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Radiance, cd/m², of what a client that holds punctual lights draws by itself, had it a camera
    /// here: sources seen, and punctual lights scattered once.
    pub(crate) direct: Vec3,
    /// The rest: all light that a light field would have to bring.
    pub(crate) indirect: Vec3,
    /// Metres to the first surface; infinite where there is none.
    pub(crate) distance: f32,
    /// The first surface shows a back that nobody is meant to see.
    pub(crate) back: bool,
}

impl Seen {
    /// Arriving radiance, cd/m².
    pub(crate) fn radiance(&self) -> Vec3 {
        self.direct + self.indirect
    }

    /// Where light goes that was found `scattered` events away, the last of them not counted.
    fn part(&mut self, scattered: u32) -> &mut Vec3 {
        if scattered == 0 { &mut self.direct } else { &mut self.indirect }
    }
}

/// The ray in hand, and what is known of how it was chosen.
struct Segment {
    ray: Ray,
    from: Option<Itself>,
    /// Density per steradian with which the BSDF chose it; infinite where nothing else could have
    /// found the same light.
    pdf: f32,
}

impl<'a> Integrator<'a> {
    pub(crate) fn new(world: &'a World, paths: Paths, stack: Stack) -> Self {
        Self { world, paths, stack, rays: 0 }
    }

    /// The stack, to be used again.
    pub(crate) fn into_stack(self) -> Stack {
        self.stack
    }

    /// Light arriving at `origin` from `direction` (unit), scattered at most `bounces` times.
    /// Punctual lights are seen only through the surfaces that they light.
    pub(crate) fn radiance(
        &mut self,
        origin: Vec3,
        direction: Vec3,
        sampler: &mut Sampler,
    ) -> Seen {
        let world = self.world;
        let ray = Ray { origin, direction, t_max: f32::INFINITY };
        let mut segment = Segment { ray, from: None, pdf: f32::INFINITY };
        let mut throughput = Vec3::ONE;
        let mut seen =
            Seen { direct: Vec3::ZERO, indirect: Vec3::ZERO, distance: f32::INFINITY, back: false };
        for depth in 0.. {
            let key = mix2(sampler.key(), u64::from(depth) * 4);
            self.rays += 1;
            let Some(hit) = world.closest(&segment.ray, segment.from, key, &mut self.stack) else {
                *seen.part(depth) += self.limited(depth, throughput * self.sky(&segment));
                break;
            };
            let Some(point) = world.point(hit, segment.ray.direction) else { break };
            if depth == 0 {
                seen.distance = hit.t;
                seen.back = !point.front && !point.material.double_sided;
            }
            let emitted = throughput * self.emission(&point, &segment);
            *seen.part(depth) += self.limited(depth, emitted);
            if depth == self.paths.bounces {
                break;
            }
            let Some((bsdf, frame)) = point.scattering(world.frames(hit.instance), world.model)
            else {
                break;
            };
            let vertex = Vertex {
                point: &point,
                bsdf,
                frame,
                model: world.model,
                view: -segment.ray.direction,
            };
            let punctual = throughput * self.punctual(&vertex, key, sampler);
            *seen.part(depth) += self.limited(depth + 1, punctual);
            let area = throughput * self.area(&vertex, key, sampler);
            seen.indirect += self.limited(depth + 1, area);
            if depth + 1 == self.paths.bounces && world.lights.are_punctual() {
                // The last ray could only meet a source.
                break;
            }
            let Some((next, weight)) = vertex.scatter(sampler) else { break };
            throughput *= weight;
            if depth + 1 >= self.paths.roulette_from {
                let survival = throughput.max_element().min(1.0);
                if sampler.number() >= survival {
                    break;
                }
                throughput /= survival;
            }
            segment = next;
        }
        seen
    }

    /// Environment seen along a ray that left the scene.
    fn sky(&self, segment: &Segment) -> Vec3 {
        let direction = segment.ray.direction;
        let lights = &self.world.lights;
        let weight = power_heuristic(segment.pdf, lights.sky_pdf(direction));
        weight * lights.sky.radiance(direction)
    }

    /// Emission of the surface that a ray met.
    fn emission(&self, point: &Point<'_>, segment: &Segment) -> Vec3 {
        let emitted = point.emission(self.world.model);
        let Some(emitter) = self.world.emitter(&point.hit).filter(|_| emitted != Vec3::ZERO) else {
            return emitted;
        };
        let other = self.world.lights.emitter_pdf(emitter, segment.ray.origin, point.position);
        power_heuristic(segment.pdf, other) * emitted
    }

    /// Light of one punctual light, scattered once.
    fn punctual(&mut self, vertex: &Vertex<'_>, key: u64, sampler: &mut Sampler) -> Vec3 {
        let choice = sampler.number();
        let at = vertex.point.position;
        let lights = &self.world.lights.punctual;
        let Some((incident, light)) = lights.choose(at, choice, |l| vertex.eval(l).value) else {
            return Vec3::ZERO;
        };
        let origin = vertex.point.leave(incident.direction);
        let ray = Ray { origin, direction: incident.direction, t_max: incident.distance };
        if self.occluded(vertex, ray, None, key + 1) { Vec3::ZERO } else { light }
    }

    /// Light of one point of an emissive triangle or of the environment, scattered once.
    fn area(&mut self, vertex: &Vertex<'_>, key: u64, sampler: &mut Sampler) -> Vec3 {
        if self.world.lights.are_punctual() {
            return Vec3::ZERO;
        }
        let (choice, u) = (sampler.number(), sampler.square());
        let Some(sample) = self.world.lights.sample_area(vertex.point.position, choice, u) else {
            return Vec3::ZERO;
        };
        let (direction, distance, pdf, target) = match &sample {
            AreaSample::Sky { direction, pdf, .. } => (*direction, f32::INFINITY, *pdf, None),
            AreaSample::Emitter(e) => {
                let to = e.position - vertex.point.position;
                let distance = to.length();
                (to / distance, distance, e.pdf, Some((e.instance, e.primitive, e.triangle)))
            }
        };
        let Scatter { value, pdf: other } = vertex.eval(direction);
        if value == Vec3::ZERO || !direction.is_finite() {
            return Vec3::ZERO;
        }
        let emitted = match &sample {
            AreaSample::Sky { radiance, .. } => *radiance,
            AreaSample::Emitter(e) => self.world.emitted(e),
        };
        let light = value * emitted * (power_heuristic(pdf, other) / pdf);
        let ray = Ray { origin: vertex.point.leave(direction), direction, t_max: distance };
        if light == Vec3::ZERO || self.occluded(vertex, ray, target, key + 2) {
            Vec3::ZERO
        } else {
            light
        }
    }

    fn occluded(
        &mut self,
        vertex: &Vertex<'_>,
        ray: Ray,
        target: Option<Itself>,
        key: u64,
    ) -> bool {
        self.rays += 1;
        let ends = [Some(itself(&vertex.point.hit)), target];
        self.world.occluded(&ray, ends, key, &mut self.stack)
    }

    /// Scattered light held to the limit; what the receiver sees itself is left alone. A value that
    /// is not a number would spoil a whole field, so it counts as nothing.
    fn limited(&self, scattered: u32, light: Vec3) -> Vec3 {
        if !light.is_finite() {
            return Vec3::ZERO;
        }
        let y = luminance(light);
        if scattered == 0 || y <= self.paths.clamp { light } else { light * (self.paths.clamp / y) }
    }
}

/// A point with its scattering.
struct Vertex<'a> {
    point: &'a Point<'a>,
    bsdf: Bsdf,
    /// World from the frame of shading.
    frame: Mat3,
    model: MaterialModel,
    view: Vec3,
}

impl Vertex<'_> {
    fn local(&self, world: Vec3) -> Vec3 {
        self.frame.transpose() * world
    }

    fn eval(&self, direction: Vec3) -> Scatter {
        let local = self.local(direction);
        if !self.on_side(local, direction) {
            return Scatter::default();
        }
        self.bsdf.eval(self.local(self.view), local)
    }

    /// The next ray of the path, and what light along it is multiplied by.
    fn scatter(&self, sampler: &mut Sampler) -> Option<(Segment, Vec3)> {
        let (choice, u) = (sampler.number(), sampler.square());
        let chosen = self.bsdf.sample(self.local(self.view), choice, u)?;
        let direction = (self.frame * chosen.direction).normalize();
        if !self.on_side(chosen.direction, direction) {
            return None;
        }
        let ray = Ray { origin: self.point.leave(direction), direction, t_max: f32::INFINITY };
        let from = Some(itself(&self.point.hit));
        Some((Segment { ray, from, pdf: chosen.pdf }, chosen.weight))
    }

    /// Whether shading normal and triangle agree on which side a direction is; where they do not,
    /// light would shine through the surface. The renderer that [`MaterialModel::Lambert`] is to
    /// be compared with does not ask.
    fn on_side(&self, local: Vec3, world: Vec3) -> bool {
        self.model == MaterialModel::Lambert
            || (local.z > 0.0) == (world.dot(self.point.normal) > 0.0)
    }
}
