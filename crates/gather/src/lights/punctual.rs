//! Point, spot and directional lights, exactly as KHR_lights_punctual states them, with a size where
//! they have one.
//!
//! A light with a size is seen as a disc of half-angle a with the same radiance L all over: for a
//! sphere of radius r at distance d, sin a = r/d. What a surface receives that faces it,
//! E = π L sin² a, is what the light would send as a point. Directions are chosen uniformly in the
//! cone, of solid angle Ω = 2π(1 − cos a) (Pharr, Jakob and Humphreys 2023, section 6.2.4), and
//! contribute L Ω = 2E/(1 + cos a), which for a = 0 is the point light's E. No difference of nearly
//! equal numbers occurs, so the sun's disc and smaller ones keep their digits.
//!
//! Surfaces also meet such a disc by rays that the BSDF chose: a mirror could not show it otherwise.
//! Which light is asked at a vertex depends on what the vertex makes of all of them, so the density
//! of that choice cannot be stated; but it does not have to be. The two weights only have to sum to
//! one at every direction (Veach 1997, section 9.2.1), and they do when both compare the density
//! *within* the cone, 1/Ω, with the BSDF's: the weights are those of a scene with this light alone.
//!
//! Lights with a size cost a ray at the end of every path, which points do without, and a test of
//! every scattered ray against each of them.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};
use lumencast_scene::{Light, LightKind, PlacedLight};

use crate::bsdf::{Scatter, frame};
use crate::sampling::{Table, luminance, power_heuristic};

/// Up to so many lights are all looked at before one is chosen.
const CANDIDATES: usize = 16;

/// Light arriving from a punctual light, were nothing in between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Incident {
    /// Towards the light's middle, or a point of it; unit.
    pub(crate) direction: Vec3,
    /// Metres; infinite for directional lights.
    pub(crate) distance: f32,
    /// Illuminance on a surface that faces the light, lux.
    pub(crate) irradiance: Vec3,
    /// Sine of the half-angle that the light spans; 0 for a point.
    sine: f32,
}

impl Incident {
    /// cos a.
    fn cosine(&self) -> f32 {
        ((1.0 - self.sine) * (1.0 + self.sine)).sqrt()
    }

    /// 1 − cos a.
    pub(super) fn height(&self) -> f32 {
        self.sine * self.sine / (1.0 + self.cosine())
    }

    /// Density per steradian of [`Incident::toward`]; infinite for a point.
    fn pdf(&self) -> f32 {
        1.0 / (TAU * self.height())
    }

    /// Radiance of the disc, cd/m².
    pub(super) fn radiance(&self) -> Vec3 {
        self.irradiance * FRAC_1_PI / self.sine / self.sine
    }

    /// Metres to the nearest point of a sphere in a direction `sine` off its middle.
    fn distance_at(&self, sine: f32) -> f32 {
        if self.distance.is_infinite() {
            return f32::INFINITY;
        }
        let half_chord = (self.sine * self.sine - sine * sine).max(0.0).sqrt();
        let middle = (1.0 - sine * sine).max(0.0).sqrt();
        self.distance * (middle - half_chord).max(0.0)
    }

    /// A point of the disc, chosen uniformly by solid angle; its `irradiance` is what it stands for.
    pub(super) fn toward(&self, u: Vec2) -> Self {
        let height = u.x * self.height();
        let sine = (height * (2.0 - height)).max(0.0).sqrt();
        let local = (sine * Vec2::from_angle(TAU * u.y)).extend(1.0 - height);
        Self {
            direction: (frame(self.direction) * local).normalize(),
            distance: self.distance_at(sine),
            irradiance: self.irradiance * (2.0 / (1.0 + self.cosine())),
            sine: 0.0,
        }
    }

    /// Metres to the disc in a direction; `None` where that misses it.
    pub(super) fn met(&self, direction: Vec3) -> Option<f32> {
        // By the sine, since the cosine of a small angle has lost its digits.
        let sine = self.direction.cross(direction).length();
        (sine < self.sine && self.direction.dot(direction) > 0.0).then(|| self.distance_at(sine))
    }
}

/// What a point receives from a light.
pub(crate) fn incident(placed: &PlacedLight, at: Vec3) -> Option<Incident> {
    let light = &placed.light;
    let intensity = light.color * light.intensity;
    let radius = match light.kind {
        LightKind::Point { radius } | LightKind::Spot { radius, .. } => radius,
        LightKind::Directional { angle } => {
            return Some(Incident {
                direction: -placed.direction,
                distance: f32::INFINITY,
                irradiance: intensity,
                sine: if angle > 0.0 { (0.5 * angle).sin() } else { 0.0 },
            });
        }
    };
    let to_light = placed.position - at;
    let distance = to_light.length();
    let direction = to_light.try_normalize()?;
    let falloff = window(distance, light) * cone(direction.dot(-placed.direction), light);
    // Within the sphere it is as bright as on it.
    let outside = distance.max(radius);
    // In two steps, since the square of a small distance may vanish.
    let irradiance = intensity * falloff / outside / outside;
    (falloff > 0.0 && irradiance.is_finite()).then_some(Incident {
        direction,
        distance,
        irradiance,
        sine: radius / outside,
    })
}

/// max(min(1 − (d/range)⁴, 1), 0).
fn window(distance: f32, light: &Light) -> f32 {
    light.range.map_or(1.0, |range| (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0))
}

/// The spot's falloff at the cosine of the angle from its axis; 1 for point lights.
fn cone(cos: f32, light: &Light) -> f32 {
    let LightKind::Spot { inner, outer, .. } = light.kind else { return 1.0 };
    let scale = 1.0 / (inner.cos() - outer.cos()).max(0.001);
    let t = (cos * scale - outer.cos() * scale).clamp(0.0, 1.0);
    t * t
}

/// The punctual lights of a snapshot.
#[derive(Debug)]
pub(crate) struct Punctual {
    lights: Vec<PlacedLight>,
    by_power: Table,
    /// Those with a size.
    sized: Vec<PlacedLight>,
}

impl Punctual {
    /// `scene_radius` (metres) turns directional lights' lux into a power.
    pub(crate) fn new(lights: &[PlacedLight], scene_radius: f32) -> Self {
        let by_power = Table::new(lights.iter().map(|placed| {
            let reach = match placed.light.kind {
                LightKind::Directional { .. } => scene_radius * scene_radius,
                _ => 4.0,
            };
            luminance(placed.light.color) * placed.light.intensity * reach
        }));
        let has_size = |placed: &&PlacedLight| match placed.light.kind {
            LightKind::Point { radius } | LightKind::Spot { radius, .. } => radius > 0.0,
            LightKind::Directional { angle } => angle > 0.0,
        };
        let sized = lights.iter().filter(has_size).copied().collect();
        Self { lights: lights.to_vec(), by_power, sized }
    }

    /// Whether rays can meet a light.
    pub(crate) fn have_size(&self) -> bool {
        !self.sized.is_empty()
    }

    /// Radiance of the discs that a ray meets before `end`, weighed against [`Punctual::choose`];
    /// `pdf` is the density with which the BSDF chose the ray.
    pub(crate) fn met(&self, at: Vec3, direction: Vec3, end: f32, pdf: f32) -> Vec3 {
        let light = |placed: &PlacedLight| {
            let disc = incident(placed, at)?;
            let is_met = disc.met(direction).is_some_and(|distance| distance <= end);
            is_met.then(|| power_heuristic(pdf, disc.pdf()) * disc.radiance())
        };
        self.sized.iter().filter_map(light).filter(|light| light.is_finite()).sum()
    }

    /// Chooses a light in proportion to what `scatter` makes of it at this point, were nothing in
    /// between, and returns where it is and its scattered light over the probability of the choice.
    /// Where lights are many, the choice is among a few chosen by power (resampled importance
    /// sampling, Talbot et al. 2005), still unbiased. Of lights with a size one point counts, which
    /// `on_disc` chooses; it is not asked for others.
    pub(crate) fn choose(
        &self,
        at: Vec3,
        u: f32,
        on_disc: impl FnOnce() -> Vec2,
        scatter: impl Fn(Vec3) -> Scatter,
    ) -> Option<(Incident, Vec3)> {
        if self.by_power.is_empty() {
            return None;
        }
        let on_disc = if self.have_size() { on_disc() } else { Vec2::ZERO };
        let all = self.lights.len() <= CANDIDATES;
        let count = if all { self.lights.len() } else { CANDIDATES };
        let mut candidates = [None; CANDIDATES];
        let mut total = 0.0;
        for (k, candidate) in candidates.iter_mut().enumerate().take(count) {
            let (index, copies) = if all {
                (k, 1.0)
            } else {
                let (index, p, _) = self.by_power.choose((k as f32 + u) / count as f32);
                (index, 1.0 / (p * count as f32))
            };
            let Some(incident) = incident(&self.lights[index], at) else { continue };
            let (incident, density) = if incident.sine > 0.0 {
                (incident.toward(on_disc), incident.pdf())
            } else {
                (incident, f32::INFINITY)
            };
            let Scatter { value, pdf } = scatter(incident.direction);
            let share = power_heuristic(density, pdf);
            let light = value * incident.irradiance * (share * copies);
            let weight = luminance(light);
            if weight > 0.0 {
                if count == 1 {
                    return Some((incident, light));
                }
                total += weight;
                *candidate = Some((incident, light, weight));
            }
        }
        // Which one: the digits of u that stratified the candidates are used up.
        let mut rest = if all {
            u
        } else {
            crate::sampling::unit(crate::sampling::mix(u64::from(u.to_bits())) as u32)
        };
        rest *= total;
        let mut last = None;
        for (incident, light, weight) in candidates.iter().flatten() {
            last = Some((*incident, *light * (total / weight)));
            rest -= weight;
            if rest < 0.0 {
                break;
            }
        }
        last
    }
}
