//! Gathering of light: receivers in, sums out.
//!
//! A gatherer knows a [`Snapshot`](lumencast_scene::Snapshot) of the scene and receivers, not
//! volumes or lightmaps. It works on its own threads; the caller submits and polls.

mod accel;
pub mod blend;
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
use lumencast_light::Order;
use lumencast_scene::Snapshot;

/// One request for light.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scene at the moment to compute.
    pub scene: Arc<Snapshot>,
    /// Points to gather at, each with its budget.
    pub receivers: Arc<[Receiver]>,
    /// Order of the expansion for probes.
    pub order: Order,
    /// Surface scattering events on a path seen from a receiver: 0 sees only emission and
    /// environment, 1 light scattered once, and so on.
    pub bounces: u32,
    /// Upper limit of one path vertex's contribution (luminance, cd/m²), against fireflies;
    /// infinite for none. The second paper's clamp (4.1.1).
    pub clamp: f32,
    /// Rotates the lattice and seeds the sampler: another tick, other directions. Results depend on
    /// it and on the receivers, never on the number of threads.
    pub seed: u64,
}

/// A point that light arrives at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// World position, metres.
    pub position: Vec3,
    /// Directions to sample, at least 1.
    pub samples: u32,
}

/// What arrived at one receiver.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    /// Sum over samples of 4π·L(ω)·Y_lm(ω), `order.coefficients()` entries: divided by `count`, the
    /// unbiased estimate of the coefficients of arriving radiance.
    pub sum: Vec<Vec3>,
    /// Sum over samples of the squares of the same.
    pub sum_of_squares: Vec<Vec3>,
    /// Samples taken.
    pub count: u32,
    /// Share of the samples that met the back of a surface first: near 1 for probes inside walls.
    pub back_face_fraction: f32,
    /// Mean distance to the first surface, metres; infinite where every sample left the scene.
    pub mean_distance: f32,
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
