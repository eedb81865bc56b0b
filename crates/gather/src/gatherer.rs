//! What all gatherers have in common.

use crate::job::Job;
use crate::sums::Sums;

/// A submitted job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ticket(pub u64);

/// State of a submitted job.
#[derive(Debug)]
pub enum Progress {
    /// Not done yet; the share of samples taken, 0 to 1.
    Working(f32),
    /// Done: one entry a budget, in order. A ticket gives its result once.
    Done(Gathered),
    /// No such ticket, or its result was taken already.
    Unknown,
}

/// The result of a job.
#[derive(Debug)]
pub struct Gathered {
    /// One entry a budget, in the order of the job.
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
    /// Asks for a job.
    fn poll(&mut self, ticket: Ticket) -> Progress;
    /// Waits until a job is done.
    fn wait(&mut self, ticket: Ticket) -> Option<Gathered>;
    /// Gives a job up; its result is dropped.
    fn cancel(&mut self, ticket: Ticket);
}
