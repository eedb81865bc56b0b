//! One volume of probes as the server keeps it: history, walls, encoder.

use std::sync::Arc;

use glam::Vec3;
use lumencast_codec::{EncodedRegion, FieldInfo, ProbeEncoder, UpdateInfo, limits, regions};
use lumencast_gather::blend::History;
use lumencast_gather::fit::{FitSettings, Part, fit};
use lumencast_gather::{Gathered, Job, Receiver};
use lumencast_light::{FieldId, Light, ProbeVolume};
use lumencast_scene::{Snapshot, VolumeSpec};

use crate::error::ServerError;
use crate::gather_options::GatherOptions;
use crate::surfaces::Surfaces;
use crate::walls::{Buried, Sight};

/// A moment of the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// The tick in which it was looked at.
    pub(crate) tick: u64,
    /// Scene time, seconds.
    pub(crate) time: f64,
    /// [`Snapshot::version`].
    pub(crate) version: u64,
}

/// A volume with all that turns sums into frames.
///
/// Costs, in memory, for a probe of L2: 108 bytes of published light, twice that of
/// reconstructions, and 432 of history.
#[derive(Clone)]
pub(crate) struct Field {
    /// What arrives at the probes: the history's estimates, with probes inside walls filled in.
    arriving: ProbeVolume,
    /// What is published: the same, or fitted to surfaces.
    volume: ProbeVolume,
    positions: Vec<Vec3>,
    history: History,
    buried: Buried,
    surfaces: Option<Surfaces>,
    encoder: ProbeEncoder,
    /// Number of the next update.
    update: u64,
}

/// What a [job](Field::job) has brought.
pub(crate) struct Brought {
    pub(crate) gathered: Gathered,
    /// The numbers of the points that it gathered at.
    pub(crate) points: Vec<usize>,
}

impl Field {
    /// The fields of volumes, numbered in their order; of a volume too deep for clients, one for
    /// each piece. Volumes are checked before memory is taken for any.
    pub(crate) fn all(
        volumes: &[VolumeSpec],
        options: &GatherOptions,
    ) -> Result<Vec<Self>, ServerError> {
        let new = |(id, spec)| Self::new(FieldId(id), spec, options);
        Ok((0..).zip(pieces(volumes)?).map(new).collect())
    }

    fn new(id: FieldId, spec: VolumeSpec, options: &GatherOptions) -> Self {
        let VolumeSpec { grid, order } = spec;
        let GatherOptions { blend, fit, offset, .. } = *options;
        let dark = ProbeVolume::dark(id, grid, order).read_at(offset);
        Self {
            arriving: dark.clone(),
            volume: dark,
            positions: grid.positions().collect(),
            history: History::new(blend, grid.probe_count(), order.coefficients()),
            buried: Buried::new(grid.probe_count()),
            surfaces: fit.map(|fit| Surfaces::new(fit, blend, &grid)),
            encoder: ProbeEncoder::new(grid.resolution, order),
            update: 0,
        }
    }

    pub(crate) fn id(&self) -> FieldId {
        self.volume.id
    }

    pub(crate) fn volume(&self) -> &ProbeVolume {
        &self.volume
    }

    pub(crate) fn into_volume(self) -> ProbeVolume {
        self.volume
    }

    /// The field as the catalog lists it.
    pub(crate) fn describe(&self, source: &str) -> FieldInfo {
        FieldInfo::of_volume(&self.volume, self.scale_log2(), source)
    }

    /// log2 of its scale as of the last update; none before there was any light.
    pub(crate) fn scale_log2(&self) -> Option<i8> {
        self.encoder.scale_log2()
    }

    pub(crate) fn probe_count(&self) -> usize {
        self.positions.len()
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

    /// Number of probes inside walls.
    pub(crate) fn buried_count(&self) -> usize {
        self.buried.count()
    }

    /// What to ask for before [`Self::job`], so that it knows of the surfaces: only where probes are
    /// fitted, and the scene is another one.
    pub(crate) fn look(&self, scene: &Arc<Snapshot>) -> Option<Job> {
        self.surfaces.as_ref()?.look(scene)
    }

    /// Takes in what a look has found.
    pub(crate) fn found(&mut self, gathered: &Gathered) {
        let cell = self.volume.grid.spacing().min_element();
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
        options: GatherOptions,
        seed: u64,
    ) -> (Job, Vec<usize>) {
        let probe = |&position: &Vec3| Receiver::probe(position, samples);
        let mut receivers: Vec<_> = self.positions.iter().map(probe).collect();
        let (points, at_points) =
            self.surfaces.as_mut().map(|surfaces| surfaces.receivers(samples)).unwrap_or_default();
        receivers.extend(at_points);
        let GatherOptions { bounces, clamp, .. } = options;
        let order = self.volume.order;
        (Job { previous, order, bounces, clamp, seed, ..Job::new(scene, receivers) }, points)
    }

    /// The scene was edited: light may be another from now on.
    pub(crate) fn expect_change(&mut self) {
        self.history.expect_change();
        self.surfaces.iter_mut().for_each(Surfaces::expect_change);
    }

    /// Blends new light into the histories.
    pub(crate) fn blend(&mut self, brought: &Brought) {
        let Brought { gathered, points } = brought;
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

    /// The frames of the regions that somebody watches; `shown` is the moment that the light shows.
    pub(crate) fn encode(
        &mut self,
        shown: Moment,
        watched: impl Fn(u32) -> bool,
    ) -> Vec<EncodedRegion> {
        let info = UpdateInfo {
            update: self.update,
            tick: shown.tick,
            time: shown.time,
            scene_version: shown.version,
        };
        self.update += 1;
        self.encoder.encode(&self.volume, info, watched)
    }
}

/// Brings up to date what fields publish: what arrives at their probes or, where they are fitted, the
/// fit of all of them, with the effort of so many rounds of so many steps.
pub(crate) fn publish(fields: &mut [Field], (rounds, steps): (u32, u32)) {
    let mut light = Light::new(fields.iter().map(|field| field.volume.clone()));
    let field = |volume: &ProbeVolume| fields.iter().find(|field| field.id() == volume.id);
    let ordered: Vec<&Field> = light.volumes().filter_map(field).collect();
    let surfaces: Option<Vec<&Surfaces>> = ordered.iter().map(|f| f.surfaces.as_ref()).collect();
    let Some(surfaces) = surfaces else {
        fields.iter_mut().for_each(|field| field.volume.clone_from(&field.arriving));
        return;
    };
    let each = ordered.into_iter().zip(surfaces);
    let parts: Vec<Part<'_>> = each
        .map(|(field, surfaces)| Part {
            gathered: &field.arriving,
            around: surfaces.around(),
            irradiance: surfaces.irradiance(),
        })
        .collect();
    let settings = FitSettings { rounds, steps, ..FitSettings::default() };
    fit(&mut light, &parts, &settings);
    for volume in light.into_fields().into_iter().filter_map(lumencast_light::Field::into_volume) {
        if let Some(field) = fields.iter_mut().find(|field| field.id() == volume.id) {
            field.volume = volume;
        }
    }
}

/// The pieces of volumes that make sense and that the wire format can carry.
fn pieces(volumes: &[VolumeSpec]) -> Result<Vec<VolumeSpec>, ServerError> {
    let mut pieces = Vec::new();
    let mut total = 0;
    for (volume, spec) in (0..).zip(volumes) {
        let refused = |reason| ServerError::Volume { volume, reason };
        let most = |count: usize, what: &str, limit: usize| {
            let reason = format!("{count} {what}; at most {limit}: give it fewer cells");
            if count > limit { Err(refused(reason)) } else { Ok(()) }
        };
        spec.check().map_err(refused)?;
        total += spec.grid.probe_count();
        most(total, "probes with those before it", limits::CATALOG_PROBES)?;
        for piece in spec.split() {
            most(piece.grid.probe_count(), "probes", limits::FIELD_PROBES)?;
            most(regions(piece.grid.resolution).len(), "regions", limits::REGIONS)?;
            pieces.push(piece);
        }
    }
    if pieces.len() > limits::FIELDS {
        return Err(ServerError::TooManyFields(pieces.len()));
    }
    Ok(pieces)
}
