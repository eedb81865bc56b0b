//! What happens at the vertices of paths: emission, light reached for, scattering.

use glam::{Mat3, Vec3};
use lumencast_light::LightField;

use super::integrator::{Connection, Part, Path, Paths, Segment};
use crate::accel::{Hit, Ray};
use crate::bsdf::{Bsdf, Scatter};
use crate::lights::AreaSample;
use crate::sampling::{Sampler, luminance, power_heuristic};
use crate::surface::{MaterialModel, Point};
use crate::world::{Passing, World, itself};

/// What happens where a path's ray has arrived.
pub(super) struct Shader<'a> {
    pub(super) world: &'a World,
    pub(super) limits: &'a Paths<'a>,
    /// Scattering events so far.
    pub(super) depth: u32,
    /// Lights to reach for.
    pub(super) connections: &'a mut Vec<Connection>,
}

impl Shader<'_> {
    /// Adds what shines, notes which lights to reach for, and turns the ray that has met `hit`; `None`
    /// where the path ends.
    pub(super) fn vertex(&mut self, index: u32, path: &mut Path, hit: Option<Hit>) -> Option<()> {
        let world = self.world;
        let depth = self.depth;
        let part = Part::after(depth);
        if depth > 0 && world.lights.punctual.have_size() {
            let end = hit.map_or(f32::INFINITY, |hit| hit.t);
            let discs = path.throughput * self.discs(&path.segment, end);
            path.seen.add(Part::after(depth - 1), self.limited(depth, discs));
        }
        let Some(hit) = hit else {
            let sky = path.throughput * self.sky(&path.segment);
            path.seen.add(part, self.limited(depth, sky));
            return None;
        };
        let point = world.point(hit, path.segment.ray.direction)?;
        if depth == 0 {
            path.seen.distance = hit.t;
            path.seen.normal = point.normal;
            path.seen.front = point.front;
            path.seen.back = !point.front && !point.material.double_sided;
        }
        let emitted = path.throughput * self.emission(&point, &path.segment);
        path.seen.add(part, self.limited(depth, emitted));
        let previous = self.limits.previous;
        let is_last = depth == self.limits.bounces;
        if is_last && previous.is_none() {
            return None;
        }
        let (bsdf, frame) = point.scattering(world.frames(hit.instance), world.model)?;
        let view = -path.segment.ray.direction;
        let vertex = Vertex { point: &point, bsdf, frame, model: world.model, view };

        self.punctual(&vertex, index, path, is_last);
        if let Some(field) = previous.filter(|_| is_last) {
            let light = path.throughput * vertex.scatter_field(field, &mut path.sampler);
            path.seen.add(Part::Indirect, self.limited(depth + 1, light));
            return None;
        }
        self.area(&vertex, index, path);
        let only_sources = depth + 1 == self.limits.bounces && previous.is_none();
        if only_sources && world.lights.are_points() {
            return None;
        }
        let (next, weight) = vertex.scatter(&mut path.sampler)?;
        path.throughput *= weight;
        if depth + 1 >= self.limits.roulette_from {
            let survival = path.throughput.max_element().min(1.0);
            if path.sampler.number() >= survival {
                return None;
            }
            path.throughput /= survival;
        }
        path.segment = next;
        Some(())
    }

    /// Punctual lights with a size that a scattered ray meets before `end` metres.
    fn discs(&self, segment: &Segment, end: f32) -> Vec3 {
        let Ray { origin, direction, .. } = segment.ray;
        self.world.lights.punctual.met(origin, direction, end, segment.pdf)
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

    /// Reaches for one punctual light; from the last vertex no scattered ray will meet it by chance.
    fn punctual(&mut self, vertex: &Vertex<'_>, index: u32, path: &mut Path, is_last: bool) {
        let choice = path.sampler.number();
        let at = vertex.point.position;
        let lights = &self.world.lights.punctual;
        let on_disc = || path.sampler.square();
        let eval = |l| {
            let found = vertex.eval(l);
            Scatter { pdf: if is_last { 0.0 } else { found.pdf }, ..found }
        };
        let Some((incident, light)) = lights.choose(at, choice, on_disc, eval) else {
            return;
        };
        let light = self.limited(self.depth + 1, path.throughput * light);
        let origin = vertex.point.leave(incident.direction);
        let ray = Ray { origin, direction: incident.direction, t_max: incident.distance };
        self.connections.push(Connection {
            path: index,
            part: Part::after(self.depth),
            light,
            ray,
            passing: Passing {
                ends: [Some(itself(&vertex.point.hit)), None],
                key: path.key(self.depth) + 1,
            },
        });
    }

    /// Reaches for one point of an emissive triangle or of the environment.
    fn area(&mut self, vertex: &Vertex<'_>, index: u32, path: &mut Path) {
        if self.world.lights.are_points() {
            return;
        }
        let (choice, u) = (path.sampler.number(), path.sampler.square());
        let Some(sample) = self.world.lights.sample_area(vertex.point.position, choice, u) else {
            return;
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
            return;
        }
        let emitted = match &sample {
            AreaSample::Sky { radiance, .. } => *radiance,
            AreaSample::Emitter(e) => self.world.emitted(e),
        };
        let light = value * emitted * (power_heuristic(pdf, other) / pdf);
        if light == Vec3::ZERO {
            return;
        }
        let light = self.limited(self.depth + 1, path.throughput * light);
        let ray = Ray { origin: vertex.point.leave(direction), direction, t_max: distance };
        self.connections.push(Connection {
            path: index,
            part: Part::Indirect,
            light,
            ray,
            passing: Passing {
                ends: [Some(itself(&vertex.point.hit)), target],
                key: path.key(self.depth) + 2,
            },
        });
    }

    /// Scattered light held to the limit; what the receiver sees itself is left alone. A value that
    /// is not a number would spoil a whole field, so it counts as nothing.
    fn limited(&self, scattered: u32, light: Vec3) -> Vec3 {
        if !light.is_finite() {
            return Vec3::ZERO;
        }
        let y = luminance(light);
        if scattered == 0 || y <= self.limits.clamp {
            light
        } else {
            light * (self.limits.clamp / y)
        }
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

    /// What it scatters of a field's light. Negative lobes of the field are kept: cut off here, light
    /// would be added at every bounce.
    fn scatter_field(&self, field: &LightField, sampler: &mut Sampler) -> Vec3 {
        let Some((next, weight)) = self.scatter(sampler) else { return Vec3::ZERO };
        let direction = next.ray.direction;
        let normal = self.frame.z_axis;
        let side = normal * 1.0f32.copysign(normal.dot(direction));
        let arriving = field.sample(self.point.position, side);
        arriving.map_or(Vec3::ZERO, |light| weight * light.radiance(direction))
    }

    /// Whether shading normal and triangle agree on which side a direction is; where they do not,
    /// light would shine through the surface. The renderer that [`MaterialModel::Lambert`] is to
    /// be compared with does not ask.
    fn on_side(&self, local: Vec3, world: Vec3) -> bool {
        self.model == MaterialModel::Lambert
            || (local.z > 0.0) == (world.dot(self.point.normal) > 0.0)
    }
}
