//! A volume while it is computed: history, walls, fit.

use std::sync::Arc;

use glam::Vec3;
use lumencast_gather::{Budget, Draws, Gathered, Job, Receiver};
use lumencast_light::{FieldId, Light, Place, ProbeVolume};
use lumencast_scene::{Snapshot, VolumeSpec};

use crate::blend::History;
use crate::options::GatherOptions;
use crate::surfaces::Surfaces;
use crate::walls::{Buried, Sight};

/// Points, or directions at probes, at which light is seen, about so many at most.
const SEEN: usize = 1 << 16;

/// What makes light of a volume's sums.
///
/// Costs, in memory, for a probe of L2: 108 bytes of arriving light, and 432 of history.
#[derive(Clone)]
pub(crate) struct VolumeSolver {
    /// What arrives at the probes: the history's estimates, with probes inside walls filled in.
    arriving: ProbeVolume,
    /// Its probes and, after them, the points of surfaces that it knows.
    receivers: Arc<[Receiver]>,
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
            receivers: grid.positions().map(Receiver::probe).collect(),
            history: History::new(blend, grid.probe_count(), order.coefficients()),
            buried: Buried::new(grid.probe_count()),
            surfaces: fit.map(|fit| Surfaces::new(fit, blend, &grid)),
        }
    }

    pub(crate) fn spec(&self) -> VolumeSpec {
        VolumeSpec { grid: self.arriving.grid, order: self.arriving.order }
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
        self.arriving.grid.probe_count()
    }

    /// Number of probes inside walls.
    pub(crate) fn buried_count(&self) -> usize {
        self.buried.count()
    }

    /// Irradiances that light has where the volume's matters.
    pub(crate) fn seen(&self, light: &Light) -> Vec<Vec3> {
        let places = self.places();
        let step = places.len().div_ceil(SEEN).max(1);
        let irradiance = |place: &Place| light.irradiance(place.position, place.normal);
        places.iter().step_by(step).map(irradiance).collect()
    }

    /// Points of the surfaces that it knows, with their normals, or all directions along the axes at
    /// probes that are not inside walls.
    fn places(&self) -> Vec<Place> {
        if let Some(surfaces) = &self.surfaces {
            return surfaces.places();
        }
        let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        let open = self.arriving.grid.positions().zip(self.buried.open()).filter(|(_, open)| *open);
        open.flat_map(|(position, _)| axes.map(|axis| Place::on_surface(position, axis))).collect()
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
            let probes = self.arriving.grid.positions().map(Receiver::probe);
            self.receivers = probes.chain(surfaces.receivers()).collect();
        }
    }

    /// What to gather for every probe and, where they are fitted, for the surfaces about them.
    pub(crate) fn job(&mut self, scene: Arc<Snapshot>, samples: u32) -> Job {
        let probes = self.probe_count() as u32;
        let at_probes = (0..probes).map(|receiver| Budget { receiver, samples, draws: Draws::Own });
        let at_points = self.surfaces.iter_mut().flat_map(|surfaces| surfaces.budgets(samples));
        let at_points = at_points.map(|b| Budget { receiver: probes + b.receiver, ..b });
        let budgets = at_probes.chain(at_points).collect();
        let job = Job::with_budgets(scene, self.receivers.clone(), budgets);
        Job { order: self.arriving.order, ..job }
    }

    /// The scene was edited: light may be another from now on.
    pub(crate) fn expect_change(&mut self) {
        self.history.expect_change();
        self.surfaces.iter_mut().for_each(Surfaces::expect_change);
    }

    /// Blends new light into the histories; `budgets` are those of the job.
    pub(crate) fn blend(&mut self, gathered: &Gathered, budgets: &[Budget]) {
        let probes = self.probe_count();
        self.history.update(gathered.sums.iter().take(probes));
        for probe in 0..self.history.len() {
            self.arriving.probe_mut(probe).copy_from_slice(self.history.coefficients(probe));
        }
        self.buried.record(gathered.sums.iter().take(probes).map(|sums| Sight::of(&sums)));
        self.buried.fill(&mut self.arriving);
        if let Some(surfaces) = &mut self.surfaces {
            let at_points = budgets.iter().zip(gathered.sums.iter()).skip(probes);
            surfaces.blend(at_points.map(|(b, sums)| (b.receiver as usize - probes, sums)));
        }
    }
}
