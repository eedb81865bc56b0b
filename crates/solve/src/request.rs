//! What a solver asks a gatherer for.

use std::sync::Arc;

use lumencast_gather::{Budget, Job};
use lumencast_light::{FieldId, Light};

/// A job for a gatherer. Its sums go back to the solver with what was asked.
#[derive(Clone, Debug)]
pub struct Request {
    /// What to gather.
    pub job: Job,
    /// What the sums will belong to.
    pub asked: Asked,
}

/// What a job is for.
#[derive(Clone, Debug)]
pub struct Turn {
    /// The light of before, for paths to go on in ([`Job::previous`]).
    pub previous: Option<Arc<Light>>,
    /// Samples a receiver.
    pub samples: u32,
    /// Samples in all of a lightmap's lumels, those whose turn it is; each takes [`Turn::samples`]
    /// unless it is given.
    pub lumels: Option<u64>,
    /// Gives other directions each time.
    pub pass: u64,
}

/// What sums belong to.
#[derive(Clone, Debug)]
pub struct Asked {
    /// The field.
    pub field: FieldId,
    pub(crate) what: What,
}

#[derive(Clone, Debug)]
pub(crate) enum What {
    /// Where a scene's surfaces are.
    Surfaces,
    /// Light at receivers, of which the first ones are probes.
    Light { budgets: Vec<Budget>, probes: usize },
    /// Light at those lumels whose turn it was.
    Lumels { budgets: Vec<Budget> },
}

impl Asked {
    /// Samples of probes that it takes in all.
    pub fn samples(&self) -> u64 {
        match &self.what {
            What::Surfaces | What::Lumels { .. } => 0,
            What::Light { budgets, probes } => {
                budgets.iter().take(*probes).map(|budget| u64::from(budget.samples)).sum()
            }
        }
    }

    /// Whether light comes of it: otherwise only where surfaces are.
    pub fn is_light(&self) -> bool {
        !matches!(self.what, What::Surfaces)
    }

    /// Samples of lumels in their turn; nothing where it is for something else. There are so many lumels
    /// that nobody waits for them.
    pub fn lumel_samples(&self) -> Option<u64> {
        match &self.what {
            What::Lumels { budgets } => {
                Some(budgets.iter().map(|budget| u64::from(budget.samples)).sum())
            }
            What::Surfaces | What::Light { .. } => None,
        }
    }
}
