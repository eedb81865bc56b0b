//! What has been gathered becomes what is known of lumels.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::Vec3;
use lumencast_gather::{Budget, Gathered, SumsAt};
use lumencast_light::luminance;
use rayon::prelude::*;

use super::LightmapSolver;
use super::blocks::{Block, on_page};
use super::change::{Change, Glanced};
use super::draws::is_glance;
use super::glances::stand_out;
use super::point::Point;
use super::slopes;
use super::sums::{Sum, noise, scatter};

/// What is shown of a lumel is a mean of about so many: the filter's.
const ALIKE: f32 = 64.0;
/// So many samples a lumel are better than the light of probes.
const ENOUGH: f32 = 1.5;
/// A cell that is brighter or darker by this share of its light is gathered at sooner than others.
const MUCH: f32 = 0.1;

impl LightmapSolver {
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
            let is_glance = is_glance(budget);
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
            let is_enough = !self.shows_probes || known >= ENOUGH * sums.len() as f32;
            if self.ripening.is_solved(&block) || is_enough && self.is_seen_all(number) {
                self.ripen(block, new / known, 0.0);
            }
        }
        self.due.extend(self.ripening.ripe());
    }

    /// Lets what is known follow what glances have found at receivers.
    fn follow_changes(&mut self, changes: &HashMap<u32, Vec3>) {
        let mut glanced = BTreeMap::<usize, bool>::new();
        for (receiver, change) in changes {
            let is_other = glanced.entry(self.cells.cell_of(*receiver)).or_default();
            *is_other |= luminance(change.abs()) > 0.0;
        }
        for cell in glanced.keys() {
            let is_changing = self.is_changing(*cell);
            self.cells.count_glance(*cell, is_changing);
        }
        let changed = glanced.iter().filter(|(_, is_other)| **is_other);
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
            let (mut by, mut level, scatter) = (0.0, 0.0, scatter(sums));
            for (sum, change) in sums.iter_mut().zip(changes) {
                by += luminance(change.by.abs());
                level += luminance(sum.mean());
                sum.follow(&change, scatter);
            }
            let most = blocks.entry(block).or_default();
            *most = most.max(if level > 0.0 { by / level } else { by });
            if by > MUCH * level {
                self.cells.hasten(cell);
                self.due.extend(self.readers.get(&block).into_iter().flatten().copied());
            }
        }
        for (block, change) in blocks {
            if self.ripening.is_solved(&block) {
                self.ripen(block, 0.0, change);
            }
        }
    }

    /// Whether light is another in a cell than what is shown of it, by what glances have found there.
    fn is_changing(&self, cell: usize) -> bool {
        let sums = &self.sums[self.cells.receivers_of(cell)];
        let samples = sums.iter().map(Sum::samples).sum::<f32>() / sums.len() as f32;
        let variance = scatter(sums) / (samples.max(1.0) * ALIKE);
        let glanced = self.cells.glanced_of(cell);
        let since: Vec<f32> = glanced.clone().map(|r| self.glances.since(r as u32)).collect();
        let levels = self.sums[glanced].iter().map(|sum| luminance(sum.mean()));
        stand_out(&since, levels.sum::<f32>() / since.len() as f32, variance)
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
                now: self.glances.last(receiver as u32),
                change: changes.get(&(receiver as u32)).copied().unwrap_or_default(),
                since: self.glances.since(receiver as u32),
            }
        };
        let about = self.cells.about(cell).flat_map(|about| self.cells.glanced_of(about));
        let glances: Vec<Glanced> = about.map(glanced).collect();
        let change = |receiver: usize| {
            let texel = self.texels.at(receiver as u32);
            Change::of(place(receiver), &self.points[receiver], glances.iter(), texel)
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

    /// Whether every cell of a block has samples.
    fn is_seen_all(&self, block: usize) -> bool {
        let is_seen = |cell| {
            let sums = &self.sums[self.cells.receivers_of(cell)];
            sums.iter().any(|sum| sum.samples() > 0.0)
        };
        self.cells.of_block(block).all(is_seen)
    }

    /// The block of a receiver.
    pub(crate) fn block_of(&self, receiver: usize) -> Block {
        Block::of(self.lumels[receiver], self.layout.page_size)
    }
}
