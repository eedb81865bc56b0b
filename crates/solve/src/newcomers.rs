//! Instances that came after surfaces were laid out on pages.

use std::sync::Arc;

use lumencast_charts::{Extended, LaidOut, Sheets, Store, extended, sheets};
use lumencast_gather::Gather;
use lumencast_light::{FieldId, Layout, SurfaceId};
use lumencast_scene::Snapshot;

use crate::blend::BlendSettings;
use crate::error::SolveError;
use crate::lightmap::{LightmapSolver, with_backs};

/// Still instances that rest and have no lumels yet. Cutting them into charts and placing lumels takes
/// its time, and needs nothing but what is here: [`Newcomers::place`] may run beside ticks.
#[derive(Clone, Debug)]
pub struct Newcomers {
    /// The field that they are to have lumels of.
    field: FieldId,
    settings: BlendSettings,
    directional: bool,
    before: LaidOut,
    /// By their nodes and their numbers there.
    pub(crate) instances: Vec<(u32, u32)>,
    pub(crate) scene: Arc<Snapshot>,
}

/// Lumels of a layout that has room for newcomers.
#[derive(Debug)]
pub struct Placed {
    /// All lumels, dark.
    pub(crate) lumels: LightmapSolver,
    /// Surfaces that there was no room for.
    pub left_out: usize,
    /// What does not serve, by name, and why.
    pub notes: Vec<String>,
}

impl Placed {
    /// Where surfaces lie.
    pub fn layout(&self) -> &Layout {
        self.lumels.layout()
    }
}

impl Newcomers {
    /// Those that a lightmap has by now; nothing where there are none.
    pub(crate) fn of(lightmap: &LightmapSolver, scene: &Arc<Snapshot>) -> Option<Self> {
        let instances = lightmap.newcomers(scene.time);
        let (settings, directional) = lightmap.settings();
        (!instances.is_empty()).then(|| Self {
            field: lightmap.id(),
            settings,
            directional,
            before: lightmap.laid_out(),
            instances,
            scene: scene.clone(),
        })
    }

    /// The field that they are to have lumels of.
    pub fn field(&self) -> FieldId {
        self.field
    }

    /// The lumels of a layout with their surfaces too, and without those of instances that are gone.
    /// `gatherer` looks which backs light can reach; `goes_on` is asked now and then. It works on one thread
    /// of its own: among those that all share, work of ticks would wait for the end of a cut.
    ///
    /// # Errors
    /// [`lumencast_charts::ChartError::Interrupted`] where `goes_on` answers no, whatever the unwrapper
    /// finds wrong, a gatherer that gave up, and a system without a thread to spare.
    pub fn place(
        &self,
        store: Option<&Store>,
        gatherer: &mut dyn Gather,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Placed, SolveError> {
        let own = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let own = own.map_err(|error| SolveError::NoThread(error.to_string()))?;
        own.install(|| self.place_here(store, gatherer, goes_on))
    }

    fn place_here(
        &self,
        store: Option<&Store>,
        gatherer: &mut dyn Gather,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Placed, SolveError> {
        let (Extended { laid_out, left_out }, notes) = self.lay_out(store, gatherer, goes_on)?;
        let lumels = LightmapSolver::new(self.field, &self.scene, &laid_out, self.settings)
            .with_slopes(self.directional);
        Ok(Placed { lumels, left_out: left_out.len(), notes })
    }

    fn lay_out(
        &self,
        store: Option<&Store>,
        gatherer: &mut dyn Gather,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<(Extended, Vec<String>), SolveError> {
        let all = &self.scene.instances;
        let mut scene = Snapshot::clone(&self.scene);
        // Surfaces of others are cut already.
        for instance in &mut scene.instances {
            instance.still &= self.instances.contains(&(instance.node.0, instance.copy));
        }
        let Sheets { sheets, notes } = sheets(&scene, store, &|_| goes_on())?;
        let sheets = with_backs(sheets, &self.scene, gatherer)?;
        let is_there =
            |node: u32, copy: u32| all.iter().any(|i| (i.node.0, i.copy) == (node, copy));
        let keeps = |surface: SurfaceId| is_there(surface.node, surface.copy);
        Ok((extended(&self.before, keeps, &sheets)?, notes))
    }
}
