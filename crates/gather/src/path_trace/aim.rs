//! A receiver's samples: where each looks, and what its light is multiplied by.

use std::f32::consts::PI;

use glam::{Mat3, Quat, Vec3};
use lumencast_light::{Order, sh};

use super::integrator::Look;
use crate::bsdf::frame;
use crate::sampling::{Sampler, cosine_hemisphere, lattice};
use crate::surface::gamma;
use crate::{Job, Place};

/// Of a lumel's size, how far off the surface its samples start.
const LIFT: f32 = 1e-3;

/// What all samples of a receiver share.
pub(super) struct Aim {
    place: Prepared,
    samples: u32,
    seed: u64,
    receiver: u32,
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
    /// `extent` is the scene's largest coordinate, metres, from its origin: where surfaces are is known
    /// to some ulps of it only, and where receivers are to one of their coordinates in the world.
    pub(super) fn new(job: &Job, receiver: u32, extent: f32) -> Self {
        let (seed, origin) = (job.seed, job.scene.origin);
        let place = match job.receivers[receiver as usize].place {
            Place::Probe { position } => {
                let (position, turn) = (position - origin, lattice::turn(seed, receiver));
                Prepared::Probe { order: job.order, position, turn }
            }
            Place::Lumel { position, normal, footprint } => {
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
        Self { place, samples: job.receivers[receiver as usize].samples, seed, receiver }
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
        Look { origin, direction, sampler }
    }

    /// What the light of a sample is multiplied by, the first [`Place::terms`] numbers: the inverse
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
