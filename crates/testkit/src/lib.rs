//! Analytic scenes, image metrics, simulated links and planted faults for tests.

pub mod embree;
mod link;
pub mod mapped;
pub mod rooms;
pub mod scenes;
pub mod vectors;
pub mod walls;

pub use link::{Conditions, Link};
