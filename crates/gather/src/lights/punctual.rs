//! Point, spot and directional lights as KHR_lights_punctual defines them, some with a size.
//!
//! A light with a size is seen as a disc of half-angle a with constant radiance L. For a sphere of
//! radius r at distance d, sin a = r/d. A surface that faces the disc receives E = π L sin² a, as
//! it would from a point light. Directions are chosen uniformly in the cone. Its solid angle is Ω =
//! 2π(1 − cos a) (Pharr, Jakob and Humphreys 2023, section 6.2.4). Each direction contributes L Ω =
//! 2E/(1 + cos a), which for a = 0 is the point light's E. No nearly equal numbers are subtracted,
//! so small discs such as the sun's keep their precision.
//!
//! Rays that the BSDF chose also meet such a disc; a mirror could not show it otherwise. A vertex
//! chooses its light by what it scatters of all of them, so the density of that choice is unknown.
//! The weights do not need it: they only have to sum to one at every direction (Veach 1997, section
//! 9.2.1). They do, since both compare the density *within* the cone, 1/Ω, with the BSDF's. So the
//! weights are those of a scene with this light alone.
//!
//! Lights with a size cost one more ray at the end of every path than points do. They also cost a
//! test of every scattered ray against each of them.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};
use lumencast_scene::{LightKind, PlacedLight};

use crate::accel::Ray;
use crate::bsdf::{Scatter, frame};
use crate::numbers::numbers;
use crate::sampling::{Table, luminance, power_heuristic, turned};

/// Up to this number of lights, a vertex evaluates all before it chooses one.
pub(crate) const CANDIDATES: usize = 16;

/// Unoccluded light that arrives from a punctual light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Incident {
    /// Towards the light's centre, or a point of it; unit.
    pub(crate) direction: Vec3,
    /// Metres; infinite for directional lights.
    pub(crate) distance: f32,
    /// Illuminance on a surface that faces the light, lux.
    pub(crate) irradiance: Vec3,
    /// Sine of the half-angle of the light's disc; 0 for a point.
    sine: f32,
}

impl Incident {
    /// cos a, of the half-angle a.
    #[inline(always)]
    fn cosine(&self) -> f32 {
        ((1.0 - self.sine) * (1.0 + self.sine)).sqrt()
    }

    /// 1 − cos a: the height of the disc's spherical cap.
    #[inline(always)]
    pub(super) fn height(&self) -> f32 {
        self.sine * self.sine / (1.0 + self.cosine())
    }

    /// Density per steradian of [`Incident::toward`]; infinite for a point.
    #[inline(always)]
    fn pdf(&self) -> f32 {
        1.0 / (TAU * self.height())
    }

    /// Radiance of the disc, cd/m².
    pub(super) fn radiance(&self) -> Vec3 {
        self.irradiance * FRAC_1_PI / self.sine / self.sine
    }

    /// Distance in metres to the nearest point of the sphere, along a direction at an angle to its
    /// centre whose sine is `sine`.
    #[inline(always)]
    fn distance_at(&self, sine: f32) -> f32 {
        if self.distance.is_infinite() {
            return f32::INFINITY;
        }
        let half_chord = (self.sine * self.sine - sine * sine).max(0.0).sqrt();
        let middle = (1.0 - sine * sine).max(0.0).sqrt();
        self.distance * (middle - half_chord).max(0.0)
    }

    /// A point of the disc, chosen uniformly by solid angle. Its `irradiance` is the estimate of
    /// the whole disc's.
    #[inline(always)]
    pub(super) fn toward(&self, u: Vec2) -> Self {
        let height = u.x * self.height();
        let sine = (height * (2.0 - height)).max(0.0).sqrt();
        let local = (sine * turned(u.y)).extend(1.0 - height);
        Self {
            direction: (frame(self.direction) * local).normalize(),
            distance: self.distance_at(sine),
            irradiance: self.irradiance * (2.0 / (1.0 + self.cosine())),
            sine: 0.0,
        }
    }

    /// Distance in metres to the disc along a direction; `None` where the direction misses it.
    pub(super) fn met(&self, direction: Vec3) -> Option<f32> {
        // The cosine of a small angle is imprecise, so this compares sines.
        let sine = self.direction.cross(direction).length();
        (sine < self.sine && self.direction.dot(direction) > 0.0).then(|| self.distance_at(sine))
    }
}

/// A light with all values that do not depend on the receiving point precomputed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    position: Vec3,
    /// Direction along which it shines; unit.
    direction: Vec3,
    /// Candela; lux for a directional light.
    intensity: Vec3,
    /// Metres; infinite for unlimited range.
    range: f32,
    /// Scale and offset of the spot's falloff by the cosine of the angle from its axis; 0 and 1 for
    /// other lights.
    cone: [f32; 2],
    /// Radius in metres; for a directional light, the sine of its disc's half-angle.
    size: f32,
    is_directional: bool,
}

numbers!(Source of f32 { position: Vec3, direction: Vec3, intensity: Vec3, range: f32, cone: pair, size: f32, is_directional: bool });

impl Source {
    pub(crate) fn new(placed: &PlacedLight) -> Self {
        let light = &placed.light;
        let (size, cone) = match light.kind {
            LightKind::Point { radius } => (radius, [0.0, 1.0]),
            LightKind::Spot { inner, outer, radius } => {
                let scale = 1.0 / (inner.cos() - outer.cos()).max(0.001);
                (radius, [scale, -outer.cos() * scale])
            }
            LightKind::Directional { angle } => ((0.5 * angle).sin(), [0.0, 1.0]),
        };
        Self {
            position: placed.position,
            direction: placed.direction,
            intensity: light.color * light.intensity,
            range: light.range.unwrap_or(f32::INFINITY),
            cone,
            size,
            is_directional: matches!(light.kind, LightKind::Directional { .. }),
        }
    }

    /// Direction along which it shines; unit.
    pub(crate) fn direction(&self) -> Vec3 {
        self.direction
    }

    /// Light that arrives at a point; `None` where there is none.
    #[inline(always)]
    pub(crate) fn incident(&self, at: Vec3) -> Option<Incident> {
        if self.is_directional {
            return Some(Incident {
                direction: -self.direction,
                distance: f32::INFINITY,
                irradiance: self.intensity,
                sine: self.size,
            });
        }
        let to_light = self.position - at;
        let distance = to_light.length();
        let direction = to_light.try_normalize()?;
        let falloff = self.window(distance) * self.cone(direction.dot(-self.direction));
        // Inside the sphere the light is as bright as on its surface.
        let outside = distance.max(self.size);
        // It divides twice, since the square of a small distance may underflow.
        let irradiance = self.intensity * falloff / outside / outside;
        (falloff > 0.0 && irradiance.is_finite()).then_some(Incident {
            direction,
            distance,
            irradiance,
            sine: self.size / outside,
        })
    }

    /// max(min(1 − (d/range)⁴, 1), 0).
    #[inline(always)]
    fn window(&self, distance: f32) -> f32 {
        let share = distance / self.range;
        let square = share * share;
        (1.0 - square * square).clamp(0.0, 1.0)
    }

    /// The spot's falloff at the cosine of the angle from its axis; 1 for point lights.
    #[inline(always)]
    fn cone(&self, cos: f32) -> f32 {
        let t = (cos * self.cone[0] + self.cone[1]).clamp(0.0, 1.0);
        t * t
    }

    /// The light as seen from a point, where it stands for `copies` lights. For a light with a
    /// size, `on_disc` chooses one point of it.
    #[inline(always)]
    pub(crate) fn point_for(&self, at: Vec3, copies: f32, on_disc: Vec2) -> LightPoint {
        let Some(incident) = self.incident(at) else { return LightPoint::NONE };
        let (incident, pdf) = if incident.sine > 0.0 {
            (incident.toward(on_disc), incident.pdf())
        } else {
            (incident, f32::INFINITY)
        };
        let Incident { direction, distance, irradiance, .. } = incident;
        LightPoint { direction, distance, irradiance: copies * irradiance, pdf }
    }
}

/// A light, or a point of it, as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightPoint {
    /// Unit.
    pub(crate) direction: Vec3,
    distance: f32,
    irradiance: Vec3,
    /// Density per steradian of the direction; infinite for a point light.
    pdf: f32,
}

impl LightPoint {
    const NONE: Self =
        Self { direction: Vec3::Z, distance: 0.0, irradiance: Vec3::ZERO, pdf: f32::INFINITY };

    /// The candidate for a surface whose scattering towards this light is `scatter`.
    #[inline(always)]
    pub(crate) fn scattered(self, scatter: Scatter) -> Candidate {
        let share = power_heuristic(self.pdf, scatter.pdf);
        let light = scatter.value * self.irradiance * share;
        Candidate { direction: self.direction, distance: self.distance, light }
    }
}

/// A light that a vertex may cast a shadow ray to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    /// Towards the light; unit.
    pub(crate) direction: Vec3,
    /// Metres; infinite for directional lights.
    pub(crate) distance: f32,
    /// Scattered light of it, cd/m², if nothing is in between.
    pub(crate) light: Vec3,
}

numbers!(Candidate of f32 { direction: Vec3, distance: f32, light: Vec3 });

/// The punctual lights of a snapshot.
#[derive(Debug)]
pub(crate) struct Punctual {
    sources: Vec<Source>,
    by_power: Table,
    /// Indices and copies of the lights with a size.
    sized: Vec<(usize, Source)>,
}

impl Punctual {
    /// Unit directions towards the directional lights without a size: all shadow rays to one of
    /// them are parallel.
    pub(crate) fn directions(&self) -> impl Iterator<Item = Vec3> + '_ {
        let far = self.sources.iter().filter(|source| source.is_directional && source.size == 0.0);
        far.map(|source| -source.direction)
    }

    /// Prepares the lights. `scene_radius` (metres) turns the lux of directional lights into a
    /// power.
    pub(crate) fn new(lights: &[PlacedLight], scene_radius: f32) -> Self {
        let by_power = Table::new(lights.iter().map(|placed| {
            let reach = match placed.light.kind {
                LightKind::Directional { .. } => scene_radius * scene_radius,
                _ => 4.0,
            };
            luminance(placed.light.color) * placed.light.intensity * reach
        }));
        let sources: Vec<_> = lights.iter().map(Source::new).collect();
        let sized = sources.iter().copied().enumerate();
        let sized = sized.filter(|(_, source)| source.size > 0.0).collect();
        Self { sources, by_power, sized }
    }

    /// Whether any light has a size, so that rays can meet it.
    pub(crate) fn have_size(&self) -> bool {
        !self.sized.is_empty()
    }

    /// Radiance of the discs that a ray meets before `end` metres, weighed against
    /// [`Punctual::choose`]. `pdf` is the density with which the BSDF chose the ray. `weight` gives
    /// a further factor for a light, by its index.
    pub(crate) fn met(
        &self,
        at: Vec3,
        direction: Vec3,
        end: f32,
        pdf: f32,
        weight: impl Fn(usize) -> f32,
    ) -> Vec3 {
        let light = |(number, source): &(usize, Source)| {
            let disc = source.incident(at)?;
            let before = |distance| Ray::end_before(distance) <= end;
            let is_met = disc.met(direction).is_some_and(before);
            let weight = || weight(*number) * power_heuristic(pdf, disc.pdf());
            is_met.then(|| weight() * disc.radiance())
        };
        self.sized.iter().filter_map(light).filter(|light| light.is_finite()).sum()
    }

    /// Number of lights that a vertex evaluates before it chooses one: all, or [`CANDIDATES`] where
    /// there are more.
    #[inline]
    pub(crate) fn candidates(&self) -> usize {
        if self.by_power.is_empty() { 0 } else { self.sources.len().min(CANDIDATES) }
    }

    /// The light that is candidate `k` of every vertex. `None` where there are more than
    /// [`CANDIDATES`] lights, so that each vertex has other candidates.
    #[inline]
    pub(crate) fn shared_candidate(&self, k: usize) -> Option<&Source> {
        if self.sources.len() <= CANDIDATES { self.sources.get(k) } else { None }
    }

    /// The light that is a vertex's candidate `k`, and how many lights it stands for.
    pub(crate) fn candidate(&self, k: usize, u: f32) -> (&Source, f32) {
        if let Some(source) = self.shared_candidate(k) {
            return (source, 1.0);
        }
        let (index, p, _) = self.by_power.choose((k as f32 + u) / CANDIDATES as f32);
        (&self.sources[index], 1.0 / (p * CANDIDATES as f32))
    }

    /// Chooses one of the candidates with probability in proportion to its luminance. Returns its
    /// index and the inverse of that probability. `u` is the number that the candidates were chosen
    /// with.
    #[inline]
    pub(crate) fn pick(
        &self,
        u: f32,
        luminances: impl Iterator<Item = f32> + Clone,
    ) -> Option<(usize, f32)> {
        if self.sources.len() == 1 {
            return luminances
                .take(1)
                .next()
                .filter(|&luminance| luminance > 0.0)
                .map(|_| (0, 1.0));
        }
        let shining = luminances.enumerate().filter(|(_, luminance)| *luminance > 0.0);
        let total: f32 = shining.clone().map(|(_, luminance)| luminance).sum();
        // Choosing the candidates has used up the digits of u, so it is hashed.
        let u = if self.sources.len() <= CANDIDATES {
            u
        } else {
            crate::sampling::unit(crate::sampling::mix(u64::from(u.to_bits())) as u32)
        };
        let mut rest = u * total;
        let mut last = None;
        for (k, luminance) in shining {
            last = Some((k, total / luminance));
            rest -= luminance;
            if rest < 0.0 {
                break;
            }
        }
        last
    }

    /// Chooses a light in proportion to what `scatter` makes of its unoccluded light at this point.
    /// Returns its place and its scattered light over the probability of the choice. Where there
    /// are many lights, it chooses among a few that were drawn by power (resampled importance
    /// sampling, Talbot et al. 2005), which is still unbiased. For a light with a size, `on_disc`
    /// chooses one point of it.
    ///
    /// [`crate::path_trace`] does the same for many vertices at once, step by step.
    pub(crate) fn choose(
        &self,
        at: Vec3,
        u: f32,
        on_disc: Vec2,
        scatter: impl Fn(Vec3) -> Scatter,
    ) -> Option<Candidate> {
        let candidate = |k| {
            let (source, copies) = self.candidate(k, u);
            let point = source.point_for(at, copies, on_disc);
            point.scattered(scatter(point.direction))
        };
        let found: Vec<_> = (0..self.candidates()).map(candidate).collect();
        let (k, scale) = self.pick(u, found.iter().map(|c| luminance(c.light)))?;
        Some(Candidate { light: found[k].light * scale, ..found[k] })
    }
}
