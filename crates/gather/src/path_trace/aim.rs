//! A receiver's samples: where each looks, what its light is multiplied by, and which source it reaches
//! for.
//!
//! A small lamp is met by few directions, and fills a receiver's light with noise. So each sample also
//! reaches for a point of an emissive triangle, or of an environment picture, as a path's vertices do;
//! both ways of finding a source are weighed by the power heuristic.

use std::f32::consts::PI;

use glam::{Mat3, Quat, Vec3};
use lumencast_light::{Order, sh};

use super::paths::Look;
use crate::accel::Ray;
use crate::bsdf::frame;
use crate::sampling::{Sampler, cosine_hemisphere, lattice, power_heuristic};
use crate::surface::gamma;
use crate::world::{Passing, World};
use crate::{Budget, Job, Receiver};

/// Samples start so far off the surface, as a share of the lumel's size.
const LIFT: f32 = 1e-3;

/// What all samples of a receiver share.
pub(super) struct Aim {
    place: Prepared,
    samples: u32,
    seed: u64,
    receiver: u32,
    /// Whether there are sources to reach for.
    reaches: bool,
}

/// A source that a sample reaches for.
pub(super) struct Reach {
    /// Towards it, as far as nothing may lie on the way.
    pub(super) ray: Ray,
    pub(super) passing: Passing,
    /// Its radiance over the density with which it was chosen, weighed.
    pub(super) light: Vec3,
}

enum Prepared {
    Probe {
        order: Order,
        position: Vec3,
        turn: Quat,
    },
    Lumel {
        /// The middle, off the surface.
        position: Vec3,
        footprint: [Vec3; 2],
        /// World from the frame whose z is the normal.
        frame: Mat3,
    },
}

impl Aim {
    /// Of a receiver of a job in its world. Where surfaces are is known to some ulps of its largest
    /// coordinate only, from its origin; where receivers are, to one of theirs in the world.
    pub(super) fn new(job: &Job, budget: Budget, world: &World) -> Self {
        let Budget { receiver, samples } = budget;
        let (seed, extent, origin) = (job.seed, world.extent(), world.origin());
        let place = match job.receivers[receiver as usize] {
            Receiver::Probe { position } => {
                let (position, turn) = (position - origin, lattice::turn(seed, receiver));
                Prepared::Probe { order: job.order, position, turn }
            }
            Receiver::Lumel { position, normal, footprint } => {
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
                }
            }
        };
        Self { place, samples, seed, receiver, reaches: world.lights.are_sampled() }
    }

    pub(super) fn look(&self, sample: u32) -> Look {
        let mut sampler = Sampler::new(self.seed, self.receiver, sample);
        let (origin, direction) = match &self.place {
            Prepared::Probe { position, turn, .. } => (*position, self.towards(turn, sample)),
            Prepared::Lumel { position, footprint: [a, b], frame } => {
                let direction = frame * cosine_hemisphere(sampler.square());
                let at = sampler.square() - 0.5;
                (position + at.x * a + at.y * b, direction.normalize())
            }
        };
        let pdf = if self.reaches { self.density(direction) } else { f32::INFINITY };
        Look { origin, direction, pdf, sampler }
    }

    /// The source that a sample reaches for; none where there are none, or that one cannot be seen.
    pub(super) fn reach(&self, sample: u32, world: &World) -> Option<Reach> {
        /// Sets the numbers apart from those of the sample's path.
        const APART: u64 = 0x5ea7_1ab5;
        if !self.reaches {
            return None;
        }
        let origin = self.look(sample).origin;
        let mut sampler = Sampler::new(self.seed ^ APART, self.receiver, sample);
        let source = world.source(origin, sampler.number(), sampler.square())?;
        let weight = power_heuristic(source.pdf, self.density(source.ray.direction)) / source.pdf;
        let light = source.radiance * weight;
        let is_seen = light.is_finite() && light != Vec3::ZERO;
        let passing = Passing { ends: [None, source.target], key: sampler.key() };
        is_seen.then_some(Reach { ray: source.ray, passing, light })
    }

    /// Density per steradian with which samples look in a direction.
    fn density(&self, direction: Vec3) -> f32 {
        match &self.place {
            Prepared::Probe { .. } => 0.25 / PI,
            Prepared::Lumel { frame, .. } => frame.z_axis.dot(direction).max(0.0) / PI,
        }
    }

    /// What radiance from a direction is multiplied by where it is integrated, the first
    /// [`Receiver::terms`] numbers.
    pub(super) fn integrand(&self, direction: Vec3) -> [f32; sh::MAX_COEFFICIENTS] {
        match &self.place {
            Prepared::Probe { order, .. } => sh::basis(*order, direction),
            Prepared::Lumel { frame, .. } => {
                [frame.z_axis.dot(direction).max(0.0); sh::MAX_COEFFICIENTS]
            }
        }
    }

    /// What the light of a sample is multiplied by, the first [`Receiver::terms`] numbers: the inverse
    /// of its density times what is integrated.
    pub(super) fn terms(&self, sample: u32) -> [f32; sh::MAX_COEFFICIENTS] {
        match &self.place {
            Prepared::Probe { order, turn, .. } => {
                sh::basis(*order, self.towards(turn, sample)).map(|y| 4.0 * PI * y)
            }
            Prepared::Lumel { .. } => [PI; sh::MAX_COEFFICIENTS],
        }
    }

    fn towards(&self, turn: &Quat, sample: u32) -> Vec3 {
        (*turn * lattice::direction(sample, self.samples)).normalize()
    }
}
