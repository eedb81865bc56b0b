//! Light sources, and how they are sampled (next-event estimation).
//!
//! Every vertex of a path samples two sources. One is a punctual light ([`punctual`]). The other is
//! a point of an emissive triangle ([`emitters`]) or a direction of an environment picture
//! ([`environment`]). Rays that the BSDF chose also meet these areas and punctual lights with a
//! size. The power heuristic weighs the two ways of finding them. Constant and gradient
//! environments are left to BSDF rays, which sample them as well.

pub(crate) mod emission;
pub(crate) mod emitters;
pub(crate) mod environment;
pub(crate) mod punctual;
#[cfg(test)]
mod tests;

use glam::{Vec2, Vec3};

use emitters::Emitters;
use environment::Sky;
use punctual::Punctual;

/// All light sources of a snapshot.
#[derive(Debug)]
pub(crate) struct Lights {
    pub(crate) punctual: Punctual,
    pub(crate) emitters: Emitters,
    pub(crate) sky: Sky,
}

/// A sampled direction towards an emissive triangle or the environment.
#[derive(Clone, Copy, Debug)]
pub(crate) enum AreaSample {
    /// A point of an emissive triangle.
    Emitter(emitters::EmitterSample),
    /// A direction of the environment; radiance and density per steradian.
    Sky { direction: Vec3, radiance: Vec3, pdf: f32 },
}

impl Lights {
    /// Whether no ray can meet a source: nothing emits, the environment is black, and no punctual
    /// light has a size.
    pub(crate) fn are_points(&self) -> bool {
        self.emitters.is_empty()
            && !self.punctual.have_size()
            && matches!(self.sky, Sky::Constant(radiance) if radiance == Vec3::ZERO)
    }

    /// Whether [`Lights::sample_area`] can find a source.
    pub(crate) fn are_sampled(&self) -> bool {
        self.sky.is_sampled() || !self.emitters.is_empty()
    }

    /// Probability that an area sample is of the environment.
    fn sky_chance(&self) -> f32 {
        match (self.sky.is_sampled(), self.emitters.is_empty()) {
            (true, true) => 1.0,
            (true, false) => 0.5,
            (false, _) => 0.0,
        }
    }

    /// Samples a point of an emissive triangle or a direction of the environment. Densities include
    /// the choice between the two.
    pub(crate) fn sample_area(&self, from: Vec3, choice: f32, u: Vec2) -> Option<AreaSample> {
        let sky = self.sky_chance();
        if choice < sky {
            let (direction, radiance, pdf) = self.sky.sample(u)?;
            return Some(AreaSample::Sky { direction, radiance, pdf: pdf * sky });
        }
        let choice = (choice - sky) / (1.0 - sky);
        let mut sample = self.emitters.sample(from, choice, u)?;
        sample.pdf *= 1.0 - sky;
        Some(AreaSample::Emitter(sample))
    }

    /// Density per steradian with which [`Lights::sample_area`] samples a direction of the
    /// environment.
    pub(crate) fn sky_pdf(&self, direction: Vec3) -> f32 {
        self.sky.pdf(direction) * self.sky_chance()
    }

    /// Density per steradian with which it samples a point of an emissive triangle, as seen from
    /// `from`.
    pub(crate) fn emitter_pdf(&self, emitter: u32, from: Vec3, position: Vec3) -> f32 {
        self.emitters.pdf(emitter, from, position) * (1.0 - self.sky_chance())
    }
}
