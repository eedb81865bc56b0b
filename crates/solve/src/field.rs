//! One field while it is computed: what its kind makes of a gatherer's sums.

use std::sync::Arc;

use glam::Vec3;
use lumencast_gather::{Budget, Gathered, Job};
use lumencast_light::{Field, FieldId, Light};
use lumencast_scene::Snapshot;

use crate::lightmap::LightmapSolver;
use crate::volume::VolumeSolver;

/// A field, by its kind.
#[derive(Clone)]
pub(crate) enum FieldSolver {
    Volume(Box<VolumeSolver>),
    Lightmap(Box<LightmapSolver>),
}

impl FieldSolver {
    pub(crate) fn id(&self) -> FieldId {
        match self {
            Self::Volume(volume) => volume.id(),
            Self::Lightmap(lightmap) => lightmap.id(),
        }
    }

    /// The volume, where it is one.
    pub(crate) fn as_volume(&self) -> Option<&VolumeSolver> {
        match self {
            Self::Volume(volume) => Some(volume),
            Self::Lightmap(_) => None,
        }
    }

    /// The lightmap, where it is one.
    pub(crate) fn as_lightmap(&self) -> Option<&LightmapSolver> {
        match self {
            Self::Volume(_) => None,
            Self::Lightmap(lightmap) => Some(lightmap),
        }
    }

    pub(crate) fn as_lightmap_mut(&mut self) -> Option<&mut LightmapSolver> {
        match self {
            Self::Volume(_) => None,
            Self::Lightmap(lightmap) => Some(lightmap),
        }
    }

    /// What has arrived.
    pub(crate) fn arriving(&self) -> Field {
        match self {
            Self::Volume(volume) => volume.arriving().clone().into(),
            Self::Lightmap(lightmap) => lightmap.dark().into(),
        }
    }

    pub(crate) fn probe_count(&self) -> usize {
        match self {
            Self::Volume(volume) => volume.probe_count(),
            Self::Lightmap(_) => 0,
        }
    }

    /// Number of probes inside walls.
    pub(crate) fn buried_count(&self) -> usize {
        match self {
            Self::Volume(volume) => volume.buried_count(),
            Self::Lightmap(_) => 0,
        }
    }

    /// Irradiances that light has where that of this field matters.
    pub(crate) fn seen(&self, light: &Light) -> Vec<Vec3> {
        match self {
            Self::Volume(volume) => volume.seen(light),
            Self::Lightmap(lightmap) => lightmap.seen(light),
        }
    }

    /// What to ask for so that it knows where surfaces are, where it wants to.
    pub(crate) fn look(&self, scene: &Arc<Snapshot>) -> Option<Job> {
        match self {
            Self::Volume(volume) => volume.look(scene),
            Self::Lightmap(_) => None,
        }
    }

    /// Takes in what a look has found.
    pub(crate) fn found(&mut self, gathered: &Gathered) {
        match self {
            Self::Volume(volume) => volume.found(gathered),
            Self::Lightmap(_) => {}
        }
    }

    /// What to gather.
    pub(crate) fn job(&mut self, scene: Arc<Snapshot>, samples: u32) -> Job {
        match self {
            Self::Volume(volume) => volume.job(scene, samples),
            Self::Lightmap(lightmap) => lightmap.job(scene, samples),
        }
    }

    /// Blends in new light; `budgets` are those of the job.
    pub(crate) fn blend(&mut self, gathered: &Gathered, budgets: &[Budget]) {
        match self {
            Self::Volume(volume) => volume.blend(gathered, budgets),
            Self::Lightmap(lightmap) => lightmap.take(gathered, budgets),
        }
    }

    /// The scene was edited: light may be another from now on.
    pub(crate) fn expect_change(&mut self) {
        match self {
            Self::Volume(volume) => volume.expect_change(),
            Self::Lightmap(lightmap) => lightmap.expect_change(),
        }
    }
}
