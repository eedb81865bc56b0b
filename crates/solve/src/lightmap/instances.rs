//! Instances that move, rest, come and go, and what becomes of their lumels.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use glam::{Affine3A, Vec3};
use lumencast_charts::lumels_on_pages;
use lumencast_light::{Layout, Lightmap, Surface};
use lumencast_scene::{Instance, Snapshot};

use super::blocks::Block;
use super::materials::{blank, showing};
use super::places::{LumelPlace, lumel_places};
use super::point::Point;
use super::sums::Sum;
use super::{InstanceId, LightmapSolver, Moved, beyond, instance_of};

/// What has moved gets lumels again once it has rested for so many seconds of scene time. What is gone
/// leaves its place to others after as long.
const RESTING: f64 = 2.0;

impl LightmapSolver {
    /// Leaves out of the layout what has moved: its lumels are where it was. What is back where it was,
    /// or has rested where it is until its lumels there were gathered at, has them again. What shows no
    /// lumels, since its material is another, is left out as long. Whether that is another layout.
    pub fn follow(&mut self, scene: &Snapshot, shown: &mut Lightmap) -> bool {
        let is_same = self.followed.replace(scene.version) == Some(scene.version);
        if is_same && self.moved.is_empty() && self.newcomers.is_empty() {
            return false;
        }
        let now: HashMap<InstanceId, &Instance> = still(scene).collect();
        self.follow_newcomers(&now, scene);
        let blank = blank(&self.layout, &now, scene);
        let mut is_other = blank != self.blank;
        self.blank = blank;
        let ids: Vec<InstanceId> = self.placed.keys().copied().collect();
        for id in ids {
            let at = now.get(&id).map(|instance| instance.world_from_object);
            is_other |= self.follow_instance(id, at, scene);
        }
        if is_other {
            shown.layout = self.resting();
        }
        is_other
    }

    /// Where the surfaces lie that have not moved and show lumels.
    fn resting(&self) -> Arc<Layout> {
        let Layout { page_size, pages, .. } = *self.layout;
        let is_there = |surface: &&Surface| {
            !self.moved.contains_key(&instance_of(surface)) && !self.blank.contains(&surface.id)
        };
        let surfaces = self.layout.surfaces().iter().filter(is_there).cloned().collect();
        Arc::new(Layout::new(page_size, pages, surfaces))
    }

    /// Remembers since when instances rest that have no lumels yet. Those that were to have none come again
    /// once more of their primitives show some.
    fn follow_newcomers(&mut self, now: &HashMap<InstanceId, &Instance>, scene: &Snapshot) {
        self.newcomers.retain(|id, _| now.contains_key(id));
        self.without.retain(|id, showed| {
            now.get(id).is_some_and(|instance| showing(instance, scene) <= *showed)
        });
        for (id, instance) in now {
            if self.placed.contains_key(id) || self.without.contains_key(id) {
                continue;
            }
            let at = Some(instance.world_from_object);
            let resting = Moved { at, since: scene.time };
            let known = self.newcomers.entry(*id).or_insert(resting);
            if known.at != at {
                *known = resting;
            }
        }
    }

    /// Instances without lumels that have rested long enough to get some. They wait until clients know what
    /// is gone, since they may get its place.
    pub(crate) fn newcomers(&self, time: f64) -> Vec<InstanceId> {
        let rests = |since: f64| time - since >= RESTING;
        if self.moved.values().any(|moved| moved.at.is_none() && !rests(moved.since)) {
            return Vec::new();
        }
        let rested = self.newcomers.iter().filter(|(_, at)| rests(at.since));
        rested.map(|(id, _)| *id).collect()
    }

    /// Instances that get no lumels, as they are in a scene.
    pub(crate) fn go_without(&mut self, instances: &[InstanceId], scene: &Snapshot) {
        self.without.extend(without(scene, |id| instances.contains(id)));
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
        let known = new.lumels.iter().zip(&new.sums).filter(|(_, sum)| sum.samples() > 0.0);
        let known: BTreeSet<Block> =
            known.map(|(lumel, _)| Block::of(*lumel, new.layout.page_size)).collect();
        new.dark.retain(|block| !known.contains(block));
        for lumels in std::iter::once(&mut shown.irradiance).chain(&mut shown.slopes) {
            lumels.resize(new.layout.lumel_count(), Vec3::ZERO);
        }
        let (with, without): (Vec<InstanceId>, Vec<InstanceId>) =
            tried.iter().partition(|id| new.placed.contains_key(id));
        new.without = std::mem::take(&mut self.without);
        new.newcomers = std::mem::take(&mut self.newcomers);
        new.newcomers.retain(|id, _| !new.placed.contains_key(id));
        new.go_without(&without, scene);
        new.blank = std::mem::take(&mut self.blank);
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
            let is_shown = self.is_settled(id) && self.is_solved(id);
            if is_shown {
                self.moved.remove(&id);
            }
            return is_shown;
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

    /// Whether enough has arrived at all lumels of an instance.
    fn is_settled(&self, id: InstanceId) -> bool {
        self.receivers_of(id).all(|receiver| self.sums[receiver as usize].is_settled())
    }

    /// Whether what is shown of an instance's lumels is the light of where it is.
    fn is_solved(&self, id: InstanceId) -> bool {
        let blocks: BTreeSet<Block> =
            self.receivers_of(id).map(|receiver| self.block_of(receiver as usize)).collect();
        blocks.iter().all(|block| self.ripening.is_solved(block))
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
}

/// Those of the still instances that are to have no lumels: of each how many primitives would show some.
pub(super) fn without(
    scene: &Snapshot,
    is_without: impl Fn(&InstanceId) -> bool,
) -> BTreeMap<InstanceId, usize> {
    let chosen = still(scene).filter(|(id, _)| is_without(id));
    chosen.map(|(id, instance)| (id, showing(instance, scene))).collect()
}

/// The instances that are still, by number.
fn still(scene: &Snapshot) -> impl Iterator<Item = (InstanceId, &Instance)> {
    let all = scene.instances.iter().filter(|instance| instance.still);
    all.map(|instance| ((instance.node.0, instance.copy), instance))
}
