//! What is known of lumels becomes light that can be shown.

use std::collections::BTreeSet;

use glam::{UVec2, Vec3};
use lumencast_light::{Light, Lightmap, luminance, slope};
use rayon::prelude::*;

use super::blocks::{BLOCK, Block};
use super::filter::{Noisy, REACH, filter};
use super::seams::{LIVE_ROUNDS, ROUNDS};
use super::{LightmapSolver, NO_RECEIVER, beyond, fill};

/// So many blocks are solved at a time where light is live, unless told otherwise.
pub const BLOCKS_AT_ONCE: usize = 16;
/// One of so many is left to blocks whose light is the same.
const LEFT: usize = 4;
/// At most so many of those are solved at a time.
const DUE_AT_ONCE: usize = 4;
/// More of these where there are many blocks: none waits for more than so many turns.
const DUE_WITHIN: usize = 64;
/// So many blocks that little is known of show the light of probes at a time, and so many do so again.
const DARK_AT_ONCE: usize = 16;
const UNKNOWN_AT_ONCE: usize = 2;

/// What is shown of a block's lumels, row by row of [`BLOCK`].
struct Solved {
    irradiance: Vec<Vec3>,
    slopes: Option<Vec<Vec3>>,
}

impl LightmapSolver {
    /// Makes light of what has been taken in since the last time: filtered on the surface where
    /// `filtered`, spread to where nothing is known, and the same on both sides of seams. Where nothing
    /// is known yet, the light of `probes` is shown, if there are any. `shown` is what [`Self::dark`] made, with
    /// all that has been solved since.
    pub fn solve(&mut self, filtered: bool, probes: &Light, shown: &mut Lightmap) {
        self.solve_some(BLOCKS_AT_ONCE, filtered, probes, shown);
    }

    /// The same for `most` blocks where light is live.
    pub(crate) fn solve_some(
        &mut self,
        most: usize,
        filtered: bool,
        probes: &Light,
        shown: &mut Lightmap,
    ) {
        let mut news = self.next(most);
        news.iter().for_each(|block| self.ripening.solved(*block));
        let beside = news.iter().filter_map(|block| self.beside.get(block)).flatten();
        let beside: Vec<Block> = beside.copied().collect();
        news.extend(beside);
        self.show_probes(probes, shown);
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
        let seams = self.seams.about(news.iter().map(|block| block.number(size)));
        let rounds = if self.in_turns { LIVE_ROUNDS } else { ROUNDS };
        let of = |lumel| self.known(beyond::own(self.receiver_of[lumel as usize])?);
        let is_known = |lumel| of(lumel).is_some_and(|lumel: Noisy| lumel.is_known());
        seams.close(rounds, &mut shown.irradiance, is_known);
        if let Some(slopes) = &mut shown.slopes {
            seams.close_signed(rounds, slopes, is_known);
        }
    }

    /// Blocks to be solved now. Where light is live these are `most`, in turn: most of them such whose
    /// light is another.
    fn next(&mut self, most: usize) -> BTreeSet<Block> {
        if !self.in_turns {
            self.due.take_all();
            return self.news.take_all();
        }
        let left = most.div_ceil(LEFT).min(self.due.len());
        let mut next = self.news.take(most - left);
        let others = DUE_AT_ONCE.max(self.readers.len().div_ceil(DUE_WITHIN));
        next.iter().chain(self.news.all()).for_each(|block| self.due.remove(block));
        next.extend(self.due.take(others.min(most - next.len())));
        next
    }

    /// Lets blocks that little is known of show the light of probes, some at a time, again and again until
    /// there are enough samples.
    fn show_probes(&mut self, probes: &Light, shown: &mut Lightmap) {
        self.shows_probes = probes.volumes().next().is_some();
        if !self.shows_probes {
            return;
        }
        let Self { dark, unknown, ripening, .. } = self;
        dark.retain(|block| !ripening.is_solved(block));
        unknown.retain(|block| !ripening.is_solved(block));
        let (blocks, most) = match dark.is_empty() {
            false => (dark, DARK_AT_ONCE),
            true => (&mut *unknown, UNKNOWN_AT_ONCE),
        };
        let next: Vec<Block> = blocks.drain(..most.min(blocks.len())).collect();
        unknown.extend(&next);
        let told: Vec<Vec<Vec3>> =
            next.par_iter().map(|block| self.told_by_probes(block, probes)).collect();
        for (block, told) in next.iter().zip(told) {
            self.put(block, &told, &mut shown.irradiance);
        }
    }

    /// The irradiance of probes at the lumels of a block, row by row: at some of them, and between these.
    fn told_by_probes(&self, block: &Block, probes: &Light) -> Vec<Vec3> {
        let size = self.layout.page_size;
        let receiver = |number: u32| {
            let at = block.corner() + UVec2::new(number % BLOCK, number / BLOCK);
            let is_on_page = at.max_element() < size;
            let entry = is_on_page.then(|| self.receiver_of[self.layout.index(block.page, at)])?;
            beyond::own(entry).filter(|receiver| self.cells.is_told(*receiver))
        };
        let told = |receiver: u32| {
            let point = &self.points[receiver as usize];
            probes.irradiance(point.position, point.normal()).max(Vec3::ZERO)
        };
        let told: Vec<Option<Vec3>> =
            (0..BLOCK * BLOCK).map(|number| receiver(number).map(told)).collect();
        let mut light: Vec<Vec3> = told.iter().map(|told| told.unwrap_or_default()).collect();
        fill::fill(&mut light, BLOCK, |number| told[number].is_some());
        light
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
            self.filter(&entries, &mut window);
        }
        let known: Vec<Option<Noisy>> = entries
            .iter()
            .zip(window)
            .map(|(entry, lumel)| beyond::own(*entry).and(lumel).filter(Noisy::is_known))
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

    /// Filters a window about a block, whose lumels have these entries: those of each size among
    /// themselves.
    fn filter(&self, entries: &[u32], window: &mut [Option<Noisy>]) {
        let side = BLOCK + 2 * REACH;
        let receivers = entries.iter().filter_map(|entry| beyond::receiver(*entry));
        let sizes = self.texels.among(receivers);
        if let [texel] = sizes[..] {
            filter(window, side, texel, REACH);
            return;
        }
        for texel in sizes {
            let is_of_size = |entry: u32| {
                beyond::receiver(entry).is_some_and(|receiver| self.texels.at(receiver) == texel)
            };
            let of_size =
                |(lumel, entry): (&Option<Noisy>, &u32)| lumel.filter(|_| is_of_size(*entry));
            let mut own: Vec<Option<Noisy>> = window.iter().zip(entries).map(of_size).collect();
            filter(&mut own, side, texel, REACH);
            for (lumel, own) in window.iter_mut().zip(own) {
                *lumel = own.or(*lumel);
            }
        }
    }

    /// What is known at a receiver; nothing where it lies within something.
    fn known(&self, receiver: u32) -> Option<Noisy> {
        let receiver = receiver as usize;
        let point = self.points[receiver];
        let (irradiance, variance) = self.sums[receiver].known()?;
        let slope = self.slopes.as_ref().map(|slopes| slopes.at(receiver) * luminance(irradiance));
        let (position, normal, slope) = (point.position, point.normal(), slope.unwrap_or_default());
        let samples = self.sums[receiver].samples();
        Some(Noisy { position, normal, irradiance, slope, variance, samples })
    }
}
