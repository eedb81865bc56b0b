//! Shading: the steps at the hits of paths.
//!
//! Each step is taken for a group of vertices before the next. First its inputs are looked up
//! vertex by vertex. Then a vectorised loop over the group computes it.

use glam::Vec3;
use lumencast_light::{Light, Place};

use super::beam::{Found, Lit};
use super::columns::{Columns, GROUP};
use super::paths::{Connection, Part, Path, Paths, Segment, Start};
use super::vertex::{Scattered, Vertices};
use crate::accel::{Hit, Ray};
use crate::bsdf::Scatter;
use crate::lights::AreaSample;
use crate::lights::punctual::{CANDIDATES, Candidate, Source};
use crate::sampling::{Draw, Sampler, luminance, power_heuristic};
use crate::surface::{Bump, Frames, HitPoint, Spot, Triangle, interpolate};
use crate::world::{Passing, World, itself};

/// A surface that a path has met.
#[derive(Clone, Copy)]
struct Met<'a> {
    /// Index of the path.
    index: u32,
    hit: Hit,
    triangle: Triangle<'a>,
}

/// Vertices that are shaded together. Columns also hold values for absent vertices; results for
/// those are ignored.
#[derive(Default)]
pub(super) struct Group<'a> {
    met: Vec<Met<'a>>,
    spots: Vec<Spot<'a>>,
    /// Whether each path continues.
    going: [bool; GROUP],
    /// The instances whose frames are in the columns. They stay from group to group.
    instances: [Option<u32>; GROUP],
    vertices: Vertices,
    /// The corners of each triangle, object space.
    corners: Columns<9>,
    /// The vertex normals at each point, object space.
    vertex_normals: Columns<3>,
    /// Barycentric weights of the second and third corner.
    weights: Columns<2>,
    frames: Columns<{ Frames::NUMBERS }>,
    bumps: Columns<{ Bump::NUMBERS }>,
    draws: [Columns<{ Draw::NUMBERS }, u32>; 2],
    numbers: Columns<1>,
    squares: Columns<2>,
    sources: Columns<{ Source::NUMBERS }>,
    copies: Columns<1>,
    candidates: [Columns<{ Candidate::NUMBERS }>; CANDIDATES],
    directions: Columns<3>,
}

/// Shades the hits of paths at one depth.
pub(super) struct Shader<'s, 'a> {
    pub(super) world: &'a World,
    pub(super) limits: &'s Paths<'a>,
    /// Number of scattering events so far.
    pub(super) depth: u32,
    pub(super) paths: &'s mut [Path],
    /// A point that the beam lights for each path.
    pub(super) lit: &'s [Option<Lit>],
    /// Shadow rays to trace, with their light.
    pub(super) connections: &'s mut Vec<Connection>,
    /// Connections to the light to learn of, with their origins.
    pub(super) noted: &'s mut Vec<(u32, Found)>,
    pub(super) group: &'s mut Group<'a>,
}

impl Shader<'_, '_> {
    /// Adds the light that a path sees from discs and the environment, and puts the hit surface
    /// into the group.
    #[inline(always)]
    pub(super) fn arrive(&mut self, index: u32, hit: Option<Hit>) {
        let (world, depth) = (self.world, self.depth);
        if depth > 0 && world.lights.punctual.have_size() {
            let end = hit.map_or(f32::INFINITY, |hit| hit.t);
            let path = &self.paths[index as usize];
            let discs = path.throughput * self.discs(&path.segment, end);
            let discs = self.limited(depth, discs);
            self.paths[index as usize].seen.add(Part::after(depth - 1), discs);
        }
        let Some(hit) = hit else {
            let path = &self.paths[index as usize];
            let sky = self.limited(depth, path.throughput * self.sky(&path.segment));
            return self.paths[index as usize].seen.add(Part::after(depth), sky);
        };
        let triangle = world.triangle(&hit);
        triangle.fetch_vertices();
        self.group.met.push(Met { index, hit, triangle });
    }

    /// Whether the group is full.
    #[inline(always)]
    pub(super) fn is_ready(&self) -> bool {
        self.group.met.len() == GROUP
    }

    /// Shades the group and empties it. It adds emission, notes shadow rays and turns the rays of
    /// continuing paths, for which it calls `goes_on`.
    #[inline(always)]
    pub(super) fn shade(&mut self, mut goes_on: impl FnMut(u32)) {
        self.find_places();
        self.add_emission();
        let previous = self.limits.previous;
        let is_last = self.depth == self.limits.bounces;
        if !is_last || previous.is_some() {
            self.find_scattering();
            self.reach_for_punctual(is_last);
            if let Some(light) = previous.filter(|_| is_last) {
                self.add_known(light);
            } else {
                self.go_on();
            }
        }
        if !is_last {
            let going = self.group.met.iter().zip(self.group.going).filter(|(_, going)| *going);
            going.for_each(|(met, _)| goes_on(met.index));
        }
        self.group.met.clear();
    }

    /// Reaches for area lights and lit points, and chooses the next ray.
    #[inline(always)]
    fn go_on(&mut self) {
        let are_points = self.world.lights.are_points();
        if !are_points {
            self.reach_for_area();
        }
        if self.limits.shortcuts.beam.is_some() && self.depth + 2 <= self.limits.bounces {
            self.reach_for_lit();
        }
        let only_sources = self.depth + 1 == self.limits.bounces && self.limits.previous.is_none();
        if only_sources && are_points {
            self.group.going = [false; GROUP];
        } else {
            self.scatter();
        }
    }

    /// Computes positions and normals of the group's hits.
    #[inline(always)]
    fn find_places(&mut self) {
        let Self { world, group, paths, .. } = self;
        let Group {
            met,
            spots,
            going,
            instances,
            vertices,
            corners,
            weights,
            frames,
            vertex_normals,
            ..
        } = &mut **group;
        spots.clear();
        for (vertex, Met { index, hit, triangle }) in met.iter().enumerate().take(GROUP) {
            corners.set(vertex, bytemuck::cast(triangle.positions()));
            weights.set(vertex, [hit.u, hit.v]);
            let normal = interpolate(triangle.normals(), hit.weights());
            vertex_normals.set(vertex, normal.to_array());
            if instances[vertex] != Some(hit.instance) {
                instances[vertex] = Some(hit.instance);
                frames.set(vertex, world.frames(hit.instance).to_array());
            }
            let view = -paths[*index as usize].segment.ray.direction;
            vertices.views.set(vertex, view.to_array());
            let material = world.material(hit.instance, hit.primitive);
            let spot = triangle.at(material, hit.weights());
            spot.fetch_texels(world.model);
            spots.push(spot);
        }
        for vertex in 0..GROUP {
            let [u, v] = weights.get(vertex);
            let place = HitPoint::new(
                &Frames::from_array(frames.get(vertex)),
                bytemuck::cast(corners.get(vertex)),
                Vec3::new(1.0 - u - v, u, v),
                -Vec3::from(vertices.views.get(vertex)),
            );
            vertices.places.set(vertex, place.to_array());
        }
        // Triangles so thin that they have no normal end the path.
        *going = std::array::from_fn(|vertex| vertices.place(vertex).normal != Vec3::ZERO);
    }

    /// Adds the surfaces' emission, and records the first surface of a path.
    #[inline(always)]
    fn add_emission(&mut self) {
        let (world, depth) = (self.world, self.depth);
        for vertex in 0..self.group.met.len().min(GROUP) {
            let (Met { index, hit, .. }, spot) = (self.group.met[vertex], self.group.spots[vertex]);
            if !self.group.going[vertex] {
                continue;
            }
            let place = self.group.vertices.place(vertex);
            let front = place.is_front();
            let path = &mut self.paths[index as usize];
            if depth == 0 {
                path.seen.distance = hit.t;
                path.seen.normal = place.normal;
                path.seen.front = front;
                path.seen.culled = !front && !spot.material.double_sided;
            }
            let mut emitted = spot.emission_seen(front, world.model);
            path.seen.shines |= depth == 0 && emitted != Vec3::ZERO;
            if emitted == Vec3::ZERO {
                continue;
            }
            if let Some(emitter) = world.emitter(&hit) {
                let Segment { ray, pdf, .. } = &path.segment;
                let other = world.lights.emitter_pdf(emitter, ray.origin, place.position);
                emitted *= power_heuristic(*pdf, other);
            }
            let emitted = path.throughput * emitted;
            let emitted = self.limited(depth, emitted);
            self.paths[index as usize].seen.add(Part::after(depth), emitted);
        }
    }

    /// Computes the BSDFs; ends paths at surfaces without one.
    #[inline(always)]
    fn find_scattering(&mut self) {
        let model = self.world.model;
        let Group { spots, going, vertices, vertex_normals, frames, bumps, .. } = &mut *self.group;
        for (vertex, spot) in spots.iter().enumerate().take(GROUP) {
            let front = vertices.place(vertex).is_front();
            let Some(bsdf) = spot.bsdf(front, model) else {
                going[vertex] = false;
                continue;
            };
            vertices.bsdfs.set(vertex, bsdf.to_array());
            bumps.set(vertex, spot.bump(model).to_array());
        }
        for vertex in 0..GROUP {
            let normal = vertices.place(vertex).shading_normal(
                &Frames::from_array(frames.get(vertex)),
                vertex_normals.get(vertex).into(),
                &Bump::from_array(bumps.get(vertex)),
                vertices.views.get(vertex).into(),
            );
            vertices.normals.set(vertex, normal.to_array());
        }
    }

    /// Samples one punctual light for each vertex. No BSDF ray follows the last vertex of a path,
    /// so there the light's weight is one.
    #[inline(always)]
    fn reach_for_punctual(&mut self, is_last: bool) {
        let count = self.world.lights.punctual.candidates();
        self.draw_for_punctual();
        for k in 0..count {
            self.choose_source(k);
            self.weigh_candidate(k, is_last);
        }
        for vertex in 0..self.group.met.len().min(GROUP) {
            self.connect_to_punctual(vertex, count);
        }
    }

    /// Draws a number for each vertex and, where lights have a size, a point on the disc.
    #[inline(always)]
    fn draw_for_punctual(&mut self) {
        let sized = self.world.lights.punctual.have_size();
        self.draw(0, |sampler| sampler.draw());
        if sized {
            self.draw(1, |sampler| sampler.draw());
        }
        let Group { draws, numbers, squares, .. } = &mut *self.group;
        for vertex in 0..GROUP {
            numbers.set(vertex, [Draw::from_array(draws[0].get(vertex)).number()]);
            if sized {
                let square = Draw::from_array(draws[1].get(vertex)).square();
                squares.set(vertex, square.to_array());
            }
        }
    }

    /// Looks up each vertex's candidate light `k`.
    #[inline(always)]
    fn choose_source(&mut self, k: usize) {
        let lights = &self.world.lights.punctual;
        let Group { met, numbers, sources, copies, .. } = &mut *self.group;
        if let Some(source) = lights.shared_candidate(k) {
            sources.fill(source.to_array());
            copies.fill([1.0]);
        } else {
            for vertex in 0..met.len().min(GROUP) {
                let [u] = numbers.get(vertex);
                let (source, count) = lights.candidate(k, u);
                sources.set(vertex, source.to_array());
                copies.set(vertex, [count]);
            }
        }
    }

    /// Computes the light that each vertex scatters of candidate `k`.
    #[inline(always)]
    fn weigh_candidate(&mut self, k: usize, is_last: bool) {
        let model = self.world.model;
        let Group { vertices, squares, sources, copies, candidates, .. } = &mut *self.group;
        for vertex in 0..GROUP {
            let v = vertices.get(vertex);
            let [copies] = copies.get(vertex);
            let on_disc = squares.get(vertex).into();
            let source = Source::from_array(sources.get(vertex));
            let point = source.point_for(v.place.position, copies, on_disc);
            let found = v.eval(point.direction, model);
            let pdf = if is_last { 0.0 } else { found.pdf };
            let candidate = point.scattered(Scatter { pdf, ..found });
            candidates[k].set(vertex, candidate.to_array());
        }
    }

    /// Chooses one of a vertex's candidates by the light that it scatters of each, and connects to
    /// it.
    #[inline(always)]
    fn connect_to_punctual(&mut self, vertex: usize, count: usize) {
        let depth = self.depth;
        let Group { met, going, vertices, numbers, candidates, .. } = &*self.group;
        let Met { index, hit, .. } = met[vertex];
        let candidate = |k: usize| Candidate::from_array(candidates[k].get(vertex));
        let [u] = numbers.get(vertex);
        let luminances = (0..count).map(|k| luminance(candidate(k).light));
        let picked = self.world.lights.punctual.pick(u, luminances);
        let Some((k, scale)) = picked.filter(|_| going[vertex]) else { return };
        let Candidate { direction, distance, light } = candidate(k);
        let place = vertices.place(vertex);
        let path = &self.paths[index as usize];
        let mut light = path.throughput * (light * scale);
        if let Some(beam) = self.limits.shortcuts.beam.filter(|beam| beam.is_of(k)) {
            let chosen = path.segment.density_on(hit.t, place.normal);
            light *= beam.weight(place.position, place.normal, direction, chosen);
        }
        if depth > 0 && self.limits.shortcuts.learn == Some(k) {
            let found = Found { at: place.position, luminance: luminance(light) };
            self.noted.push((self.connections.len() as u32, found));
        }
        let light = self.limited(depth + 1, light);
        let key = path.key(depth) + 1;
        self.connections.push(Connection {
            path: index,
            part: Part::after(depth),
            light,
            ray: place.reach(direction, distance),
            passing: Passing { ends: [Some(itself(&hit)), None], key },
        });
    }

    /// Samples one point of an emissive triangle or of the environment for each vertex.
    #[inline(always)]
    fn reach_for_area(&mut self) {
        let (world, depth) = (self.world, self.depth);
        let mut samples = [None; GROUP];
        for vertex in 0..self.group.met.len().min(GROUP) {
            let Group { met, vertices, directions, .. } = &mut *self.group;
            let Met { index, .. } = met[vertex];
            let sampler = &mut self.paths[index as usize].sampler;
            let (choice, u) = (sampler.number(), sampler.square());
            let from = vertices.place(vertex).position;
            let Some(sample) = world.lights.sample_area(from, choice, u) else { continue };
            let to = AreaLight::new(&sample, from);
            directions.set(vertex, to.direction.to_array());
            samples[vertex] = Some((sample, to));
        }
        let scattered = self.group.vertices.eval(&self.group.directions, world.model);
        for (vertex, sample) in samples.iter().enumerate() {
            let Some((sample, to)) = sample else { continue };
            let Met { index, hit, .. } = self.group.met[vertex];
            let [r, g, b, other] = scattered.get(vertex);
            let value = Vec3::new(r, g, b);
            if !self.group.going[vertex] || value == Vec3::ZERO || !to.direction.is_finite() {
                continue;
            }
            let emitted = match sample {
                AreaSample::Sky { radiance, .. } => *radiance,
                AreaSample::Emitter(e) => world.emitted(e),
            };
            let light = value * emitted * (power_heuristic(to.pdf, other) / to.pdf);
            if light == Vec3::ZERO {
                continue;
            }
            let path = &self.paths[index as usize];
            let light = self.limited(depth + 1, path.throughput * light);
            let place = self.group.vertices.place(vertex);
            let key = path.key(depth) + 2;
            self.connections.push(Connection {
                path: index,
                part: Part::Indirect,
                light,
                ray: place.reach(to.direction, to.distance),
                passing: Passing { ends: [Some(itself(&hit)), to.target], key },
            });
        }
    }

    /// Connects each vertex to the point that the beam lights for its path.
    #[inline(always)]
    fn reach_for_lit(&mut self) {
        let (depth, model) = (self.depth, self.world.model);
        let Group { met, going, vertices, directions, .. } = &mut *self.group;
        let mut lit = [None; GROUP];
        for (vertex, met) in met.iter().enumerate().take(GROUP) {
            lit[vertex] = self.lit[met.index as usize].as_ref().filter(|_| going[vertex]);
            let Some(lit) = lit[vertex] else { continue };
            let to = lit.position() - vertices.place(vertex).position;
            directions.set(vertex, to.normalize_or_zero().to_array());
        }
        let scattered = vertices.eval(directions, model);
        for (vertex, lit) in lit.iter().enumerate() {
            let Some(lit) = lit else { continue };
            let Met { index, hit, .. } = self.group.met[vertex];
            let [r, g, b, pdf] = scattered.get(vertex);
            let (value, place) = (Vec3::new(r, g, b), self.group.vertices.place(vertex));
            if value == Vec3::ZERO || lit.itself == itself(&hit) {
                continue;
            }
            let direction = Vec3::from(self.group.directions.get(vertex));
            let Some(sent) = lit.toward(place.position, direction, pdf, model) else { continue };
            let path = &self.paths[index as usize];
            let light = self.limited(depth + 2, path.throughput * value * sent);
            let distance = place.position.distance(lit.position());
            let key = path.key(depth) + 3;
            self.connections.push(Connection {
                path: index,
                part: Part::Indirect,
                light,
                ray: place.reach(direction, distance),
                passing: Passing { ends: [Some(itself(&hit)), Some(lit.itself)], key },
            });
        }
    }

    /// Draws the numbers for the next rays and samples the rays.
    #[inline(always)]
    fn choose_rays(&mut self) -> Columns<{ Scattered::NUMBERS }> {
        self.draw(0, Sampler::draw);
        self.draw(1, Sampler::draw);
        let model = self.world.model;
        let Group { vertices, draws, .. } = &*self.group;
        let mut rays = Columns::default();
        for vertex in 0..GROUP {
            let draws = [0, 1].map(|n: usize| Draw::from_array(draws[n].get(vertex)));
            rays.set(vertex, vertices.get(vertex).scatter(draws, model).to_array());
        }
        rays
    }

    /// Turns the paths' rays to their next directions.
    #[inline(always)]
    fn scatter(&mut self) {
        let rays = self.choose_rays();
        let Group { met, going, vertices, .. } = &mut *self.group;
        for (vertex, met) in met.iter().enumerate().take(GROUP) {
            let Scattered { origin, direction, weight, pdf } =
                Scattered::from_array(rays.get(vertex));
            let going = &mut going[vertex];
            *going &= pdf > 0.0;
            let path = &mut self.paths[met.index as usize];
            let mut start = path.segment.start;
            if self.limits.shortcuts.beam.is_some() {
                let normal = vertices.place(vertex).normal;
                start = Start { normal, density: path.segment.density_on(met.hit.t, normal) };
            }
            path.throughput *= weight;
            if *going && self.depth + 1 >= self.limits.roulette_from {
                let survival = path.throughput.max_element().min(1.0);
                *going = path.sampler.number() < survival;
                path.throughput /= survival;
            }
            let ray = Ray { origin, direction, t_max: f32::INFINITY };
            path.segment = Segment { ray, from: Some(itself(&met.hit)), pdf, start };
        }
    }

    /// Adds what the last surfaces scatter of the previous light, and ends the paths. Negative
    /// lobes of fields are kept: clipping them would add light at every bounce.
    #[inline(always)]
    fn add_known(&mut self, light: &Light) {
        let rays = self.choose_rays();
        for vertex in 0..self.group.met.len().min(GROUP) {
            let Met { index, hit, .. } = self.group.met[vertex];
            let Scattered { direction, weight, pdf, .. } = Scattered::from_array(rays.get(vertex));
            if !self.group.going[vertex] || pdf <= 0.0 {
                continue;
            }
            let vertices = &self.group.vertices;
            let normal = Vec3::from(vertices.normals.get(vertex));
            let leaves = normal.dot(direction) >= 0.0;
            let side = if leaves { normal } else { -normal };
            let met = vertices.place(vertex);
            let at = met.position + self.world.origin();
            let on = self.world.on_triangle(&hit, leaves != met.is_front());
            let place = Place { position: at, normal: side, on: Some(on) };
            let Some(arriving) = light.radiance(&place, direction) else { continue };
            let path = &self.paths[index as usize];
            let scattered = path.throughput * (weight * arriving);
            let scattered = self.limited(self.depth + 1, scattered);
            self.paths[index as usize].seen.add_known(scattered);
        }
    }

    /// Draws from each path's sampler into one column of draws.
    #[inline(always)]
    fn draw(&mut self, to: usize, of: impl Fn(&mut Sampler) -> Draw) {
        let Group { met, draws, .. } = &mut *self.group;
        for (vertex, met) in met.iter().enumerate().take(GROUP) {
            draws[to].set(vertex, of(&mut self.paths[met.index as usize].sampler).to_array());
        }
    }

    /// Radiance of the discs of punctual lights that a scattered ray meets before `end` metres.
    fn discs(&self, segment: &Segment, end: f32) -> Vec3 {
        let Ray { origin, direction, .. } = segment.ray;
        let Start { normal, density } = segment.start;
        let beam = |light: usize| self.limits.shortcuts.beam.filter(|beam| beam.is_of(light));
        let weight = |light: usize| {
            beam(light).map_or(1.0, |beam| beam.weight(origin, normal, direction, density))
        };
        self.world.lights.punctual.met(origin, direction, end, segment.pdf, weight)
    }

    /// Radiance of the environment along a ray that left the scene.
    fn sky(&self, segment: &Segment) -> Vec3 {
        let direction = segment.ray.direction;
        let lights = &self.world.lights;
        let weight = power_heuristic(segment.pdf, lights.sky_pdf(direction));
        weight * lights.sky.radiance(direction)
    }

    /// Clamps light that was scattered `scattered` times. A value that is not finite would spoil a
    /// whole field, so it counts as zero.
    #[inline]
    fn limited(&self, scattered: u32, light: Vec3) -> Vec3 {
        if !light.is_finite() {
            #[cfg(test)]
            LOST.with(|lost| lost.set(lost.get() + 1));
            return Vec3::ZERO;
        }
        let y = luminance(light);
        if scattered < self.limits.clamp_from || y <= self.limits.clamp {
            light
        } else {
            light * (self.limits.clamp / y)
        }
    }
}

#[cfg(test)]
thread_local! {
    /// Number of values on this thread that were dropped because they were not finite.
    pub(super) static LOST: std::cell::Cell<u32> = const { std::cell::Cell::new(0) };
}

/// A sampled point of an emissive triangle or direction of the environment.
#[derive(Clone, Copy)]
struct AreaLight {
    /// Unit.
    direction: Vec3,
    /// Metres.
    distance: f32,
    /// Density per steradian.
    pdf: f32,
    /// The triangle; `None` for the environment.
    target: Option<(u32, u32, u32)>,
}

impl AreaLight {
    #[inline]
    fn new(sample: &AreaSample, from: Vec3) -> Self {
        match sample {
            AreaSample::Sky { direction, pdf, .. } => {
                Self { direction: *direction, distance: f32::INFINITY, pdf: *pdf, target: None }
            }
            AreaSample::Emitter(e) => {
                let to = e.position - from;
                let distance = to.length();
                let target = Some((e.instance, e.primitive, e.triangle));
                Self { direction: to / distance, distance, pdf: e.pdf, target }
            }
        }
    }
}
