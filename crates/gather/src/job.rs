//! What is asked of a gatherer.

use std::sync::Arc;

use glam::Vec3;
use lumencast_light::{Light, Order};
use lumencast_scene::Snapshot;

/// One request for light.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scene at the moment to compute.
    pub scene: Arc<Snapshot>,
    /// The light as it was known before, if paths are to go on in it: the surface that a path ends at
    /// then also sends what it scatters, of punctual lights and of this light. Each job so adds
    /// another bounce to what the last one found (the feedback of the first paper). Without it,
    /// light that is scattered more than `bounces` times is left out.
    pub previous: Option<Arc<Light>>,
    /// Places that light arrives at, which may be kept from job to job.
    pub receivers: Arc<[Receiver]>,
    /// Which of them to gather at, in any order, and how many samples each takes.
    pub budgets: Vec<Budget>,
    /// Order of the expansion for probes.
    pub order: Order,
    /// Surface scattering events on a path seen from a receiver: 0 sees only emission and
    /// environment, 1 light scattered once, and so on.
    pub bounces: u32,
    /// Upper limit of one path vertex's contribution (luminance, cd/m²) to light that was scattered
    /// before it arrives, against fireflies; infinite for none. The second paper's clamp (chapter 5).
    pub clamp: f32,
    /// Asks for [`crate::SumsAt::distances`]: up to how many metres a distance counts. What is farther,
    /// or nowhere, counts as so far.
    pub distances: Option<f32>,
    /// Asks for [`crate::SumsAt::surfaces`].
    pub surfaces: bool,
    /// Rotates the lattice and seeds the sampler: another tick, other directions. Results depend on
    /// it and on the receivers' numbers, never on which others are gathered at, nor on the number of
    /// threads.
    pub seed: u64,
}

impl Job {
    /// A job of so many samples a receiver; the rest as in [`Job::with_budgets`].
    pub fn new(scene: Arc<Snapshot>, receivers: impl Into<Arc<[Receiver]>>, samples: u32) -> Self {
        let receivers = receivers.into();
        let budget = |receiver| Budget { receiver, samples };
        let budgets = (0..receivers.len() as u32).map(budget).collect();
        Self::with_budgets(scene, receivers, budgets)
    }

    /// A job of L2 with three bounces, without clamp, distances, surfaces, or light from before.
    pub fn with_budgets(
        scene: Arc<Snapshot>,
        receivers: impl Into<Arc<[Receiver]>>,
        budgets: Vec<Budget>,
    ) -> Self {
        Self {
            scene,
            previous: None,
            receivers: receivers.into(),
            budgets,
            order: Order::L2,
            bounces: 3,
            clamp: f32::INFINITY,
            distances: None,
            surfaces: false,
            seed: 0,
        }
    }

    /// All samples of all budgets.
    pub fn samples(&self) -> u64 {
        self.budgets.iter().map(|budget| u64::from(budget.samples)).sum()
    }
}

/// How many samples a receiver takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Index into [`Job::receivers`]. A receiver draws the same samples whichever others are gathered at.
    pub receiver: u32,
    /// Directions to sample; none leave its sums empty.
    pub samples: u32,
}

/// A place that light arrives at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Receiver {
    /// A point in space that light reaches from everywhere: its sums are coefficients of radiance.
    Probe {
        /// World position, metres.
        position: Vec3,
    },
    /// A piece of a surface: its sum is irradiance.
    Lumel {
        /// World position of its middle, metres.
        position: Vec3,
        /// World unit normal.
        normal: Vec3,
        /// Two edges of the parallelogram about the middle that it covers, metres; zero for a point.
        footprint: [Vec3; 2],
    },
}

impl Receiver {
    /// A probe at a world position, metres.
    pub fn probe(position: Vec3) -> Self {
        Self::Probe { position }
    }

    /// A point of a surface.
    pub fn point(position: Vec3, normal: Vec3) -> Self {
        Self::Lumel { position, normal, footprint: [Vec3::ZERO; 2] }
    }

    /// Terms of a sample, and so entries of [`crate::SumsAt::sum`], for probes of an order.
    pub fn terms(&self, order: Order) -> usize {
        match self {
            Self::Probe { .. } => order.coefficients(),
            Self::Lumel { .. } => 1,
        }
    }
}
