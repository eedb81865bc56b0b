//! Lumels while their light is computed.

mod backs;
mod beyond;
mod blocks;
mod cells;
mod change;
mod draws;
mod fill;
mod filter;
mod glances;
mod instances;
mod materials;
mod places;
mod point;
mod points;
mod queue;
mod ripening;
mod seams;
mod slopes;
mod solving;
mod sums;
mod taking;
mod texels;

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::sync::Arc;

use glam::{Affine3A, Vec3};
use lumencast_charts::LaidOut;
use lumencast_gather::{Budget, Draws, Job, Receiver, Shading};
use lumencast_light::{Field, FieldId, Layout, Light, Lightmap, Surface, SurfaceId};
use lumencast_scene::Snapshot;

use crate::blend::BlendSettings;
pub use backs::with_backs;
use blocks::Block;
use cells::Cells;
use draws::Part;
use glances::Glances;
use places::{LumelPlace, lumel_places};
use point::Point;
pub use points::spread;
use queue::Queue;
use ripening::Ripening;
pub use seams::SeamPoints;
use seams::Seams;
use slopes::Slopes;
pub use solving::BLOCKS_AT_ONCE;
use sums::Sum;
use texels::Texels;

/// What a lumel has in place of a receiver where no surface covers it.
const NO_RECEIVER: u32 = u32::MAX;

/// An instance, by its node and its number there.
type InstanceId = (u32, u32);

/// An instance that has moved.
#[derive(Clone, Copy, Debug)]
struct Moved {
    /// Where it is; nothing where it is gone, or no longer still.
    at: Option<Affine3A>,
    /// Scene time since when, seconds.
    since: f64,
}

/// What makes light of lumels' sums.
#[derive(Clone, Debug)]
pub struct LightmapSolver {
    id: FieldId,
    settings: BlendSettings,
    texels: Texels,
    cells: Cells,
    /// Lumels that lie on surfaces, by their index among those of all pages; one a receiver, cell by
    /// cell.
    lumels: Arc<[u32]>,
    points: Arc<[Point]>,
    /// The receivers of the lumels of all pages; about charts, those that lie there ([`beyond`]).
    receiver_of: Arc<[u32]>,
    sums: Vec<Sum>,
    glances: Glances,
    /// Where lumels tell how light depends on the normal.
    slopes: Option<Slopes>,
    seams: Arc<Seams>,
    /// Whether lumels are gathered at in turns: light is live.
    in_turns: bool,
    /// Blocks that are solved next: their light is another, or they never were.
    news: Queue,
    /// Blocks that are solved by and by: much more is known of them, or of what they read of others.
    due: Queue,
    ripening: Ripening,
    /// Whether there are probes, so that their light is shown where little is known.
    shows_probes: bool,
    /// Blocks that were not solved yet: those that show nothing or light of before an edit, and those that
    /// show the light of probes. The first ones are the next to show it.
    dark: VecDeque<Block>,
    unknown: VecDeque<Block>,
    /// Blocks without surfaces beside those that have some: they are solved with these.
    beside: Arc<BTreeMap<Block, Vec<Block>>>,
    /// Blocks that read light of a block when they are filtered.
    readers: Arc<BTreeMap<Block, Vec<Block>>>,
    /// Where all surfaces lie, those of instances that have moved too.
    layout: Arc<Layout>,
    /// The instances, and where they were when their lumels were placed.
    placed: HashMap<InstanceId, Affine3A>,
    /// Those that are elsewhere now, or have lumels that wait for light.
    moved: BTreeMap<InstanceId, Moved>,
    /// Still instances without lumels: where they are, and since when, seconds of scene time.
    newcomers: BTreeMap<InstanceId, Moved>,
    /// Those that get none, and how many of their primitives would show some: there was no room.
    without: BTreeMap<InstanceId, usize>,
    /// Surfaces that show no lumels, since their material is another than it was.
    blank: BTreeSet<SurfaceId>,
    /// The version of the scene that was followed last.
    followed: Option<u64>,
}

impl LightmapSolver {
    /// Lumels of a scene, dark.
    pub fn new(id: FieldId, scene: &Snapshot, laid_out: &LaidOut, settings: BlendSettings) -> Self {
        let layout = Arc::new(laid_out.layout.clone());
        let mut places = lumel_places(scene, &layout);
        let cells = Cells::new(&mut places, layout.page_size);
        let mut receiver_of = vec![NO_RECEIVER; layout.lumel_count()];
        for (place, receiver) in places.iter().zip(0..) {
            receiver_of[place.lumel as usize] = receiver;
        }
        let points: Arc<[Point]> =
            places.iter().map(|place| Point::new(place.position, place.normal)).collect();
        let lumels: Arc<[u32]> = places.iter().map(|place| place.lumel).collect();
        let texels = Texels::new(laid_out, &receiver_of, places.len());
        beyond::go_on(&mut receiver_of, &points, scene, laid_out, &texels);
        let readers = beyond::readers(&receiver_of, &lumels, layout.page_size);
        let placed = placed(scene, &layout);
        Self {
            id,
            settings,
            texels,
            cells,
            lumels,
            points,
            receiver_of: receiver_of.into(),
            sums: vec![Sum::default(); places.len()],
            glances: Glances::default(),
            slopes: None,
            seams: Arc::new(Seams::new(scene, &layout)),
            in_turns: false,
            news: Queue::default(),
            due: Queue::default(),
            ripening: Ripening::default(),
            dark: covered(&places, layout.page_size).into_iter().collect(),
            unknown: VecDeque::new(),
            shows_probes: false,
            readers: Arc::new(readers),
            beside: Arc::new(empty_beside(&places, layout.page_size)),
            without: instances::without(scene, |id| !placed.contains_key(id)),
            blank: BTreeSet::new(),
            placed,
            moved: BTreeMap::new(),
            newcomers: BTreeMap::new(),
            followed: None,
            layout,
        }
    }

    /// The same, whose lumels also tell how light depends on the normal, or do not: 12 bytes a lumel.
    #[must_use]
    pub fn with_slopes(self, directional: bool) -> Self {
        let slopes = directional.then(|| Slopes::new(self.sums.len()));
        Self { slopes, ..self }
    }

    pub(crate) fn id(&self) -> FieldId {
        self.id
    }

    /// Where all surfaces lie, those of instances that have moved too.
    pub(crate) fn layout(&self) -> &Layout {
        &self.layout
    }

    /// What a lumel gathers as.
    fn receiver(&self, point: &Point) -> Receiver {
        point.receiver(if self.slopes.is_some() { Shading::Tilted } else { Shading::Own })
    }

    /// Number of lumels that lie on surfaces.
    pub fn lumel_count(&self) -> usize {
        self.lumels.len()
    }

    /// Bytes of memory that grow with the number of lumels, without the light that is shown.
    pub fn bytes(&self) -> usize {
        let Self { lumels, points, receiver_of, sums, .. } = self;
        size_of_val(&**lumels)
            + size_of_val(&**points)
            + size_of_val(&**receiver_of)
            + size_of_val(&**sums)
            + self.slopes.as_ref().map_or(0, Slopes::bytes)
            + self.glances.bytes()
            + self.texels.bytes()
            + self.seams.bytes()
    }

    /// Number of lumels within something.
    pub fn buried_count(&self) -> usize {
        self.sums.iter().filter(|sum| sum.is_buried()).count()
    }

    /// What to gather: so many samples a lumel.
    pub fn job(&self, scene: Arc<Snapshot>, samples: u32) -> Job {
        let receivers: Vec<Receiver> =
            self.points.iter().map(|point| self.receiver(point)).collect();
        let part = Part { spacing: 1, samples };
        let budget = |(lumel, receiver): (&u32, u32)| {
            let draws = part.of_page(*lumel, self.layout.page_size);
            Budget { receiver, samples, draws }
        };
        let budgets = self.lumels.iter().zip(0..).map(budget).collect();
        Job::with_budgets(scene, receivers, budgets)
    }

    /// What to gather next where light is live: about so many samples in all, of those lumels whose turn
    /// it is. The job has these alone; the budgets that come with it tell which they are, for
    /// [`Self::take`].
    pub fn next_job(&mut self, scene: Arc<Snapshot>, samples: u64) -> (Job, Vec<Budget>) {
        self.in_turns = true;
        let is_buried = |receiver: u32| self.sums[receiver as usize].is_certainly_buried();
        let (version, lumels) = (scene.version, &self.lumels);
        let mut budgets = self.cells.budgets(samples, version, lumels, is_buried);
        if self.settings.significance.is_infinite() {
            budgets.iter_mut().for_each(|budget| budget.draws = Draws::Own);
        }
        let point = |budget: &Budget| self.receiver(&self.points[budget.receiver as usize]);
        let receivers: Vec<Receiver> = budgets.iter().map(point).collect();
        let own = (0..).zip(&budgets).map(|(receiver, of)| Budget { receiver, ..*of });
        (Job::with_budgets(scene, receivers, own.collect()), budgets)
    }

    /// Where all surfaces lie, and how large a lumel is.
    pub(crate) fn laid_out(&self) -> LaidOut {
        self.texels.laid_out(&self.layout)
    }

    /// How updates are blended, and whether lumels tell how light depends on the normal.
    pub(crate) fn settings(&self) -> (BlendSettings, bool) {
        (self.settings, self.slopes.is_some())
    }

    /// The scene was edited: light may be another from now on.
    pub fn expect_change(&mut self) {
        self.cells.expect_change();
        self.dark.append(&mut self.unknown);
    }

    /// Irradiances that light has at the lumels that surfaces cover.
    pub(crate) fn seen(&self, light: &Light) -> Vec<Vec3> {
        let lightmap = light.field(self.id()).and_then(Field::as_lightmap).into_iter();
        lightmap
            .flat_map(|lightmap| self.lumels.iter().map(|l| lightmap.irradiance[*l as usize]))
            .collect()
    }

    /// The lightmap without light, for [`Self::solve`] to fill.
    pub fn dark(&self) -> Lightmap {
        Lightmap::dark(self.id, self.layout.clone()).with_slopes(self.slopes.is_some())
    }
}

fn instance_of(surface: &Surface) -> InstanceId {
    (surface.id.node, surface.id.copy)
}

/// Where the instances stand whose surfaces have lumels.
fn placed(scene: &Snapshot, layout: &Layout) -> HashMap<InstanceId, Affine3A> {
    let with_lumels: BTreeSet<InstanceId> = layout.surfaces().iter().map(instance_of).collect();
    let all = scene.instances.iter().map(|i| ((i.node.0, i.copy), i.world_from_object));
    all.filter(|(id, _)| with_lumels.contains(id)).collect()
}

/// The blocks in which surfaces lie.
fn covered(places: &[LumelPlace], page_size: u32) -> BTreeSet<Block> {
    places.iter().map(|place| Block::of(place.lumel, page_size)).collect()
}

/// The blocks in which no surface lies, beside those in which some do.
fn empty_beside(places: &[LumelPlace], page_size: u32) -> BTreeMap<Block, Vec<Block>> {
    let covered = covered(places, page_size);
    let empty = |block: &Block| {
        let beside = block.beside(page_size).filter(|beside| !covered.contains(beside));
        (*block, beside.collect())
    };
    covered.iter().map(empty).filter(|(_, beside): &(_, Vec<_>)| !beside.is_empty()).collect()
}
