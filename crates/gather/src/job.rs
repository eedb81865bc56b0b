//! Jobs: what a caller asks of a gatherer.

use std::sync::Arc;

use glam::Vec3;
use lumencast_light::{Light, Order};
use lumencast_scene::Snapshot;

/// One request for light.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scene at the moment to compute light for.
    pub scene: Arc<Snapshot>,
    /// Light of an earlier job, for feedback of bounces (the first paper). Where it is given, the
    /// surface at the end of a path also sends what it scatters of punctual lights and of this
    /// light. Each job then adds one bounce to the result of the last. Without it, light that is
    /// scattered more than `bounces` times is missing.
    pub previous: Option<Arc<Light>>,
    /// Places that light arrives at. Several jobs may share the list.
    pub receivers: Arc<[Receiver]>,
    /// Receivers to gather at, in any order, with their numbers of samples.
    pub budgets: Vec<Budget>,
    /// Order of the expansion for probes.
    pub order: Order,
    /// Surface scattering events on a path from a receiver: 0 sees only emission and environment, 1
    /// also light scattered once, and so on.
    pub bounces: u32,
    /// Upper limit of one path vertex's contribution to light that is scattered before it arrives,
    /// as luminance in cd/m². It removes fireflies (the second paper's clamp, chapter 5); infinite
    /// for none.
    pub clamp: f32,
    /// Asks for [`crate::SumsAt::distances`] and gives their upper limit in metres. Farther
    /// surfaces, and directions without a surface, count as this distance.
    pub distances: Option<f32>,
    /// Asks for [`crate::SumsAt::surfaces`].
    pub surfaces: bool,
    /// Rotates the lattice of directions and seeds the sampler; each tick takes another seed.
    /// Results depend on it and on the receivers' indices, but where [`Draws`] say otherwise. They
    /// do not depend on which other receivers a job has, nor on the number of threads.
    pub seed: u64,
}

impl Job {
    /// A job with the same number of samples for each receiver; the rest as in
    /// [`Job::with_budgets`].
    pub fn new(scene: Arc<Snapshot>, receivers: impl Into<Arc<[Receiver]>>, samples: u32) -> Self {
        let receivers = receivers.into();
        let budget = |receiver| Budget { receiver, samples, draws: Draws::Own };
        let budgets = (0..receivers.len() as u32).map(budget).collect();
        Self::with_budgets(scene, receivers, budgets)
    }

    /// A job of L2 with three bounces, without clamp, distances, surfaces or earlier light.
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

    /// Sum of the samples of all budgets.
    pub fn samples(&self) -> u64 {
        self.budgets.iter().map(|budget| u64::from(budget.samples)).sum()
    }
}

/// The number of samples that a receiver takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Index into [`Job::receivers`].
    pub receiver: u32,
    /// Number of directions to sample; with 0 the sums are empty.
    pub samples: u32,
    /// The random numbers of its samples.
    pub draws: Draws,
}

/// The random numbers that a receiver's samples draw. All are Owen-scrambled Sobol sequences.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Draws {
    /// A sequence of its own, chosen by the job's seed and the receiver's index.
    #[default]
    Own,
    /// A part of a sequence that receivers share, chosen by the job's seed. Receivers that draw parts
    /// beside each other are well sampled together: of a mean over them, more noise goes than they
    /// have alike (Ahmed and Wonka 2020, "Screen-space blue-noise diffusion of Monte Carlo sampling
    /// error via hierarchical ordering of pixels").
    Shared {
        /// Number of the sequence.
        sequence: u32,
        /// Index of the receiver's first sample.
        first: u32,
    },
    /// The same numbers in all jobs: what a lumel finds differs by what has changed in the scene alone.
    Same {
        /// Number of the sequence.
        sequence: u32,
        /// Index of the receiver's first sample.
        first: u32,
    },
}

/// A place that light arrives at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Receiver {
    /// A point in space that light reaches from all directions: its sums are coefficients of
    /// radiance.
    Probe {
        /// World position, metres.
        position: Vec3,
    },
    /// A parallelogram on a surface, or a point of it: its sum is irradiance.
    Lumel {
        /// World position of its centre, metres.
        position: Vec3,
        /// World unit normal.
        normal: Vec3,
        /// Edge vectors of the parallelogram, which is centred on `position`, metres; zero for a
        /// point.
        footprint: [Vec3; 2],
        /// The normals that irradiance is asked for on.
        shading: Shading,
    },
}

/// The normals that a lumel's irradiance is asked for on. Only light from above the surface counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Shading {
    /// The surface's own.
    #[default]
    Own,
    /// The surface's own, and those tilted about it: after irradiance its sums are x, y and z of its
    /// slope ([`lumencast_light::slope_by`]) times it.
    Tilted,
    /// This world unit normal.
    By(Vec3),
}

impl Receiver {
    /// A probe at a world position, metres.
    pub fn probe(position: Vec3) -> Self {
        Self::Probe { position }
    }

    /// A lumel without extent at a world position (metres) with a unit normal.
    pub fn point(position: Vec3, normal: Vec3) -> Self {
        Self::point_shaded(position, normal, Shading::Own)
    }

    /// The same, where irradiance is asked for on other normals.
    pub fn point_shaded(position: Vec3, normal: Vec3, shading: Shading) -> Self {
        Self::Lumel { position, normal, footprint: [Vec3::ZERO; 2], shading }
    }

    /// Number of entries of [`crate::SumsAt::sum`]: one for each coefficient of a probe, one for a
    /// lumel, and three more where its normal is tilted.
    pub fn terms(&self, order: Order) -> usize {
        match self {
            Self::Probe { .. } => order.coefficients(),
            Self::Lumel { shading: Shading::Tilted, .. } => 4,
            Self::Lumel { shading: Shading::Own | Shading::By(_), .. } => 1,
        }
    }
}
