//! Rays of a directional light, traced to the points that they light. Paths connect to these
//! points.
//!
//! Where the sun comes in by a window, paths find its patches by chance only. Light that these
//! patches scatter is most of the room's light: most paths find none of it and a few find much. So
//! each path is given a point that a ray of the light has met, and connects every vertex to it.
//! This is the strategy of a bidirectional path tracer with two vertices on the light's side (Veach
//! 1997, chapter 10).
//!
//! The BSDF may also find such a point, which next-event estimation then lights. The power
//! heuristic weighs the two by the densities per area with which they choose the point. The density
//! of the light's rays is known everywhere: the density across the beam times the cosine at the
//! surface. Light that goes through a surface is left to the BSDF.
//!
//! A grid of densities spreads the light's rays. It is learned from the points that the first paths
//! of a picture found lit. A wrong grid causes noise but no bias: paths still find by themselves
//! what the rays do not reach.

use glam::{Mat3, Vec2, Vec3};
use lumencast_scene::{Aabb, LightKind};

use super::vertex::Scatterer;
use crate::accel::{Hit, Ray};
use crate::bsdf::{Scatter, frame};
use crate::lights::punctual::{LightPoint, Source};
use crate::sampling::{Grid2, Sampler, luminance, power_heuristic};
use crate::surface::{HitPoint, MaterialModel};
use crate::world::{Itself, World, itself};

/// Greatest number of cells along each side of the grid of densities.
const CELLS: f32 = 64.0;
/// Number of found points for each cell of the grid, on average.
const KNOWN: f32 = 4.0;
/// Share of the rays that is spread evenly over the grid.
const EVENLY: f32 = 0.05;
/// Margin of the grid around the found points on each side, as a share of its width.
const MARGIN: f32 = 0.02;

/// A point that a light has been seen to light, and the luminance that was seen there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Found {
    pub(crate) at: Vec3,
    pub(crate) luminance: f32,
}

/// The rays of a directional light.
#[derive(Clone, Debug)]
pub(crate) struct Beam {
    /// The light, and its index.
    source: Source,
    light: usize,
    /// Transform to the world from the frame whose z is the light's direction.
    frame: Mat3,
    /// Transform to that frame from the world.
    to_frame: Mat3,
    /// The z at which rays start, in that frame.
    start: f32,
    /// The rectangle that the rays cross: its lower corner and its size along x and y.
    low: Vec3,
    size: Vec2,
    /// Density of the rays over the rectangle, as a unit square.
    guide: Grid2,
}

/// A point that a ray of a beam has met.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lit {
    /// The triangle that it lies on.
    pub(super) itself: Itself,
    /// The surface, on the light's side.
    surface: Scatterer,
    /// The light that arrives along the ray.
    source: LightPoint,
    /// Density with which the point was chosen, per square metre of its surface.
    density: f32,
}

impl Beam {
    /// Index of the light to follow: the brightest directional one. `None` where lights are so many
    /// that vertices do not evaluate all.
    pub(crate) fn light(world: &World) -> Option<usize> {
        let lights = world.placed_lights().iter().enumerate();
        let suns = lights.filter(|(_, l)| matches!(l.light.kind, LightKind::Directional { .. }));
        let power = |intensity: f32, color: Vec3| intensity * luminance(color);
        let (light, _) = suns.max_by(|(_, a), (_, b)| {
            power(a.light.intensity, a.light.color)
                .total_cmp(&power(b.light.intensity, b.light.color))
        })?;
        world.lights.punctual.shared_candidate(light).map(|_| light)
    }

    /// Prepares the rays of a light, directed to the points that it was found to light. `None`
    /// without such points.
    pub(crate) fn new(world: &World, light: usize, found: &[Found]) -> Option<Self> {
        let source = *world.lights.punctual.shared_candidate(light)?;
        let frame = frame(source.direction());
        let to_frame = frame.transpose();
        let local = |at: Vec3| to_frame * at;
        let mut places = Aabb::EMPTY;
        found.iter().for_each(|found| places.grow(local(found.at)));
        if places.is_empty() {
            return None;
        }
        let (low, extent) = (places.min, (places.max - places.min).truncate());
        let margin = MARGIN * extent + 1e-4 * world.extent();
        // The rectangle lies amid the points, so the light's angular width matters little.
        let low = (low.truncate() - margin).extend(0.5 * (low.z + places.max.z));
        let size = extent + 2.0 * margin;
        let cells = (found.len() as f32 / KNOWN).sqrt().clamp(4.0, CELLS) as usize;
        let mut weights = vec![0.0; cells * cells];
        for Found { at, luminance } in found {
            let [x, y] = ((local(*at) - low).truncate() / size * cells as f32).to_array();
            let cell = |v: f32| (v as usize).min(cells - 1);
            weights[cell(y) * cells + cell(x)] += luminance;
        }
        let guide = Grid2::new(&spread(&weights, cells), cells);
        let bounds = world.accel().bounds();
        let bounds = Aabb { min: bounds.min.into(), max: bounds.max.into() };
        let start = bounds.transformed(local).min.z - 1e-3 * (1.0 + world.extent());
        (!guide.is_empty()).then_some(Self {
            source,
            light,
            frame,
            to_frame,
            start,
            low,
            size,
            guide,
        })
    }

    /// Whether it is the beam of this light.
    pub(super) fn is_of(&self, light: usize) -> bool {
        self.light == light
    }

    /// Samples a ray of the beam, and the light that arrives along it.
    pub(super) fn ray(&self, mut sampler: Sampler) -> (Ray, LightPoint) {
        let (at, _) = self.guide.sample(sampler.square());
        let source = self.source.point_for(Vec3::ZERO, 1.0, sampler.square());
        let crossed = self.frame * (self.low + (at * self.size).extend(0.0));
        let direction = -source.direction;
        let back = (self.start - self.low.z) / direction.dot(self.frame.z_axis);
        (Ray { origin: crossed + back * direction, direction, t_max: f32::INFINITY }, source)
    }

    /// The point that a ray of the beam has met; `None` where it scatters nothing.
    pub(super) fn lit(&self, world: &World, hit: &Hit, source: LightPoint) -> Option<Lit> {
        let surface = Scatterer::at(&world.point(hit, -source.direction)?, world.model)?;
        let HitPoint { position, normal, .. } = surface.place;
        let density = self.density(position, normal, source.direction);
        (density > 0.0).then_some(Lit { itself: itself(hit), surface, source, density })
    }

    /// Density per square metre of the beam's rays that come from `to_light`, on a surface with
    /// this unit normal; 0 on its other side.
    #[inline]
    fn density(&self, at: Vec3, normal: Vec3, to_light: Vec3) -> f32 {
        let direction = -to_light;
        let (cosine, facing) = (direction.dot(self.frame.z_axis), normal.dot(to_light));
        if cosine <= 0.0 || facing <= 0.0 {
            return 0.0;
        }
        let along = self.to_frame * direction;
        let from_low = self.to_frame * at - self.low;
        let place = (from_low - from_low.z / along.z * along).truncate() / self.size;
        if place.cmplt(Vec2::ZERO).any() || place.cmpgt(Vec2::ONE).any() {
            return 0.0;
        }
        self.guide.density(place) / (self.size.x * self.size.y) * (facing / cosine)
    }

    /// Weight of light that a path has found by itself, beside what connections to the beam bring.
    /// The point `at` has this unit normal on the path's side, and the light comes from `to_light`.
    /// `chosen` is the density per square metre with which the path chose the point.
    pub(super) fn weight(&self, at: Vec3, normal: Vec3, to_light: Vec3, chosen: f32) -> f32 {
        power_heuristic(chosen, self.density(at, normal, to_light))
    }
}

impl Lit {
    /// World position, relative to the snapshot's origin.
    #[inline]
    pub(super) fn position(&self) -> Vec3 {
        self.surface.place.position
    }

    /// Light that the point scatters to `from`, from where it lies in the unit `direction`, over
    /// the density of its choice. It is weighed against BSDF sampling, which chooses the direction
    /// with density `pdf`. `None` where there is none.
    #[inline]
    pub(super) fn toward(
        &self,
        from: Vec3,
        direction: Vec3,
        pdf: f32,
        model: MaterialModel,
    ) -> Option<Vec3> {
        let HitPoint { position, normal, .. } = self.surface.place;
        if direction.dot(normal) >= 0.0 {
            return None;
        }
        let per_area = solid_angle(direction, normal, from.distance_squared(position));
        let vertex = self.surface.seen_from(-direction);
        // `pdf` is 0 here since the weight below already covers BSDF sampling.
        let scatter = Scatter { pdf: 0.0, ..vertex.eval(self.source.direction, model) };
        let sent = self.source.scattered(scatter).light;
        let weight = power_heuristic(self.density, pdf * per_area);
        (sent != Vec3::ZERO).then(|| sent * (weight * per_area / self.density))
    }
}

/// Solid angle of a square metre with this unit normal, seen along a unit direction.
#[inline]
pub(super) fn solid_angle(direction: Vec3, normal: Vec3, distance_squared: f32) -> f32 {
    direction.dot(normal).abs() / distance_squared
}

/// Blurs the weights of a grid of this width over neighbours and adds an even share.
fn spread(weights: &[f32], width: usize) -> Vec<f32> {
    let even = EVENLY / (1.0 - EVENLY) * weights.iter().sum::<f32>() / weights.len() as f32;
    let near = |cell: usize| {
        let cells = cell.saturating_sub(1)..(cell + 2).min(width);
        cells.map(move |other| (other, if other == cell { 2.0 } else { 1.0 }))
    };
    let blurred = |row: usize, column: usize| {
        let all =
            near(row).flat_map(|(y, a)| near(column).map(move |(x, b)| (y * width + x, a * b)));
        let sum =
            |of: &dyn Fn(usize) -> f32| all.clone().map(|(n, share)| share * of(n)).sum::<f32>();
        sum(&|n| weights[n]) / sum(&|_| 1.0)
    };
    (0..weights.len()).map(|cell| blurred(cell / width, cell % width) + even).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{Kernel, Stacks};
    use crate::world::{Passing, WorldCache};
    use lumencast_scene::PunctualLight;
    use lumencast_testkit::scenes::{Stage, lambert};

    /// A slanted square under a sun of this angular diameter.
    fn world(angle: f32) -> World {
        let mut stage = Stage::default();
        let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
        stage.quad(Vec3::new(-1.0, -0.5, 1.0), 2.0 * Vec3::X, Vec3::new(0.0, 1.0, -2.0), grey);
        let kind = LightKind::Directional { angle };
        let light = PunctualLight { kind, color: Vec3::ONE, intensity: 2.0, range: None };
        stage.light(light, Vec3::ZERO, Vec3::new(0.3, -1.0, 0.2));
        let (kernel, cache) = (Kernel::detect(), &mut WorldCache::default());
        World::new(stage.snapshot(), MaterialModel::Full, kernel, cache)
    }

    /// The mean inverse of the points' stated densities is the area of the lit surface, less the
    /// parts that the beam does not know. That holds whatever the beam has learned.
    #[test]
    fn points_have_the_density_they_state() {
        for angle in [0.0, 0.4] {
            let world = world(angle);
            let area = 2.0 * 5.0_f32.sqrt();
            let places = (0..4000).map(|n| Sampler::new(3, 0, n).square() * 2.0 - 1.0);
            // More points are found in one corner.
            let found: Vec<_> = places
                .map(|p| Found { at: Vec3::new(p.x, -0.5 * p.y, p.y), luminance: 2.1 + p.x + p.y })
                .collect();
            let beam = Beam::new(&world, 0, &found).expect("it was found");
            let (mut stacks, count) = (Stacks::default(), 1 << 14);
            let rays: Vec<_> = (0..count).map(|n| beam.ray(Sampler::new(9, 0, n))).collect();
            let (mut sum, mut met) = (0.0, 0);
            let passing = |_| Passing { ends: [None; 2], key: 0 };
            let indexed = rays.iter().zip(0..).map(|((ray, _), n)| (*ray, n));
            world.closest(indexed, &mut stacks, passing, |n, hit| {
                let (ray, source) = rays[n as usize];
                assert!((ray.direction + source.direction).length() < 1e-6);
                let Some(hit) = hit else { return };
                sum += 1.0 / beam.lit(&world, &hit, source).expect("it was meant").density;
                met += 1;
            });
            let found = sum / count as f32;
            // At the edge of the beam, rays of a wide sun find less area.
            let least = if angle == 0.0 { 0.99 * area } else { 0.9 * area };
            assert!(found > least && found < 1.01 * area, "{angle}: {found} of {area} m²");
            assert!(met > count / 2, "{met}");
        }
    }

    #[test]
    fn what_was_never_found_is_not_followed() {
        let world = world(0.0);
        assert_eq!(Beam::light(&world), Some(0));
        assert!(Beam::new(&world, 0, &[]).is_none());
        let dark = [Found { at: Vec3::ZERO, luminance: 0.0 }];
        assert!(Beam::new(&world, 0, &dark).is_none());
        let one = [Found { at: Vec3::ZERO, luminance: 1.0 }];
        assert!(Beam::new(&world, 0, &one).is_some());
    }
}
