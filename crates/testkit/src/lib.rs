//! Analytic scenes, image metrics, simulated links and planted faults for tests.

pub mod scenes;
