//! A volume while it is computed: history, walls, fit.

use std::sync::Arc;

use glam::Vec3;
use lumencast_gather::{Gathered, Job, Receiver};
use lumencast_light::{FieldId, Light, ProbeVolume};
use lumencast_scene::{Snapshot, VolumeSpec};

use crate::blend::History;
use crate::options::GatherOptions;
use crate::surfaces::Surfaces;
use crate::walls::{Buried, Sight};

/// What makes light of a volume's sums.
///
/// Costs, in memory, for a probe of L2: 108 bytes of arriving light, and 432 of history.
#[derive(Clone)]
pub(crate) struct VolumeSolver {
    /// What arrives at the probes: the history's estimates, with probes inside walls filled in.
    arriving: ProbeVolume,
    positions: Vec<Vec3>,
    history: History,
    buried: Buried,
    surfaces: Option<Surfaces>,
}

impl VolumeSolver {
    pub(crate) fn new(id: FieldId, spec: VolumeSpec, options: &GatherOptions) -> Self {
        let VolumeSpec { grid, order } = spec;
        let GatherOptions { blend, fit, offset, .. } = *options;
        Self {
            arriving: ProbeVolume::dark(id, grid, order).read_at(offset),
            positions: grid.positions().collect(),
            history: History::new(blend, grid.probe_count(), order.coefficients()),
            buried: Buried::new(grid.probe_count()),
            surfaces: fit.map(|fit| Surfaces::new(fit, blend, &grid)),
        }
    }

    pub(crate) fn id(&self) -> FieldId {
        self.arriving.id
    }

    pub(crate) fn arriving(&self) -> &ProbeVolume {
        &self.arriving
    }

    pub(crate) fn surfaces(&self) -> Option<&Surfaces> {
        self.surfaces.as_ref()
    }

    pub(crate) fn probe_count(&self) -> usize {
        self.positions.len()
    }

    /// Number of probes inside walls.
    pub(crate) fn buried_count(&self) -> usize {
        self.buried.count()
    }

    /// Where its light matters: points of the surfaces that it knows, with their normals, or all
    /// directions along the axes at probes that are not inside walls.
    pub(crate) fn places(&self) -> Vec<(Vec3, Vec3)> {
        if let Some(surfaces) = &self.surfaces {
            return surfaces.places();
        }
        let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        let open = self.positions.iter().zip(self.buried.open()).filter(|(_, open)| *open);
        open.flat_map(|(&position, _)| axes.map(|axis| (position, axis))).collect()
    }

    /// What to ask for so that it knows of the surfaces: only where probes are fitted, and the scene is
    /// another one.
    pub(crate) fn look(&self, scene: &Arc<Snapshot>) -> Option<Job> {
        self.surfaces.as_ref()?.look(scene)
    }

    /// Takes in what a look has found.
    pub(crate) fn found(&mut self, gathered: &Gathered) {
        let cell = self.arriving.grid.spacing().min_element();
        if let Some(surfaces) = &mut self.surfaces {
            surfaces.found(&gathered.sums, gathered.scene_version, cell);
        }
    }

    /// What to gather for every probe and, at the points whose numbers come with it, for the surfaces
    /// about them.
    pub(crate) fn job(
        &mut self,
        scene: Arc<Snapshot>,
        previous: Option<Arc<Light>>,
        samples: u32,
        options: &GatherOptions,
        seed: u64,
    ) -> (Job, Vec<usize>) {
        let probe = |&position: &Vec3| Receiver::probe(position, samples);
        let mut receivers: Vec<_> = self.positions.iter().map(probe).collect();
        let (points, at_points) =
            self.surfaces.as_mut().map(|surfaces| surfaces.receivers(samples)).unwrap_or_default();
        receivers.extend(at_points);
        let GatherOptions { bounces, clamp, .. } = *options;
        let order = self.arriving.order;
        (Job { previous, order, bounces, clamp, seed, ..Job::new(scene, receivers) }, points)
    }

    /// The scene was edited: light may be another from now on.
    pub(crate) fn expect_change(&mut self) {
        self.history.expect_change();
        self.surfaces.iter_mut().for_each(Surfaces::expect_change);
    }

    /// Blends new light into the histories; at points of surfaces it is that of these numbers.
    pub(crate) fn blend(&mut self, gathered: &Gathered, points: &[usize]) {
        let (probes, at_points) = gathered.sums.split_at(self.positions.len());
        self.history.update(probes);
        for probe in 0..self.history.len() {
            self.arriving.probe_mut(probe).copy_from_slice(self.history.coefficients(probe));
        }
        self.buried.record(probes.iter().map(Sight::of));
        self.buried.fill(&mut self.arriving);
        if let Some(surfaces) = &mut self.surfaces {
            surfaces.blend(points, at_points);
        }
    }
}
