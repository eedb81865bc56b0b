//! Samples of a receiver: their directions, their terms, and the sources that they reach for.
//!
//! Few directions meet a small lamp, which makes a receiver's light noisy. So each sample also
//! reaches for a point of an emissive triangle or of an environment picture, as vertices of paths
//! do. The power heuristic weighs the two ways of finding a source.

use std::f32::consts::PI;

use glam::{Mat3, Quat, Vec3};
use lumencast_light::{Order, sh, slope_by};

use super::paths::Look;
use crate::accel::Ray;
use crate::bsdf::frame;
use crate::sampling::{Sampler, cosine_hemisphere, lattice, power_heuristic, tilted_hemisphere};
use crate::surface::gamma;
use crate::world::{Passing, World};
use crate::{Budget, Draws, Job, Receiver, Shading};

/// Distance of samples' origins from the surface, as a share of the lumel's size.
const LIFT: f32 = 1e-3;

/// Values that all samples of a receiver share.
pub(super) struct Aim {
    place: Prepared,
    samples: u32,
    draws: Sequence,
    /// Whether there are sources to reach for.
    reaches: bool,
}

/// The random numbers of a receiver's samples.
struct Sequence {
    seed: u64,
    number: u32,
    /// Index of the first sample.
    first: u32,
}

impl Sequence {
    fn new(job: &Job, Budget { receiver, draws, .. }: Budget) -> Self {
        /// Keeps sequences that receivers share apart from their own.
        const SHARED: u64 = 0x0f_5e9e_4ce5;
        /// In place of a job's seed.
        const SAME: u64 = 0x5a3e;
        let (seed, number, first) = match draws {
            Draws::Own => (job.seed, receiver, 0),
            Draws::Shared { sequence, first } => (job.seed ^ SHARED, sequence, first),
            Draws::Same { sequence, first } => (SAME, sequence, first),
        };
        Self { seed, number, first }
    }

    /// The numbers of a sample; `apart` ones have nothing in common with others.
    fn sampler(&self, sample: u32, apart: u64) -> Sampler {
        Sampler::new(self.seed ^ apart, self.number, self.first.wrapping_add(sample))
    }
}

/// A source that a sample reaches for.
pub(super) struct Reach {
    /// The shadow ray to the source.
    pub(super) ray: Ray,
    pub(super) passing: Passing,
    /// Weighed radiance over the density of its choice.
    pub(super) light: Vec3,
}

enum Prepared {
    Probe {
        order: Order,
        position: Vec3,
        turn: Quat,
    },
    Lumel {
        /// The centre, lifted off the surface.
        position: Vec3,
        footprint: [Vec3; 2],
        /// World from the frame whose z is the normal.
        frame: Mat3,
        shading: Shading,
    },
}

impl Aim {
    /// Prepares a receiver of a job. Lumels are lifted off their surface by the bound of rounding.
    /// Surfaces are known to some ulps of their largest coordinate, receivers to an ulp of their
    /// world position.
    pub(super) fn new(job: &Job, budget: Budget, world: &World) -> Self {
        let Budget { receiver, samples, .. } = budget;
        let draws = Sequence::new(job, budget);
        let (extent, origin) = (world.extent(), world.origin());
        let asked = job.receivers[receiver as usize];
        let place = match asked {
            Receiver::Probe { position } => {
                let (position, turn) = (position - origin, lattice::turn(draws.seed, draws.number));
                Prepared::Probe { order: job.order, position, turn }
            }
            Receiver::Lumel { position, normal, footprint, shading } => {
                let normal = normal.normalize_or(Vec3::Y);
                let size = footprint[0].length().max(footprint[1].length());
                let position = position - origin;
                let lift = LIFT * size
                    + gamma(16.0) * extent.max(position.abs().max_element())
                    + gamma(2.0) * origin.abs().dot(normal.abs());
                Prepared::Lumel {
                    position: position + lift * normal,
                    footprint,
                    frame: frame(normal),
                    shading,
                }
            }
        };
        Self { place, samples, draws, reaches: world.lights.are_sampled() }
    }

    pub(super) fn look(&self, sample: u32) -> Look {
        let mut sampler = self.draws.sampler(sample, 0);
        let (origin, direction) = match &self.place {
            Prepared::Probe { position, turn, .. } => (*position, self.towards(turn, sample)),
            Prepared::Lumel { position, footprint: [a, b], frame, shading } => {
                let direction = match shading {
                    Shading::Own => frame * cosine_hemisphere(sampler.square()),
                    Shading::Tilted | Shading::By(_) => frame * tilted_hemisphere(sampler.square()),
                };
                let at = sampler.square() - 0.5;
                (position + at.x * a + at.y * b, direction.normalize())
            }
        };
        let pdf = if self.reaches { self.density(direction) } else { f32::INFINITY };
        Look { origin, direction, pdf, sampler }
    }

    /// The source that a sample reaches for. `None` where there are none, or the chosen one sends
    /// no light here.
    pub(super) fn reach(&self, sample: u32, world: &World) -> Option<Reach> {
        /// Separates these random numbers from those of the sample's path.
        const APART: u64 = 0x5ea7_1ab5;
        if !self.reaches {
            return None;
        }
        let origin = self.look(sample).origin;
        let mut sampler = self.draws.sampler(sample, APART);
        let source = world.source(origin, sampler.number(), sampler.square())?;
        let weight = power_heuristic(source.pdf, self.density(source.ray.direction)) / source.pdf;
        let light = source.radiance * weight;
        let is_seen = light.is_finite() && light != Vec3::ZERO;
        let passing = Passing { ends: [None, source.target], key: sampler.key() };
        is_seen.then_some(Reach { ray: source.ray, passing, light })
    }

    /// Density per steradian with which samples choose a direction.
    fn density(&self, direction: Vec3) -> f32 {
        let above = |frame: &Mat3| frame.z_axis.dot(direction);
        match &self.place {
            Prepared::Probe { .. } => 0.25 / PI,
            Prepared::Lumel { frame, shading: Shading::Own, .. } => above(frame).max(0.0) / PI,
            Prepared::Lumel { frame, .. } if above(frame) <= 0.0 => 0.0,
            Prepared::Lumel { frame, .. } => (0.5 * above(frame) + 0.25) / PI,
        }
    }

    /// Factors of radiance from a direction in the receiver's integral; the first
    /// [`Receiver::terms`] numbers count.
    pub(super) fn integrand(&self, direction: Vec3) -> [f32; sh::MAX_COEFFICIENTS] {
        let (normal, shading) = match &self.place {
            Prepared::Probe { order, .. } => return sh::basis(*order, direction),
            Prepared::Lumel { frame, shading, .. } => (frame.z_axis, shading),
        };
        let mut factors = [0.0; sh::MAX_COEFFICIENTS];
        let cosine = normal.dot(direction).max(0.0);
        match shading {
            Shading::Own => factors[0] = cosine,
            Shading::Tilted => {
                factors[0] = cosine;
                factors[1..4].copy_from_slice(&slope_by(direction, normal).to_array());
            }
            Shading::By(shading) if cosine > 0.0 => factors[0] = shading.dot(direction).max(0.0),
            Shading::By(_) => {}
        }
        factors
    }

    /// Factors of a sample's light: the integral's factors over the sample's density. The first
    /// [`Receiver::terms`] numbers count.
    pub(super) fn terms(&self, sample: u32) -> [f32; sh::MAX_COEFFICIENTS] {
        match &self.place {
            Prepared::Probe { order, turn, .. } => {
                sh::basis(*order, self.towards(turn, sample)).map(|y| 4.0 * PI * y)
            }
            Prepared::Lumel { shading: Shading::Own, .. } => [PI; sh::MAX_COEFFICIENTS],
            Prepared::Lumel { .. } => {
                let Look { direction, .. } = self.look(sample);
                let density = self.density(direction);
                self.integrand(direction).map(|factor| factor / density.max(f32::MIN_POSITIVE))
            }
        }
    }

    fn towards(&self, turn: &Quat, sample: u32) -> Vec3 {
        (*turn * lattice::direction(sample, self.samples)).normalize()
    }
}
