//! What a solver asks a gatherer for.

use lumencast_gather::{Budget, Job};

/// A job for a gatherer. Its sums go back to the solver with what was asked.
#[derive(Clone, Debug)]
pub struct Request {
    /// What to gather.
    pub job: Job,
    /// What the sums will belong to.
    pub asked: Asked,
}

/// What sums belong to.
#[derive(Clone, Debug)]
pub struct Asked {
    /// The field's place in the order of the solver's fields.
    pub field: usize,
    pub(crate) what: What,
}

#[derive(Clone, Debug)]
pub(crate) enum What {
    /// Where a scene's surfaces are.
    Surfaces,
    /// Light at receivers.
    Light { budgets: Vec<Budget> },
}
