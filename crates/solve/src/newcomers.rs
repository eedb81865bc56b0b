//! Instances that came after surfaces were laid out on pages.

use std::sync::Arc;

use lumencast_charts::{Extended, LaidOut, Store, extended, sheets};
use lumencast_gather::Gather;
use lumencast_light::FieldId;
use lumencast_scene::Snapshot;

use crate::error::SolveError;
use crate::lightmap::with_backs;

/// Still instances that rest and have no lumels yet. Cutting them into charts takes its time, and needs
/// nothing but what is here: [`Newcomers::lay_out`] may run on any thread.
#[derive(Clone, Debug)]
pub struct Newcomers {
    pub(crate) field: FieldId,
    pub(crate) before: LaidOut,
    /// By their nodes and their numbers there.
    pub(crate) instances: Vec<(u32, u32)>,
    scene: Arc<Snapshot>,
}

impl Newcomers {
    pub(crate) fn new(
        field: FieldId,
        before: LaidOut,
        instances: Vec<(u32, u32)>,
        scene: Arc<Snapshot>,
    ) -> Self {
        Self { field, before, instances, scene }
    }

    /// The field that they are to have lumels of.
    pub fn field(&self) -> FieldId {
        self.field
    }

    /// The layout with their surfaces too, and without those of instances that are gone. `gatherer` looks
    /// which backs light can reach; `goes_on` is asked now and then.
    ///
    /// # Errors
    /// [`lumencast_charts::ChartError::Interrupted`] where `goes_on` answers no, whatever the unwrapper
    /// finds wrong, and a gatherer that gave up.
    pub fn lay_out(
        &self,
        store: Option<&Store>,
        gatherer: &mut dyn Gather,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Extended, SolveError> {
        let all = &self.scene.instances;
        let mut scene = Snapshot::clone(&self.scene);
        // Surfaces of others are cut already.
        for instance in &mut scene.instances {
            instance.still &= self.instances.contains(&(instance.node.0, instance.copy));
        }
        let fronts = sheets(&scene, store, &|_| goes_on())?.sheets;
        let sheets = with_backs(fronts, &self.scene, gatherer)?;
        let is_there =
            |node: u32, copy: u32| all.iter().any(|i| (i.node.0, i.copy) == (node, copy));
        Ok(extended(&self.before, |surface| is_there(surface.node, surface.copy), &sheets)?)
    }
}
