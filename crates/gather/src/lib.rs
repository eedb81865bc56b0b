//! Gathers light: receivers go in, sums of arriving light come out.
//!
//! A gatherer knows a snapshot of the scene and a list of receivers. It knows nothing of volumes or
//! lightmaps. It works on its own threads; the caller submits jobs and polls for results.

mod accel;
mod bsdf;
mod gatherer;
mod job;
mod lights;
pub mod measure;
mod numbers;
pub mod path_trace;
mod queue;
pub mod reference;
mod sampling;
mod sums;
mod surface;
mod vectors;
mod world;

pub use gatherer::{Gather, Gathered, Progress, Ticket};
pub use job::{Budget, Draws, Job, Receiver, Shading};
pub use sums::{Sums, SumsAt, SurfacePoint};
pub use surface::shading_normal;
pub use vectors::by_vectors;
