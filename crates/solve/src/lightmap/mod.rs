//! Lumels while their light is computed.

mod backs;
mod beyond;
mod cells;
mod change;
mod fill;
mod filter;
mod glances;
mod places;
mod point;
mod points;
mod ripening;
mod seams;
mod slopes;
mod sums;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use glam::{Affine3A, UVec2, Vec3};
use lumencast_charts::{LaidOut, lumels_on_pages};
use lumencast_gather::{Budget, Gathered, Job, Receiver, Shading, SumsAt};
use lumencast_light::{Field, FieldId, Layout, Light, Lightmap, Surface, luminance, slope};
use lumencast_scene::Snapshot;
use rayon::prelude::*;

use crate::blend::BlendSettings;
pub use backs::with_backs;
use cells::{BLOCK, Block, Cells, on_page};
use change::{Change, Glanced};
use filter::{Noisy, REACH, filter};
use glances::Glances;
use places::{LumelPlace, lumel_places};
use point::Point;
pub use points::spread;
use ripening::Ripening;
use seams::Seams;
pub use seams::sides_of_seams;
use slopes::Slopes;
use sums::{Sum, noise};

/// What a lumel has in place of a receiver where no surface covers it.
const NO_RECEIVER: u32 = u32::MAX;

/// What has moved gets lumels again once it has rested for so many seconds of scene time.
const RESTING: f64 = 2.0;

/// So many blocks are solved at a time, beside those that cannot wait.
const DUE_AT_ONCE: usize = 4;

/// Light is changing where glances differ by this share of it.
const CHANGING: f32 = 0.02;
/// A cell that is brighter or darker by this share of its light is gathered at sooner than others.
const MUCH: f32 = 0.1;

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

/// What is shown of a block's lumels, row by row of [`BLOCK`].
struct Solved {
    irradiance: Vec<Vec3>,
    slopes: Option<Vec<Vec3>>,
}

/// What makes light of lumels' sums.
#[derive(Clone, Debug)]
pub struct LightmapSolver {
    id: FieldId,
    settings: BlendSettings,
    texel: f32,
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
    /// Blocks that are solved next.
    news: BTreeSet<Block>,
    /// Blocks that are solved by and by: much more is known of them, or of what they read of others.
    due: BTreeSet<Block>,
    ripening: Ripening,
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
    /// Those that get none: their surfaces take none, or there is no room.
    without: BTreeSet<InstanceId>,
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
        beyond::go_on(&mut receiver_of, &points, scene, &layout, laid_out.texel);
        let readers = beyond::readers(&receiver_of, &lumels, layout.page_size);
        let placed = placed(scene, &layout);
        let still = scene.instances.iter().filter(|instance| instance.still);
        let ids = still.map(|instance| (instance.node.0, instance.copy));
        Self {
            id,
            settings,
            texel: laid_out.texel,
            cells,
            lumels,
            points,
            receiver_of: receiver_of.into(),
            sums: vec![Sum::default(); places.len()],
            glances: Glances::default(),
            slopes: None,
            seams: Arc::new(Seams::new(scene, &layout)),
            in_turns: false,
            news: BTreeSet::new(),
            due: BTreeSet::new(),
            ripening: Ripening::default(),
            readers: Arc::new(readers),
            beside: Arc::new(empty_beside(&places, layout.page_size)),
            without: ids.filter(|id| !placed.contains_key(id)).collect(),
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

    /// Number of lumels within something.
    pub fn buried_count(&self) -> usize {
        self.sums.iter().filter(|sum| sum.is_buried()).count()
    }

    /// What to gather: so many samples a lumel.
    pub fn job(&self, scene: Arc<Snapshot>, samples: u32) -> Job {
        let receivers: Vec<Receiver> =
            self.points.iter().map(|point| self.receiver(point)).collect();
        Job::new(scene, receivers, samples)
    }

    /// What to gather next where light is live: about so many samples in all, of those lumels whose turn
    /// it is. The job has these alone; the budgets that come with it tell which they are, for
    /// [`Self::take`].
    pub fn next_job(&mut self, scene: Arc<Snapshot>, samples: u64) -> (Job, Vec<Budget>) {
        self.in_turns = true;
        let mut budgets = self.cells.budgets(samples, scene.version, &self.lumels);
        if self.settings.significance.is_infinite() {
            budgets.iter_mut().for_each(|budget| budget.seed = None);
        }
        let point = |budget: &Budget| self.receiver(&self.points[budget.receiver as usize]);
        let receivers: Vec<Receiver> = budgets.iter().map(point).collect();
        let own = (0..).zip(&budgets).map(|(receiver, of)| Budget { receiver, ..*of });
        (Job::with_budgets(scene, receivers, own.collect()), budgets)
    }

    /// Leaves out of the layout what has moved: its lumels are where it was. What is back where it was,
    /// or has rested where it is until its lumels there were gathered at, has them again. Whether that is
    /// another layout.
    pub fn follow(&mut self, scene: &Snapshot, shown: &mut Lightmap) -> bool {
        let is_same = self.followed.replace(scene.version) == Some(scene.version);
        if is_same && self.moved.is_empty() && self.newcomers.is_empty() {
            return false;
        }
        let now: HashMap<InstanceId, Affine3A> = scene
            .instances
            .iter()
            .filter(|instance| instance.still)
            .map(|instance| ((instance.node.0, instance.copy), instance.world_from_object))
            .collect();
        self.follow_newcomers(&now, scene.time);
        let ids: Vec<InstanceId> = self.placed.keys().copied().collect();
        let mut is_other = false;
        for id in ids {
            is_other |= self.follow_instance(id, now.get(&id).copied(), scene);
        }
        if is_other {
            shown.layout = self.resting();
        }
        is_other
    }

    /// Where the surfaces lie that have not moved.
    fn resting(&self) -> Arc<Layout> {
        let Layout { page_size, pages, .. } = *self.layout;
        let is_there = |surface: &&Surface| !self.moved.contains_key(&instance_of(surface));
        let surfaces = self.layout.surfaces().iter().filter(is_there).cloned().collect();
        Arc::new(Layout::new(page_size, pages, surfaces))
    }

    /// Remembers since when instances rest that have no lumels yet.
    fn follow_newcomers(&mut self, now: &HashMap<InstanceId, Affine3A>, time: f64) {
        self.newcomers.retain(|id, _| now.contains_key(id));
        for (id, at) in now {
            if self.placed.contains_key(id) || self.without.contains(id) {
                continue;
            }
            let resting = Moved { at: Some(*at), since: time };
            let known = self.newcomers.entry(*id).or_insert(resting);
            if known.at != Some(*at) {
                *known = resting;
            }
        }
    }

    /// Instances without lumels that have rested long enough to get some.
    pub(crate) fn newcomers(&self, time: f64) -> Vec<InstanceId> {
        let rested = self.newcomers.iter().filter(|(_, at)| time - at.since >= RESTING);
        rested.map(|(id, _)| *id).collect()
    }

    /// Where all surfaces lie, and how large a lumel is.
    pub(crate) fn laid_out(&self) -> LaidOut {
        LaidOut { layout: Layout::clone(&self.layout), texel: self.texel, coarser: false }
    }

    /// How updates are blended, and whether lumels tell how light depends on the normal.
    pub(crate) fn settings(&self) -> (BlendSettings, bool) {
        (self.settings, self.slopes.is_some())
    }

    /// Instances that get no lumels.
    pub(crate) fn go_without(&mut self, instances: &[InstanceId]) {
        self.without.extend(instances);
        self.newcomers.retain(|id, _| !instances.contains(id));
    }

    /// Has other lumels from now on, whose layout keeps the place of surfaces that there are. What is
    /// known of lumels is kept. Instances that are `tried` and are not among those placed get none; those
    /// that are show their lumels once they were gathered at.
    pub(crate) fn extend(
        &mut self,
        scene: &Snapshot,
        mut new: Self,
        tried: &[InstanceId],
        shown: &mut Lightmap,
    ) {
        for (receiver, lumel) in new.lumels.iter().enumerate() {
            let entry = self.receiver_of.get(*lumel as usize);
            let Some(before) = entry.and_then(|entry| beyond::own(*entry)) else { continue };
            if self.points[before as usize] == new.points[receiver] {
                new.sums[receiver] = self.sums[before as usize];
                new.glances.keep(receiver as u32, &self.glances, before);
                if let Some((new, old)) = new.slopes.as_mut().zip(self.slopes.as_ref()) {
                    new.keep(receiver, old, before as usize);
                }
            }
        }
        for lumels in std::iter::once(&mut shown.irradiance).chain(&mut shown.slopes) {
            lumels.resize(new.layout.lumel_count(), Vec3::ZERO);
        }
        let (with, without): (Vec<InstanceId>, Vec<InstanceId>) =
            tried.iter().partition(|id| new.placed.contains_key(id));
        new.without = std::mem::take(&mut self.without);
        new.newcomers = std::mem::take(&mut self.newcomers);
        new.newcomers.retain(|id, _| !new.placed.contains_key(id));
        new.go_without(&without);
        new.moved = std::mem::take(&mut self.moved);
        new.moved.retain(|id, _| new.placed.contains_key(id));
        for id in with {
            let at = new.placed.get(&id).copied();
            new.moved.insert(id, Moved { at, since: scene.time });
        }
        for id in new.moved.keys().copied().collect::<Vec<_>>() {
            new.hurry(id);
        }
        shown.layout = new.resting();
        *self = new;
        // The scene may have changed since they were placed.
        self.follow(scene, shown);
    }

    /// Whether an instance that is at a place now, or gone, has lumels otherwise than before.
    fn follow_instance(&mut self, id: InstanceId, at: Option<Affine3A>, scene: &Snapshot) -> bool {
        let is_home = at == self.placed.get(&id).copied();
        let Some(moved) = self.moved.get_mut(&id) else {
            if !is_home {
                self.moved.insert(id, Moved { at, since: scene.time });
            }
            return !is_home;
        };
        let comes = moved.at != at;
        if comes {
            *moved = Moved { at, since: scene.time };
        }
        let rests = scene.time - moved.since >= RESTING;
        if comes && is_home {
            self.hurry(id);
        }
        if is_home {
            let is_known = self.receivers_of(id).all(|r| self.sums[r as usize].is_settled());
            if is_known {
                self.moved.remove(&id);
            }
            return is_known;
        }
        if let Some(at) = at.filter(|_| rests) {
            self.placed.insert(id, at);
            self.place_anew(id, scene);
        }
        false
    }

    /// Puts the lumels of an instance to where it is now.
    fn place_anew(&mut self, id: InstanceId, scene: &Snapshot) {
        let own = self.layout.surfaces().iter().filter(|surface| instance_of(surface) == id);
        let Layout { page_size, pages, .. } = *self.layout;
        let places = lumel_places(scene, &Layout::new(page_size, pages, own.cloned().collect()));
        let mut points = self.points.to_vec();
        for LumelPlace { lumel, position, normal } in places {
            let receiver = self.receiver_of[lumel as usize] as usize;
            points[receiver] = Point::new(position, normal);
            self.sums[receiver] = Sum::default();
            self.glances.forget(receiver as u32);
            self.ripening.forget(&Block::of(lumel, page_size));
        }
        self.points = points.into();
        self.hurry(id);
    }

    /// Lets an instance's lumels be gathered at before all others.
    fn hurry(&mut self, id: InstanceId) {
        let own: Vec<u32> = self.receivers_of(id).collect();
        self.cells.hurry(own.into_iter());
    }

    /// The receivers of an instance's lumels.
    fn receivers_of(&self, id: InstanceId) -> impl Iterator<Item = u32> + '_ {
        let own = self.layout.surfaces().iter().filter(move |surface| instance_of(surface) == id);
        let lumels = own.flat_map(|surface| lumels_on_pages(&self.layout, surface));
        lumels.map(|(index, _)| self.receiver_of[index])
    }

    /// The scene was edited: light may be another from now on.
    pub fn expect_change(&mut self) {
        self.cells.expect_change();
    }

    /// Adds what was gathered; `budgets` tell at which lumels. What is not finite does not count. What is
    /// known follows what glances have found, but for those that were the first at their lumel: these are
    /// as good as any samples.
    pub fn take(&mut self, gathered: &Gathered, budgets: &[Budget]) {
        let found = budgets.iter().zip(gathered.sums.iter());
        let found = found.filter_map(|(budget, found)| Some((budget, Sum::of(&found)?, found)));
        let found: Vec<(&Budget, Sum, SumsAt<'_>)> = found.collect();
        let mut changes = HashMap::new();
        let mut samples = Vec::new();
        for (budget, new, found) in &found {
            let is_glance = budget.seed.is_some();
            match is_glance.then(|| self.glances.look(budget.receiver, new.mean())).flatten() {
                Some(change) => drop(changes.insert(budget.receiver, change)),
                None => samples.push((budget.receiver, new, slopes::sum_of(found))),
            }
        }
        self.follow_changes(&changes);
        let mut blocks = BTreeMap::<usize, f32>::new();
        for (receiver, new, slope) in samples {
            let sum = &mut self.sums[receiver as usize];
            let before = *sum;
            sum.add(new, self.settings.ratio);
            self.glances.add(receiver, new.samples() / sum.samples());
            if let Some(slopes) = &mut self.slopes {
                slopes.add(receiver as usize, slope, [&before, new, sum]);
            }
            let block = self.cells.block_of(self.cells.cell_of(receiver));
            *blocks.entry(block).or_default() += new.samples();
        }
        for (number, new) in blocks {
            let receivers = self.cells.receivers_of_block(number);
            let block = self.block_of(receivers.start);
            let sums = &self.sums[receivers];
            self.cells.set_noise(number, noise(sums));
            let known: f32 = sums.iter().map(Sum::samples).sum();
            self.ripen(block, new / known, 0.0);
        }
        self.due.extend(self.ripening.ripe());
    }

    /// Lets what is known follow what glances have found at receivers.
    fn follow_changes(&mut self, changes: &HashMap<u32, Vec3>) {
        let mut glanced = BTreeMap::<usize, [f32; 2]>::new();
        for (receiver, change) in changes {
            let [by, level] = glanced.entry(self.cells.cell_of(*receiver)).or_default();
            *by += luminance(change.abs());
            *level += luminance(self.sums[*receiver as usize].mean());
        }
        for (cell, [by, level]) in &glanced {
            self.cells.count_glance(*cell, *by > CHANGING * level);
        }
        let changed = glanced.iter().filter(|(_, [by, _])| *by > 0.0);
        let about: BTreeSet<usize> =
            changed.flat_map(|(cell, _)| self.cells.about(*cell)).collect();
        let about: Vec<usize> = about.into_iter().collect();
        let found: Vec<Vec<Change>> =
            about.par_iter().map(|cell| self.changes_of(*cell, changes)).collect();
        let mut blocks = BTreeMap::<Block, f32>::new();
        for (cell, changes) in about.into_iter().zip(found) {
            let receivers = self.cells.receivers_of(cell);
            let block = self.block_of(receivers.start);
            let sums = &mut self.sums[receivers];
            let (mut by, mut level) = (0.0, 0.0);
            for (sum, change) in sums.iter_mut().zip(changes) {
                by += luminance(change.by.abs());
                level += luminance(sum.mean());
                sum.follow(&change);
            }
            let most = blocks.entry(block).or_default();
            *most = most.max(if level > 0.0 { by / level } else { by });
            if by > MUCH * level {
                self.cells.hasten(cell);
                self.due.extend(self.readers.get(&block).into_iter().flatten());
            }
        }
        for (block, change) in blocks {
            self.ripen(block, 0.0, change);
        }
    }

    /// How the light of a cell's lumels has changed, by what glances have found at receivers.
    fn changes_of(&self, cell: usize, changes: &HashMap<u32, Vec3>) -> Vec<Change> {
        let place =
            |receiver: usize| on_page(self.lumels[receiver], self.layout.page_size).1.as_ivec2();
        let glanced = |receiver: usize| {
            let Point { position, .. } = self.points[receiver];
            Glanced {
                at: place(receiver),
                position,
                normal: self.points[receiver].normal(),
                change: changes.get(&(receiver as u32)).copied().unwrap_or_default(),
                since: self.glances.since(receiver as u32),
            }
        };
        let about = self.cells.about(cell).flat_map(|about| self.cells.glanced_of(about));
        let glances: Vec<Glanced> = about.map(glanced).collect();
        let change = |receiver: usize| {
            Change::of(place(receiver), &self.points[receiver], glances.iter(), self.texel)
        };
        self.cells.receivers_of(cell).map(change).collect()
    }

    /// More is known of a block than is solved: new samples are this share of what is known, or its light
    /// has changed by a share of it.
    fn ripen(&mut self, block: Block, samples: f32, change: f32) {
        let at_once = self.ripening.add(block, samples, change);
        if at_once || !self.in_turns {
            self.news.insert(block);
        }
    }

    /// The block of a receiver.
    fn block_of(&self, receiver: usize) -> Block {
        Block::of(self.lumels[receiver], self.layout.page_size)
    }

    /// Makes light of what has been taken in since the last time: filtered on the surface where
    /// `filtered`, spread to where nothing is known, and the same on both sides of seams. `shown` is what
    /// [`Self::dark`] made, with all that has been solved since.
    pub fn solve(&mut self, filtered: bool, shown: &mut Lightmap) {
        let mut news = std::mem::take(&mut self.news);
        self.due.retain(|block| !news.contains(block));
        for _ in 0..DUE_AT_ONCE {
            news.extend(self.due.pop_first());
        }
        news.iter().for_each(|block| self.ripening.solved(*block));
        let beside = news.iter().filter_map(|block| self.beside.get(block)).flatten();
        let beside: Vec<Block> = beside.copied().collect();
        news.extend(beside);
        let news: Vec<Block> = news.into_iter().collect();
        let solved: Vec<Solved> =
            news.par_iter().map(|block| self.solved(block, filtered)).collect();
        let size = self.layout.page_size;
        for (block, solved) in news.iter().zip(solved) {
            self.put(block, &solved.irradiance, &mut shown.irradiance);
            if let Some((solved, shown)) = solved.slopes.zip(shown.slopes.as_mut()) {
                self.put(block, &solved, shown);
            }
        }
        let seams = self.seams.about(|lumel| news.binary_search(&Block::of(lumel, size)).is_ok());
        let of = |lumel: &u32| self.known(beyond::own(self.receiver_of[*lumel as usize])?);
        let is_known = |lumel: &u32| of(lumel).is_some_and(|l| l.variance < f32::INFINITY);
        let known: Vec<bool> = seams.lumels().iter().map(is_known).collect();
        seams.apply(&mut shown.irradiance, &known);
        if let Some(slopes) = &mut shown.slopes {
            seams.apply_signed(slopes, &known);
        }
    }

    /// Puts the lumels of a block, row by row of [`BLOCK`], among those of all pages.
    fn put(&self, block: &Block, lumels: &[Vec3], into: &mut [Vec3]) {
        let size = self.layout.page_size;
        for (row, lumels) in (block.corner().y..size).zip(lumels.chunks(BLOCK as usize)) {
            let columns = (size - block.corner().x).min(BLOCK) as usize;
            let first = self.layout.index(block.page, UVec2::new(block.corner().x, row));
            into[first..first + columns].copy_from_slice(&lumels[..columns]);
        }
    }

    /// The light of a block, with those about it that count for it.
    fn solved(&self, block: &Block, filtered: bool) -> Solved {
        let size = self.layout.page_size as i32;
        let side = BLOCK + 2 * REACH;
        let low = block.corner().as_ivec2() - REACH as i32;
        let entries: Vec<u32> = (0..side * side)
            .map(|k| {
                let at = low + UVec2::new(k % side, k / side).as_ivec2();
                let is_on_page = at.min_element() >= 0 && at.max_element() < size;
                let index = is_on_page.then(|| self.layout.index(block.page, at.as_uvec2()));
                index.map_or(NO_RECEIVER, |index| self.receiver_of[index])
            })
            .collect();
        let noisy = |entry: &u32| self.known(beyond::receiver(*entry)?);
        let mut window: Vec<Option<Noisy>> = entries.iter().map(noisy).collect();
        if filtered {
            filter(&mut window, side, self.texel, REACH);
        }
        let known: Vec<Option<Noisy>> = entries
            .iter()
            .zip(window)
            .map(|(entry, lumel)| {
                beyond::own(*entry).and(lumel).filter(|lumel| lumel.variance < f32::INFINITY)
            })
            .collect();
        let filled = |of: &dyn Fn(&Noisy) -> Vec3| -> Vec<Vec3> {
            let mut light: Vec<Vec3> =
                known.iter().map(|lumel| lumel.as_ref().map_or(Vec3::ZERO, of)).collect();
            fill::fill(&mut light, side, |number| known[number].is_some());
            let rows = light.chunks(side as usize).skip(REACH as usize).take(BLOCK as usize);
            rows.flat_map(|row| &row[REACH as usize..(REACH + BLOCK) as usize]).copied().collect()
        };
        let of_slope = |lumel: &Noisy| slope(lumel.slope, luminance(lumel.irradiance));
        Solved {
            irradiance: filled(&|lumel| lumel.irradiance),
            slopes: self.slopes.as_ref().map(|_| filled(&of_slope)),
        }
    }

    /// What is known at a receiver; nothing where it lies within something.
    fn known(&self, receiver: u32) -> Option<Noisy> {
        let receiver = receiver as usize;
        let point = self.points[receiver];
        let (irradiance, variance) = self.sums[receiver].known()?;
        let slope = self.slopes.as_ref().map(|slopes| slopes.at(receiver) * luminance(irradiance));
        let (position, normal, slope) = (point.position, point.normal(), slope.unwrap_or_default());
        Some(Noisy { position, normal, irradiance, slope, variance })
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

/// The blocks in which no surface lies, beside those in which some do.
fn empty_beside(places: &[LumelPlace], page_size: u32) -> BTreeMap<Block, Vec<Block>> {
    let covered: BTreeSet<Block> = places.iter().map(|p| Block::of(p.lumel, page_size)).collect();
    let empty = |block: &Block| {
        let beside = block.beside(page_size).filter(|beside| !covered.contains(beside));
        (*block, beside.collect())
    };
    covered.iter().map(empty).filter(|(_, beside): &(_, Vec<_>)| !beside.is_empty()).collect()
}
