//! The fields of a scene while they are computed.

use std::sync::Arc;

use glam::Vec3;
use lumencast_charts::LaidOut;
use lumencast_gather::{Gathered, Job};
use lumencast_light::{Field, FieldId, Light, Lightmap, ProbeVolume};
use lumencast_scene::{Snapshot, VolumeSpec};

use crate::error::SolveError;
use crate::field::FieldSolver;
use crate::fit::{FitSettings, Part, fit};
use crate::lightmap::{BLOCKS_AT_ONCE, LightmapSolver};
use crate::newcomers::{Newcomers, Placed};
use crate::options::GatherOptions;
use crate::request::{Asked, Request, Turn, What};
use crate::surfaces::Surfaces;
use crate::volume::VolumeSolver;

/// The fields of a scene while they are computed.
#[derive(Clone)]
pub struct Solver {
    fields: Vec<FieldSolver>,
    options: GatherOptions,
    /// What is published.
    light: Light,
    /// The number of the next new field.
    next: FieldId,
}

/// How hard a fit to surfaces is worked on; it goes on from the last one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FitEffort {
    /// Rounds, each of which weighs the surfaces anew.
    pub rounds: u32,
    /// Steps of conjugate gradients in each.
    pub steps: u32,
}

impl Solver {
    /// The fields of volumes, dark, numbered in their order; of a volume too deep for clients' textures
    /// one for each piece.
    ///
    /// # Errors
    /// [`SolveError::Volume`]; no memory is taken for any then.
    pub fn new(volumes: &[VolumeSpec], options: GatherOptions) -> Result<Self, SolveError> {
        let mut empty =
            Self { fields: Vec::new(), options, light: Light::default(), next: FieldId(0) };
        empty.set_volumes(volumes)?;
        Ok(empty)
    }

    /// Keeps these volumes from now on, before all other fields. Those that it kept already go on under
    /// their numbers, with all that is known of their light; others get numbers that none has had.
    ///
    /// # Errors
    /// [`SolveError::Volume`]; nothing has changed then.
    pub fn set_volumes(&mut self, volumes: &[VolumeSpec]) -> Result<(), SolveError> {
        for (volume, spec) in (0..).zip(volumes) {
            spec.check().map_err(|reason| SolveError::Volume { volume, reason })?;
        }
        let mut before = std::mem::take(&mut self.fields);
        for spec in volumes.iter().flat_map(|spec| spec.split()) {
            let is_same = |field: &FieldSolver| field.as_volume().is_some_and(|v| v.spec() == spec);
            let same = before.iter().position(is_same).map(|at| before.remove(at));
            let field = same.unwrap_or_else(|| {
                FieldSolver::Volume(Box::new(VolumeSolver::new(
                    self.next_id(),
                    spec,
                    &self.options,
                )))
            });
            self.fields.push(field);
        }
        before.retain(|field| field.as_volume().is_none());
        self.fields.append(&mut before);
        self.list_light();
        Ok(())
    }

    /// Keeps the lumels of a layout from now on, after all volumes, or none. They are dark at first, and
    /// have a number that no field has had.
    pub fn set_lightmap(&mut self, scene: &Snapshot, laid_out: Option<&LaidOut>) {
        self.fields.retain(|field| field.as_volume().is_some());
        if let Some(laid_out) = laid_out {
            let GatherOptions { blend, directional, .. } = self.options;
            let lightmap = LightmapSolver::new(self.next_id(), scene, laid_out, blend)
                .with_slopes(directional);
            self.fields.push(FieldSolver::Lightmap(Box::new(lightmap)));
        }
        self.list_light();
    }

    fn next_id(&mut self) -> FieldId {
        let FieldId(id) = self.next;
        self.next = FieldId(id + 1);
        FieldId(id)
    }

    /// Publishes the fields that there are, with the light that is known of them.
    fn list_light(&mut self) {
        let light = self.fields.iter().map(|field| {
            let known = self.light.field(field.id()).cloned();
            known.unwrap_or_else(|| field.arriving())
        });
        self.light = Light::new(light);
    }

    /// Numbers of the fields, in the order in which they were asked for; pieces of a volume follow one
    /// another.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = FieldId> + '_ {
        self.fields.iter().map(FieldSolver::id)
    }

    /// The light as it was last solved.
    pub fn light(&self) -> &Light {
        &self.light
    }

    /// The fields as they were last solved, in the order in which they were asked for.
    pub fn into_fields(self) -> Vec<Field> {
        let ids: Vec<FieldId> = self.ids().collect();
        let mut fields = self.light.into_fields();
        fields.sort_by_key(|field| ids.iter().position(|id| *id == field.id()));
        fields
    }

    /// Number of all probes.
    pub fn probe_count(&self) -> usize {
        self.fields.iter().map(FieldSolver::probe_count).sum()
    }

    /// Number of all lumels that surfaces cover.
    pub fn lumel_count(&self) -> usize {
        let lightmaps = self.fields.iter().filter_map(FieldSolver::as_lightmap);
        lightmaps.map(LightmapSolver::lumel_count).sum()
    }

    /// Number of probes inside walls.
    pub fn buried_count(&self) -> usize {
        self.fields.iter().map(FieldSolver::buried_count).sum()
    }

    /// What to ask for before [`Self::job`], so that a field that wants to know where surfaces are knows
    /// those of this scene.
    pub fn look(&self, field: FieldId, scene: &Arc<Snapshot>) -> Option<Request> {
        let job = self.fields.iter().find(|known| known.id() == field)?.look(scene)?;
        Some(Request { job, asked: Asked { field, what: What::Surfaces } })
    }

    /// What to gather for a field; nothing where there is none of this number.
    pub fn job(&mut self, field: FieldId, scene: &Arc<Snapshot>, turn: Turn) -> Option<Request> {
        let GatherOptions { bounces, clamp, .. } = self.options;
        // Numbers of fields beyond a byte stand above those of passes.
        let (low, high) = (u64::from(field.0 & 0xff), u64::from(field.0 >> 8));
        let seed = (turn.pass << 8 | low) ^ (high << 40);
        let solver = self.field_mut(field)?;
        let probes = solver.probe_count();
        let (job, what) = match (solver, turn.lumels) {
            (FieldSolver::Lightmap(lightmap), Some(samples)) => {
                let (job, budgets) = lightmap.next_job(scene.clone(), samples);
                (job, What::Lumels { budgets })
            }
            (solver, _) => {
                let job = solver.job(scene.clone(), turn.samples);
                let budgets = job.budgets.clone();
                (job, What::Light { budgets, probes })
            }
        };
        let job = Job { previous: turn.previous, bounces, clamp, seed, ..job };
        Some(Request { job, asked: Asked { field, what } })
    }

    /// Takes in what was gathered; nothing where the field is gone.
    ///
    /// # Panics
    /// If the sums are those of another request.
    pub fn take(&mut self, asked: &Asked, gathered: &Gathered) {
        let Some(field) = self.field_mut(asked.field) else { return };
        match &asked.what {
            What::Surfaces => field.found(gathered),
            What::Light { budgets, .. } | What::Lumels { budgets } => {
                field.blend(gathered, budgets);
            }
        }
    }

    /// Lets lightmaps leave out what has moved ([`LightmapSolver::follow`]). The fields whose layout is
    /// another one.
    pub fn follow(&mut self, scene: &Snapshot) -> Vec<FieldId> {
        let mut others = Vec::new();
        self.each_lightmap(|lightmap, published| {
            if lightmap.follow(scene, published) {
                others.push(lightmap.id());
            }
        });
        others
    }

    /// Instances that came later, and rest by now, without lumels.
    pub fn newcomers(&self, scene: &Arc<Snapshot>) -> Option<Newcomers> {
        let mut lightmaps = self.fields.iter().filter_map(FieldSolver::as_lightmap);
        lightmaps.find_map(|lightmap| Newcomers::of(lightmap, scene))
    }

    /// Leaves instances that came later without lumels.
    pub fn leave_without_lumels(&mut self, newcomers: &Newcomers) {
        self.each_lightmap(|lightmap, _| {
            if lightmap.id() == newcomers.field() {
                lightmap.go_without(&newcomers.instances, &newcomers.scene);
            }
        });
    }

    /// Gives instances that came later their lumels, as far as some were placed for them. What was asked
    /// for at the field's lumels before must not be taken in any more.
    pub fn extend_lightmap(&mut self, scene: &Snapshot, newcomers: &Newcomers, placed: Placed) {
        let mut lumels = Some(placed.lumels);
        self.each_lightmap(|lightmap, published| {
            if let Some(new) = lumels.take_if(|new| new.id() == lightmap.id()) {
                lightmap.extend(scene, new, &newcomers.instances, published);
            }
        });
    }

    /// The scene was edited: light may be another from now on.
    pub fn expect_change(&mut self) {
        self.fields.iter_mut().for_each(FieldSolver::expect_change);
    }

    /// Makes light of what has been taken in.
    pub fn solve(&mut self, effort: FitEffort) {
        self.solve_volumes(effort);
        self.solve_lightmaps(BLOCKS_AT_ONCE);
    }

    /// What arrives at the probes or, where they are fitted, the fit of all of them.
    pub fn solve_volumes(&mut self, effort: FitEffort) {
        let Self { fields, light, .. } = self;
        let volumes: Vec<&VolumeSolver> =
            fields.iter().filter_map(FieldSolver::as_volume).collect();
        let of = |published: &ProbeVolume| {
            volumes.iter().copied().find(|volume| volume.id() == published.id)
        };
        let ordered: Vec<&VolumeSolver> = light.volumes().filter_map(of).collect();
        let surfaces: Option<Vec<&Surfaces>> = ordered.iter().map(|v| v.surfaces()).collect();
        let Some(surfaces) = surfaces else {
            let each = light.volumes_mut().zip(ordered);
            each.for_each(|(published, volume)| published.clone_from(volume.arriving()));
            return;
        };
        let each = ordered.into_iter().zip(surfaces);
        let parts: Vec<Part<'_>> = each
            .map(|(volume, surfaces)| Part {
                gathered: volume.arriving(),
                around: surfaces.around(),
                irradiance: surfaces.irradiance(),
            })
            .collect();
        let FitEffort { rounds, steps } = effort;
        fit(light, &parts, &FitSettings { rounds, steps, ..FitSettings::default() });
    }

    /// What arrives at lumels, filtered on the surface. Where light is live, `most` blocks of 64² of
    /// them are solved, in turn.
    pub fn solve_lightmaps(&mut self, most: usize) {
        let fields = std::mem::take(&mut self.light).into_fields();
        let (lightmaps, volumes): (Vec<Field>, Vec<Field>) =
            fields.into_iter().partition(|field| field.as_lightmap().is_some());
        let probes = Light::new(volumes);
        self.light = Light::new(lightmaps);
        self.each_lightmap(|lightmap, published| {
            lightmap.solve_some(most, true, &probes, published);
        });
        let lightmaps = std::mem::take(&mut self.light).into_fields();
        self.light = Light::new(probes.into_fields().into_iter().chain(lightmaps));
    }

    /// Calls `with` for each lightmap, with what is published of it.
    fn each_lightmap(&mut self, mut with: impl FnMut(&mut LightmapSolver, &mut Lightmap)) {
        for lightmap in self.fields.iter_mut().filter_map(FieldSolver::as_lightmap_mut) {
            let fields = self.light.fields_mut().iter_mut();
            let mut published = fields.filter_map(Field::as_lightmap_mut);
            if let Some(published) = published.find(|published| published.id == lightmap.id()) {
                with(lightmap, published);
            }
        }
    }

    /// Irradiances that the light has where that of a field matters.
    pub(crate) fn seen(&self, field: FieldId) -> Vec<Vec3> {
        let known = self.fields.iter().find(|known| known.id() == field);
        known.map_or_else(Vec::new, |known| known.seen(&self.light))
    }

    fn field_mut(&mut self, id: FieldId) -> Option<&mut FieldSolver> {
        self.fields.iter_mut().find(|field| field.id() == id)
    }
}
