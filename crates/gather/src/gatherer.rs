//! The interface that all gatherers share.

use crate::job::Job;
use crate::sums::Sums;

/// A submitted job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ticket(pub u64);

/// State of a submitted job.
#[derive(Debug)]
pub enum Progress {
    /// The job waits or runs; holds the share of samples taken, 0 to 1.
    Working(f32),
    /// The job is done. A ticket gives its result once.
    Done(Gathered),
    /// There is no such ticket, or its result was taken, or the job was cancelled or failed.
    Unknown,
}

/// The result of a job.
#[derive(Debug)]
pub struct Gathered {
    /// One entry for each budget, in the order of the job.
    pub sums: Sums,
    /// [`lumencast_scene::Snapshot::version`] of the scene it was computed from.
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
    /// Returns the state of a job without waiting; hands over its result where the job is done.
    fn poll(&mut self, ticket: Ticket) -> Progress;
    /// Waits until a job is done. Returns `None` where [`Progress::Unknown`] would be returned.
    fn wait(&mut self, ticket: Ticket) -> Option<Gathered>;
    /// Cancels a job and drops its result.
    fn cancel(&mut self, ticket: Ticket);
}
