//! Point, spot and directional lights, exactly as KHR_lights_punctual states them.

use glam::Vec3;
use lumencast_scene::{Light, LightKind, PlacedLight};

use crate::sampling::{Table, luminance};

/// Up to so many lights are all looked at before one is chosen.
const CANDIDATES: usize = 16;

/// Light arriving from a punctual light, were nothing in between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Incident {
    /// Towards the light, unit.
    pub(crate) direction: Vec3,
    /// Metres; infinite for directional lights.
    pub(crate) distance: f32,
    /// Illuminance on a surface that faces the light, lux.
    pub(crate) irradiance: Vec3,
}

/// What a point receives from a light.
pub(crate) fn incident(placed: &PlacedLight, at: Vec3) -> Option<Incident> {
    let light = &placed.light;
    let intensity = light.color * light.intensity;
    if light.kind == LightKind::Directional {
        return Some(Incident {
            direction: -placed.direction,
            distance: f32::INFINITY,
            irradiance: intensity,
        });
    }
    let to_light = placed.position - at;
    let distance = to_light.length();
    let direction = to_light.try_normalize()?;
    let falloff = window(distance, light) * cone(direction.dot(-placed.direction), light);
    // In two steps, since the square of a small distance may vanish.
    let irradiance = intensity * falloff / distance / distance;
    (falloff > 0.0 && irradiance.is_finite()).then_some(Incident {
        direction,
        distance,
        irradiance,
    })
}

/// max(min(1 − (d/range)⁴, 1), 0).
fn window(distance: f32, light: &Light) -> f32 {
    light.range.map_or(1.0, |range| (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0))
}

/// The spot's falloff at the cosine of the angle from its axis; 1 for point lights.
fn cone(cos: f32, light: &Light) -> f32 {
    let LightKind::Spot { inner, outer } = light.kind else { return 1.0 };
    let scale = 1.0 / (inner.cos() - outer.cos()).max(0.001);
    let t = (cos * scale - outer.cos() * scale).clamp(0.0, 1.0);
    t * t
}

/// The punctual lights of a snapshot.
#[derive(Debug)]
pub(crate) struct Punctual {
    lights: Vec<PlacedLight>,
    by_power: Table,
}

impl Punctual {
    /// `scene_radius` (metres) turns directional lights' lux into a power.
    pub(crate) fn new(lights: &[PlacedLight], scene_radius: f32) -> Self {
        let by_power = Table::new(lights.iter().map(|placed| {
            let reach = match placed.light.kind {
                LightKind::Directional => scene_radius * scene_radius,
                _ => 4.0,
            };
            luminance(placed.light.color) * placed.light.intensity * reach
        }));
        Self { lights: lights.to_vec(), by_power }
    }

    /// Chooses a light in proportion to what `reflected` makes of it at this point, were nothing in
    /// between, and returns where it is and its reflected light over the probability of the choice.
    /// Where lights are many, the choice is among a few chosen by power (resampled importance
    /// sampling, Talbot et al. 2005), still unbiased.
    pub(crate) fn choose(
        &self,
        at: Vec3,
        u: f32,
        reflected: impl Fn(Vec3) -> Vec3,
    ) -> Option<(Incident, Vec3)> {
        if self.by_power.is_empty() {
            return None;
        }
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
            let light = reflected(incident.direction) * incident.irradiance * copies;
            let weight = luminance(light);
            if weight > 0.0 {
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
        for (incident, light, weight) in candidates.into_iter().flatten() {
            last = Some((incident, light * (total / weight)));
            rest -= weight;
            if rest < 0.0 {
                break;
            }
        }
        last
    }
}
