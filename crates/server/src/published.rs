//! One field as it is published: its encoder, and what its newest light shows.

use lumencast_codec::{EncodedRegion, FieldEncoder, FieldInfo, LumelCoding, UpdateInfo};
use lumencast_light::{Field, FieldId};
use lumencast_solve::Solver;

use crate::publish::Outlet;

/// A moment of the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// The tick in which it was looked at.
    pub(crate) tick: u64,
    /// Scene time, seconds.
    pub(crate) time: f64,
    /// [`lumencast_scene::Snapshot::version`].
    pub(crate) version: u64,
}

/// A field on its way to clients.
pub(crate) struct Published {
    pub(crate) id: FieldId,
    /// How its lumels are coded, if it has any.
    lumels: LumelCoding,
    encoder: FieldEncoder,
    /// Number of the next update.
    update: u64,
    /// The moment of light that is not yet encoded.
    news: Option<Moment>,
    /// How often its jobs or its coding have failed.
    failures: u64,
}

impl Published {
    pub(crate) fn new(field: &Field, lumels: LumelCoding) -> Self {
        let encoder = FieldEncoder::new(field, lumels);
        Self { id: field.id(), lumels, encoder, update: 0, news: None, failures: 0 }
    }

    /// The solver's fields, in its order; those that were there before go on.
    pub(crate) fn all(solver: &Solver, lumels: LumelCoding, mut before: Vec<Self>) -> Vec<Self> {
        let published = |id| {
            let same = before.iter().position(|published| published.id == id);
            let new = || solver.light().field(id).map(|field| Self::new(field, lumels));
            same.map(|at| before.remove(at)).or_else(new)
        };
        solver.ids().filter_map(published).collect()
    }

    /// The field has another layout; its updates are numbered on.
    pub(crate) fn lay_out(&mut self, field: &Field) {
        self.encoder.follow(field, self.lumels);
    }

    /// The field as the catalog lists it.
    pub(crate) fn describe(&self, field: &Field, source: &str) -> FieldInfo {
        self.encoder.describe(field, source)
    }

    /// log2 of its scale as of the last update; none before there was any light.
    pub(crate) fn scale_log2(&self) -> Option<i8> {
        self.encoder.scale_log2()
    }

    /// Whether anyone reads any of its regions.
    pub(crate) fn is_watched(&self, outlet: &dyn Outlet) -> bool {
        self.encoder.regions().any(|region| outlet.is_watched(self.id.0, region))
    }

    /// The field's light shows this moment from now on.
    pub(crate) fn show(&mut self, moment: Moment) {
        self.news = Some(moment);
    }

    /// The frames of the regions that somebody watches; none where there is no new light.
    pub(crate) fn encode(
        &mut self,
        field: &Field,
        watched: impl Fn(u32) -> bool,
    ) -> Vec<EncodedRegion> {
        let Some(Moment { tick, time, version }) = self.news.take() else { return Vec::new() };
        let info = UpdateInfo { update: self.update, tick, time, scene_version: version };
        self.update += 1;
        self.encoder.encode(field, info, watched).unwrap_or_else(|error| {
            self.note_failure("coding", &error.to_string());
            Vec::new()
        })
    }

    /// Tells that a job or coding its light has failed: the first time, and each time that it has failed twice as often.
    pub(crate) fn note_failure(&mut self, what: &str, outcome: &str) {
        self.failures += 1;
        if self.failures.is_power_of_two() {
            let (field, failures) = (self.id.0, self.failures);
            tracing::warn!(field, failures, "{what} light has failed: {outcome}");
        }
    }
}
