//! Analytic scenes, image metrics, simulated links and planted faults for tests.

mod link;
pub mod scenes;

pub use link::{Conditions, Link};
