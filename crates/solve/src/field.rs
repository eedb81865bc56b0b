//! One field while it is computed: what its kind makes of a gatherer's sums.

use std::sync::Arc;

use lumencast_gather::{Budget, Gathered, Job};
use lumencast_light::{Field, FieldId, Place};
use lumencast_scene::Snapshot;

use crate::volume::VolumeSolver;

/// A field, by its kind.
#[derive(Clone)]
pub(crate) enum FieldSolver {
    Volume(VolumeSolver),
}

impl FieldSolver {
    pub(crate) fn id(&self) -> FieldId {
        match self {
            Self::Volume(volume) => volume.id(),
        }
    }

    /// What has arrived.
    pub(crate) fn arriving(&self) -> Field {
        match self {
            Self::Volume(volume) => volume.arriving().clone().into(),
        }
    }

    pub(crate) fn probe_count(&self) -> usize {
        match self {
            Self::Volume(volume) => volume.probe_count(),
        }
    }

    /// Number of probes inside walls.
    pub(crate) fn buried_count(&self) -> usize {
        match self {
            Self::Volume(volume) => volume.buried_count(),
        }
    }

    /// Where its light matters: places with directions that surfaces there may face.
    pub(crate) fn places(&self) -> Vec<Place> {
        match self {
            Self::Volume(volume) => volume.places(),
        }
    }

    /// What to ask for so that it knows where surfaces are, where it wants to.
    pub(crate) fn look(&self, scene: &Arc<Snapshot>) -> Option<Job> {
        match self {
            Self::Volume(volume) => volume.look(scene),
        }
    }

    /// Takes in what a look has found.
    pub(crate) fn found(&mut self, gathered: &Gathered) {
        match self {
            Self::Volume(volume) => volume.found(gathered),
        }
    }

    /// What to gather.
    pub(crate) fn job(&mut self, scene: Arc<Snapshot>, samples: u32) -> Job {
        match self {
            Self::Volume(volume) => volume.job(scene, samples),
        }
    }

    /// Blends in new light; `budgets` are those of the job.
    pub(crate) fn blend(&mut self, gathered: &Gathered, budgets: &[Budget]) {
        match self {
            Self::Volume(volume) => volume.blend(gathered, budgets),
        }
    }

    /// The scene was edited: light may be another from now on.
    pub(crate) fn expect_change(&mut self) {
        match self {
            Self::Volume(volume) => volume.expect_change(),
        }
    }
}
