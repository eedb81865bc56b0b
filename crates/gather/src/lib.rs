//! Gathering of light: receivers in, sums out.
//!
//! A gatherer knows a [`Snapshot`] of the scene and receivers, not
//! volumes or lightmaps. It works on its own threads; the caller submits and polls.

mod accel;
mod bsdf;
mod lights;
pub mod measure;
pub mod path_trace;
pub mod reference;
mod sampling;
mod surface;
mod world;

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
    /// then also sends what it scatters, of punctual lights and of this field. Each job so adds
    /// another bounce to what the last one found (the feedback of the first paper). Without it,
    /// light that is scattered more than `bounces` times is left out.
    pub previous: Option<Arc<Light>>,
    /// Points to gather at, each with its budget.
    pub receivers: Arc<[Receiver]>,
    /// Order of the expansion for probes.
    pub order: Order,
    /// Surface scattering events on a path seen from a receiver: 0 sees only emission and
    /// environment, 1 light scattered once, and so on.
    pub bounces: u32,
    /// Upper limit of one path vertex's contribution (luminance, cd/m²) to light that was scattered
    /// before it arrives, against fireflies; infinite for none. The second paper's clamp (chapter 5).
    pub clamp: f32,
    /// Asks for [`Sums::distances`]: up to how many metres a distance counts. What is farther, or
    /// nowhere, counts as so far.
    pub distances: Option<f32>,
    /// Asks for [`Sums::surfaces`].
    pub surfaces: bool,
    /// Rotates the lattice and seeds the sampler: another tick, other directions. Results depend on
    /// it and on the receivers, never on the number of threads.
    pub seed: u64,
}

impl Job {
    /// A job of L2 with three bounces, without clamp, distances, surfaces, or light from before.
    pub fn new(scene: Arc<Snapshot>, receivers: impl Into<Arc<[Receiver]>>) -> Self {
        Self {
            scene,
            previous: None,
            receivers: receivers.into(),
            order: Order::L2,
            bounces: 3,
            clamp: f32::INFINITY,
            distances: None,
            surfaces: false,
            seed: 0,
        }
    }
}

/// A point that light arrives at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Where, and from which directions.
    pub place: Place,
    /// Directions to sample, at least 1.
    pub samples: u32,
}

impl Receiver {
    /// A probe at a world position, metres.
    pub fn probe(position: Vec3, samples: u32) -> Self {
        Self { place: Place::Probe { position }, samples }
    }
}

/// Where light is received.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
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

impl Place {
    /// Terms of a sample, and so entries of [`Sums::sum`], for probes of an order.
    pub fn terms(&self, order: Order) -> usize {
        match self {
            Self::Probe { .. } => order.coefficients(),
            Self::Lumel { .. } => 1,
        }
    }
}

/// What arrived at one receiver.
///
/// A *term* is what one sample adds: for a probe 4π·Y_lm(ω), one of each of `order.coefficients()`,
/// directions being spread evenly over the sphere; for a lumel the single π, directions being spread
/// by the cosine about its normal and origins over its footprint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    /// Sum over samples of terms times radiance, cd/m²: divided by `count`, the unbiased estimate
    /// of the coefficients of arriving radiance, or of irradiance in lux.
    pub sum: Vec<Vec3>,
    /// Sum over samples of the squares of the same.
    pub sum_of_squares: Vec<Vec3>,
    /// Samples taken.
    pub count: u32,
    /// Share of the samples that met the back of a surface first, by its winding: near 1 for probes
    /// inside of solid things.
    pub back_face_fraction: f32,
    /// Share of the samples that met a back first that nobody is meant to see, its material being
    /// single-sided.
    pub culled_fraction: f32,
    /// Sums over samples of terms times the distance to the first surface, and times its square
    /// (metres, square metres); empty unless [`Job::distances`] asks for them.
    pub distances: Vec<[f32; 2]>,
    /// The surface that each sample met first, if any; empty unless [`Job::surfaces`] asks for them.
    pub surfaces: Vec<Option<SurfacePoint>>,
}

impl Sums {
    /// The estimates: coefficients of radiance, or irradiance; not numbers where there is no sample.
    pub fn mean(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.sum.iter().map(|sum| sum / self.count as f32)
    }
}

/// A point of a surface, as it is seen from somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// World, metres.
    pub position: Vec3,
    /// World unit normal of the triangle, on the side that is seen.
    pub normal: Vec3,
    /// Whether that side is the triangle's front, by its winding, whatever its material shows.
    pub front: bool,
}

/// A submitted job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ticket(pub u64);

/// State of a submitted job.
#[derive(Debug)]
pub enum Progress {
    /// Not done yet; the share of samples taken, 0 to 1.
    Working(f32),
    /// Done: one entry a receiver, in order. A ticket gives its result once.
    Done(Gathered),
    /// No such ticket, or its result was taken already.
    Unknown,
}

/// The result of a job.
#[derive(Debug)]
pub struct Gathered {
    /// One entry a receiver, in the order of the job.
    pub sums: Vec<Sums>,
    /// [`Snapshot::version`] of the scene it was computed from.
    pub scene_version: u64,
    /// Seconds spent bringing acceleration structures up to date.
    pub build_seconds: f64,
    /// Seconds spent tracing.
    pub trace_seconds: f64,
    /// Path segments traced (camera, bounce and shadow rays).
    pub rays: u64,
}

/// Turns receivers into sums of arriving light.
pub trait Gather: Send {
    /// Starts a job and returns at once.
    fn submit(&mut self, job: Job) -> Ticket;
    /// Asks for a job.
    fn poll(&mut self, ticket: Ticket) -> Progress;
    /// Waits until a job is done.
    fn wait(&mut self, ticket: Ticket) -> Option<Gathered>;
    /// Gives a job up; its result is dropped.
    fn cancel(&mut self, ticket: Ticket);
}
