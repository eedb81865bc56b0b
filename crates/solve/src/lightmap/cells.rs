//! Which lumels are gathered at next, where light is live.
//!
//! Lumels lie in *cells* of 16 × 16 of a page, and cells in *blocks*, which are solved together. A
//! *glance* takes the same samples of about every sixteenth lumel of a cell each time, to tell what has
//! changed there ([`super::change`]). First of all, and whenever the scene was edited, all cells get a
//! glance: a coarse picture of every page. While the scene is another one with every job, cells whose
//! light changes get one with every job, and others get one now and then. The other samples are taken by
//! blocks in turn, all lumels of each, so that little has to be solved anew. Blocks whose light has changed
//! come first; noisy ones come more often (stride scheduling, Waldspurger and Weihl 1995). A block's first
//! turns take few samples, so that all blocks soon have some.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet, VecDeque};
use std::ops::Range;

use glam::{IVec2, Vec3};
use lumencast_gather::Budget;

use super::blocks::{BLOCK, on_page};
use super::draws::Part;
use super::places::LumelPlace;

/// Lumels a side of a cell.
const CELL: u32 = 16;
/// Cells a side of a block.
const CELLS: u32 = BLOCK / CELL;
/// Lumels a side of a square of which a glance takes one, of each surface and direction.
const GLANCE: u32 = 4;
/// The same where probes tell what is shown at first.
const TOLD: u32 = 2;
/// Samples of a lumel in a glance: as many as let a glance at all cells take so many in all, a power of two
/// within these bounds.
const GLANCES_SAMPLES: u32 = 1 << 19;
const GLANCE_SAMPLES: Range<u32> = 4..16;
/// Samples of a lumel in the first turns of a block, and in later ones.
const FIRST_SAMPLES: [u32; 3] = [2, 2, 4];
const TURN_SAMPLES: u32 = 8;
/// The same in a turn that was hurried.
const HURRIED_SAMPLES: u32 = 32;
/// In place of a turn's number, which is more, where cells are hurried.
const HURRIED: u64 = 0;
/// So many samples are taken in turns for each one of glances where light is changing, and where it was
/// not.
const CHANGES: u64 = 3;
const CALM: u64 = 32;
/// So many glances at a cell and at those about it are to find no change.
const CHANGING: u8 = 4;
/// Lumels within something are gathered at in one of so many turns.
const BURIED: u64 = 8;
/// Share of turns that all blocks have alike, however noisy they are.
const EVEN: f32 = 0.5;

/// A square of lumels that are gathered at together.
#[derive(Clone, Debug, PartialEq)]
struct Cell {
    /// Its lumels' receivers. The first ones are those of a glance, and those that probes tell of.
    receivers: Range<u32>,
    glance: u32,
    told: u32,
    /// The version of the scene at which it had its last glance.
    seen: Option<u64>,
}

/// The turns of a block.
#[derive(Clone, Debug, Default)]
struct Turns {
    cells: Range<usize>,
    /// The block with the least has the next turn.
    due: f64,
    /// The number of its last turn.
    last: u64,
    /// How many turns it has had.
    count: u8,
    /// How noisy a sample is there: the standard deviation of its luminance, by the square root of that.
    noise: f32,
}

/// The cells of all pages, and whose turn it is.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cells {
    page_size: u32,
    glance_samples: u32,
    /// Block by block.
    cells: Vec<Cell>,
    /// Cells whose light is changing, for so many more glances that find no change.
    changing: BTreeMap<usize, u8>,
    /// Where the next glance at any cell, and at one that is changing, is looked for from.
    next_glance: usize,
    next_changing: usize,
    blocks: Vec<Turns>,
    /// Cells that have not been gathered at in the turn that is under way, and how many samples of a lumel
    /// that takes.
    turn: Range<usize>,
    turn_samples: u32,
    /// Number of turns until now.
    turns: u64,
    /// Cells whose turn comes before all others.
    hurried: VecDeque<usize>,
    /// Glances that come before all turns.
    first: usize,
    /// Where cells lie: their page, column and row.
    places: Vec<(u32, IVec2)>,
    cell_at: HashMap<(u32, IVec2), usize>,
}

impl Cells {
    /// Sorts places so that those of a cell stand together, and makes the cells of them.
    pub(crate) fn new(places: &mut [LumelPlace], page_size: u32) -> Self {
        let key = |place: &LumelPlace| {
            let (page, at) = on_page(place.lumel, page_size);
            let (block, cell) = (at / BLOCK, at / CELL % CELLS);
            // Blocks in an order that jumps about the page.
            let block = (page, block.x.reverse_bits() ^ (block.y.reverse_bits() >> 1), block.y);
            (block, cell.y, cell.x)
        };
        places.sort_by_cached_key(|place| (key(place), place.lumel));
        let mut cells: Vec<Cell> = Vec::new();
        let mut blocks: Vec<Turns> = Vec::new();
        let mut first = 0;
        for block in places.chunk_by_mut(|a, b| key(a).0 == key(b).0) {
            let start = cells.len();
            for cell in block.chunk_by_mut(|a, b| key(a) == key(b)) {
                let [glance, told] = sorted(cell, page_size);
                let receivers = first..first + cell.len() as u32;
                first = receivers.end;
                cells.push(Cell { receivers, glance, told, seen: None });
            }
            blocks.push(Turns { cells: start..cells.len(), ..Turns::default() });
        }
        let place = |cell: &Cell| {
            let (page, at) = on_page(places[cell.receivers.start as usize].lumel, page_size);
            (page, (at / CELL).as_ivec2())
        };
        let places: Vec<(u32, IVec2)> = cells.iter().map(place).collect();
        let cell_at = places.iter().copied().zip(0..).collect();
        let glanced: u32 = cells.iter().map(|cell| cell.glance).sum();
        let glance_samples = 1 << (GLANCES_SAMPLES / glanced.max(1)).max(1).ilog2();
        let Range { start: fewest, end: most } = GLANCE_SAMPLES;
        Self {
            page_size,
            glance_samples: glance_samples.clamp(fewest, most),
            first: cells.len(),
            cells,
            blocks,
            places,
            cell_at,
            ..Self::default()
        }
    }

    /// Light may be another: all cells get a glance before any has its turn. Those that wait for
    /// one already are not put off.
    pub(crate) fn expect_change(&mut self) {
        self.first = self.cells.len();
    }

    /// Lets the block of a cell, whose light is another now, have its turn before those where nothing
    /// has changed.
    pub(crate) fn hasten(&mut self, cell: usize) {
        let least = self.blocks.iter().map(|block| block.due).fold(f64::INFINITY, f64::min);
        let block = self.block_of(cell);
        self.blocks[block].due = least;
    }

    /// Sets how noisy a sample is in a block: the standard deviation of its luminance, by the square root
    /// of that.
    pub(crate) fn set_noise(&mut self, block: usize, noise: f32) {
        self.blocks[block].noise = noise;
    }

    /// The number of a cell's block.
    pub(crate) fn block_of(&self, cell: usize) -> usize {
        self.blocks.partition_point(|block| block.cells.end <= cell)
    }

    /// The cells of a block.
    pub(crate) fn of_block(&self, block: usize) -> Range<usize> {
        self.blocks[block].cells.clone()
    }

    /// The receivers of a block.
    pub(crate) fn receivers_of_block(&self, block: usize) -> Range<usize> {
        let Range { start, end } = self.of_block(block);
        self.receivers_of(start).start..self.receivers_of(end - 1).end
    }

    /// The receivers of the next cell in turn.
    fn next_turn(&mut self) -> Option<Range<u32>> {
        if self.turn.is_empty() {
            let all: f32 = self.blocks.iter().map(|block| block.noise).sum();
            let mean = all / self.blocks.len() as f32;
            let next = self
                .blocks
                .iter_mut()
                .min_by(|a, b| a.due.total_cmp(&b.due).then_with(|| a.last.cmp(&b.last)))?;
            self.turns += 1;
            let first = FIRST_SAMPLES.get(usize::from(next.count));
            self.turn_samples = first.copied().unwrap_or(TURN_SAMPLES);
            next.count = next.count.saturating_add(1);
            self.turn = next.cells.clone();
            next.last = self.turns;
            let share = if mean > 0.0 { next.noise / mean } else { 1.0 };
            next.due += 1.0 / f64::from(EVEN + (1.0 - EVEN) * share);
        }
        Some(self.cells[self.turn.next()?].receivers.clone())
    }

    /// Lets the cells of these receivers have their turn next.
    pub(crate) fn hurry(&mut self, receivers: impl Iterator<Item = u32>) {
        let cells: BTreeSet<usize> = receivers.map(|receiver| self.cell_of(receiver)).collect();
        self.hurried.extend(cells);
    }

    /// Counts a glance at a cell; whether light has changed there. What changes it goes on to the cells
    /// about it.
    pub(crate) fn count_glance(&mut self, cell: usize, has_changed: bool) {
        if has_changed {
            let about: Vec<usize> = self.about(cell).collect();
            self.changing.extend(about.into_iter().map(|cell| (cell, CHANGING)));
        } else if let Entry::Occupied(mut glances) = self.changing.entry(cell) {
            *glances.get_mut() -= 1;
            if *glances.get() == 0 {
                glances.remove();
            }
        }
    }

    /// What to gather next, about so many samples in all. `lumels` are those of receivers: what a glance
    /// takes depends on them alone. Those that lie within something are left out of most turns.
    pub(crate) fn budgets(
        &mut self,
        samples: u64,
        version: u64,
        lumels: &[u32],
        is_buried: impl Fn(u32) -> bool,
    ) -> Vec<Budget> {
        let mut budgets = Vec::new();
        let (mut glances, mut calm, mut turns) = (0, 0, 0);
        while turns < samples
            && let Some(cell) = self.hurried.pop_front()
        {
            let receivers = self.cells[cell].receivers.clone();
            let part = Part { spacing: 1, samples: HURRIED_SAMPLES };
            turns += self.take(receivers, part, Some(HURRIED), lumels, &mut budgets);
        }
        while glances + calm + turns < samples && !self.cells.is_empty() {
            if self.first > 0 {
                self.first -= 1;
                match self.next_glance(version) {
                    Some(cell) => glances += self.glance_at(cell, lumels, &mut budgets),
                    None => self.first = 0,
                }
            } else if CHANGES * glances <= turns
                && let Some(cell) = self.next_changing(version)
            {
                glances += self.glance_at(cell, lumels, &mut budgets);
            } else if CALM * calm <= turns
                && let Some(cell) = self.next_glance(version)
            {
                calm += self.glance_at(cell, lumels, &mut budgets);
            } else if let Some(receivers) = self.next_turn() {
                let part = Part { spacing: 1, samples: self.turn_samples };
                let all_alike = self.turns.is_multiple_of(BURIED);
                let receivers = receivers.filter(|receiver| all_alike || !is_buried(*receiver));
                turns += self.take(receivers, part, Some(self.turns), lumels, &mut budgets);
            }
            // However many samples there are, a job asks for no more than all lumels.
            if budgets.len() >= self.receivers() {
                break;
            }
        }
        budgets
    }

    /// Lets receivers take their part of samples, in a turn or, without one, in a glance. Counts the
    /// samples.
    fn take(
        &self,
        receivers: impl Iterator<Item = u32>,
        part: Part,
        turn: Option<u64>,
        lumels: &[u32],
        budgets: &mut Vec<Budget>,
    ) -> u64 {
        let before = budgets.len();
        budgets.extend(receivers.map(|receiver| {
            let lumel = lumels[receiver as usize];
            let draws = match turn {
                Some(turn) => part.of_turn(turn, lumel, self.page_size),
                None => part.of_glance(lumel, self.page_size),
            };
            Budget { receiver, samples: part.samples, draws }
        }));
        (budgets.len() - before) as u64 * u64::from(part.samples)
    }

    /// The same for a glance at a cell.
    fn glance_at(&self, cell: usize, lumels: &[u32], budgets: &mut Vec<Budget>) -> u64 {
        let part = Part { spacing: GLANCE, samples: self.glance_samples };
        self.take(self.glanced(cell), part, None, lumels, budgets)
    }

    /// The next cell that had no glance at this version of the scene.
    fn next_glance(&mut self, version: u64) -> Option<usize> {
        let count = self.cells.len();
        let cell = (0..count)
            .map(|k| (self.next_glance + k) % count)
            .find(|cell| self.cells[*cell].seen != Some(version))?;
        self.cells[cell].seen = Some(version);
        self.next_glance = (cell + 1) % count;
        Some(cell)
    }

    /// The same among those whose light is changing.
    fn next_changing(&mut self, version: u64) -> Option<usize> {
        let after = self.changing.range(self.next_changing..);
        let all = after.chain(self.changing.range(..self.next_changing));
        let is_due = |cell: &usize| self.cells[*cell].seen != Some(version);
        let cell = all.map(|(cell, _)| *cell).find(is_due)?;
        self.cells[cell].seen = Some(version);
        self.next_changing = cell + 1;
        Some(cell)
    }

    /// The receivers of a cell that a glance takes.
    fn glanced(&self, cell: usize) -> Range<u32> {
        let Cell { receivers, glance, .. } = &self.cells[cell];
        receivers.start..receivers.start + glance
    }

    /// The cells about a cell on its page, and itself.
    pub(crate) fn about(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        let (page, at) = self.places[cell];
        let about = (0..9).map(move |k| (page, at + IVec2::new(k % 3 - 1, k / 3 - 1)));
        about.filter_map(|place| self.cell_at.get(&place).copied())
    }

    /// The cell of a receiver.
    pub(crate) fn cell_of(&self, receiver: u32) -> usize {
        self.cells.partition_point(|cell| cell.receivers.end <= receiver)
    }

    /// Whether a receiver is one of those that probes tell of, where nothing else is known.
    pub(crate) fn is_told(&self, receiver: u32) -> bool {
        let Cell { receivers, told, .. } = &self.cells[self.cell_of(receiver)];
        receiver - receivers.start < *told
    }

    /// The receivers of a cell.
    pub(crate) fn receivers_of(&self, cell: usize) -> Range<usize> {
        let Range { start, end } = self.cells[cell].receivers;
        start as usize..end as usize
    }

    /// The receivers of a cell that a glance takes.
    pub(crate) fn glanced_of(&self, cell: usize) -> Range<usize> {
        let Range { start, end } = self.glanced(cell);
        start as usize..end as usize
    }

    fn receivers(&self) -> usize {
        self.cells.last().map_or(0, |cell| cell.receivers.end as usize)
    }
}

/// Puts those lumels of a cell first that a glance takes, then those that probes tell of, and counts both.
fn sorted(cell: &mut [LumelPlace], page_size: u32) -> [u32; 2] {
    let [glance, told] = [GLANCE, TOLD].map(|side| spread_over(cell, side, page_size));
    let rank = |k: &usize| match (glance[*k], told[*k]) {
        (true, _) => 0,
        (false, true) => 1,
        (false, false) => 2,
    };
    let mut order: Vec<usize> = (0..cell.len()).collect();
    order.sort_by_key(rank);
    let counts = [0, 1].map(|most| order.iter().filter(|k| rank(k) <= most).count() as u32);
    let sorted: Vec<LumelPlace> = order.into_iter().map(|k| cell[k]).collect();
    cell.copy_from_slice(&sorted);
    counts
}

/// Which lumels of a cell are the first of a square of so many a side: one of every main direction of
/// surfaces, so that thin charts are not passed over.
fn spread_over(cell: &[LumelPlace], side: u32, page_size: u32) -> Vec<bool> {
    let mut taken = HashSet::new();
    cell.iter()
        .map(|place| {
            let (_, at) = on_page(place.lumel, page_size);
            taken.insert((at / side, main_direction(place.normal)))
        })
        .collect()
}

/// The axis that a direction is nearest to, and its sign.
fn main_direction(direction: Vec3) -> (usize, bool) {
    let axis = direction.abs().max_position();
    (axis, direction[axis] < 0.0)
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::super::draws::is_glance;
    use super::*;

    const PAGE: u32 = 128;

    /// A page that is covered all, one half facing up and one to the side.
    fn cells() -> (Vec<LumelPlace>, Cells) {
        let place = |lumel: u32| LumelPlace {
            lumel,
            position: Vec3::ZERO,
            normal: if lumel % PAGE < 64 { Vec3::Y } else { Vec3::X },
        };
        let mut places: Vec<LumelPlace> = (0..PAGE * PAGE).map(place).collect();
        let cells = Cells::new(&mut places, PAGE);
        (places, cells)
    }

    fn all(places: &[LumelPlace]) -> Vec<u32> {
        places.iter().map(|place| place.lumel).collect()
    }

    fn lumels(places: &[LumelPlace], budgets: &[Budget]) -> HashSet<u32> {
        budgets.iter().map(|budget| places[budget.receiver as usize].lumel).collect()
    }

    /// Share of samples that glances take.
    fn share(budgets: &[Budget]) -> f32 {
        let samples = |b: &Budget| u64::from(b.samples);
        let of_glances = budgets.iter().filter(|b| is_glance(b)).map(samples).sum::<u64>();
        of_glances as f32 / budgets.iter().map(samples).sum::<u64>() as f32
    }

    #[test]
    fn a_coarse_picture_comes_first() {
        let (places, mut cells) = cells();
        let all = all(&places);
        let mut seen = HashSet::new();
        // A sixteenth of the lumels.
        let glances = u64::from(PAGE * PAGE / 16 * cells.glance_samples);
        assert_eq!(cells.glance_samples, GLANCE_SAMPLES.end);
        for _ in 0..8 {
            let budgets = cells.budgets(glances / 8, 1, &all, |_| false);
            assert_eq!(share(&budgets), 1.0);
            seen.extend(lumels(&places, &budgets));
        }
        assert_eq!(seen.len(), (PAGE * PAGE / 16) as usize);
        let squares: HashSet<UVec2> =
            seen.iter().map(|lumel| on_page(*lumel, PAGE).1 / GLANCE).collect();
        assert_eq!(squares.len(), seen.len(), "one of each square");
        // Then all of them, with few samples at first.
        for samples in [2, 2, 4, 8, 8] {
            let turns = u64::from(PAGE * PAGE * samples);
            let turn = |_| lumels(&places, &cells.budgets(turns / 4, 1, &all, |_| false));
            let turned: HashSet<u32> = (0..4).flat_map(turn).collect();
            assert_eq!(turned.len(), PAGE as usize * PAGE as usize);
        }
    }

    /// Half the turns go to all blocks alike, half by how noisy they are.
    #[test]
    fn noisy_blocks_have_more_turns() {
        let (places, mut cells) = cells();
        let all = all(&places);
        for block in 0..4 {
            cells.set_noise(block, if block == 0 { 4.0 } else { 0.0 });
        }
        cells.budgets(u64::from(PAGE * PAGE), 1, &all, |_| false);
        let mut samples = [0_u64; 4];
        for _ in 0..400 {
            for budget in cells.budgets(u64::from(PAGE * PAGE), 1, &all, |_| false) {
                let block = cells.block_of(cells.cell_of(budget.receiver));
                samples[block] += u64::from(budget.samples);
            }
        }
        let all = samples.iter().sum::<u64>() as f32;
        let shares = samples.map(|of| of as f32 / all);
        assert!((shares[0] - (0.5 / 4.0 + 0.5)).abs() < 0.03, "{shares:?}");
        assert!(shares[1..].iter().all(|share| (share - 0.5 / 4.0).abs() < 0.03), "{shares:?}");
    }

    /// Cells whose light changes, and those about them, have glances with each job, up to a quarter of the
    /// samples; others one now and then; an edit takes all samples, until every cell had one.
    #[test]
    fn changes_are_glanced_at() {
        let (places, mut cells) = cells();
        let all = all(&places);
        let samples = u64::from(PAGE * PAGE);
        let cells_of = |cells: &Cells, budgets: &[Budget]| -> BTreeSet<usize> {
            let glances = budgets.iter().filter(|b| is_glance(b));
            glances.map(|b| cells.cell_of(b.receiver)).collect()
        };
        let coarse = cells.budgets(samples, 1, &all, |_| false);
        assert_eq!((share(&coarse), cells_of(&cells, &coarse).len()), (1.0, 64));
        assert_eq!(share(&cells.budgets(samples, 1, &all, |_| false)), 0.0, "nothing is another");
        let calm = share(&cells.budgets(samples, 2, &all, |_| false));
        assert!((0.02..0.08).contains(&calm), "{calm}");
        cells.count_glance(9, true);
        let about: BTreeSet<usize> = cells.about(9).collect();
        assert!((4..=9).contains(&about.len()));
        for version in 3..6 {
            let budgets = cells.budgets(samples, version, &all, |_| false);
            let glanced = cells_of(&cells, &budgets);
            assert!(about.is_subset(&glanced) && glanced.len() < 24, "{glanced:?}");
        }
        (0..64).for_each(|cell| cells.count_glance(cell, true));
        let quarter = share(&cells.budgets(samples, 6, &all, |_| false));
        assert!((0.25..0.4).contains(&quarter), "{quarter}");
        for _ in 0..CHANGING {
            (0..64).for_each(|cell| cells.count_glance(cell, false));
        }
        assert!(share(&cells.budgets(samples, 7, &all, |_| false)) < 0.1, "light is calm again");
        cells.expect_change();
        assert_eq!(share(&cells.budgets(samples / 2, 8, &all, |_| false)), 1.0);
    }

    /// Glances at a lumel are the same in all jobs.
    #[test]
    fn glances_take_the_same_samples() {
        let (places, mut cells) = cells();
        let all = all(&places);
        let mut seen = HashMap::new();
        for version in 1..20 {
            cells.expect_change();
            for budget in cells.budgets(u64::from(PAGE * PAGE), version, &all, |_| false) {
                let known = seen.entry(budget.receiver).or_insert(budget.draws);
                assert_eq!(budget.draws, *known);
            }
        }
        let others: HashSet<String> = seen.values().map(|draws| format!("{draws:?}")).collect();
        assert_eq!(others.len(), seen.len());
    }

    /// Lumels within something have few turns, but as many glances.
    #[test]
    fn buried_lumels_are_gathered_at_now_and_then() {
        let (places, mut cells) = cells();
        let all = all(&places);
        let mut counts = [0; 2];
        for _ in 0..64 {
            for budget in cells.budgets(u64::from(8 * PAGE * PAGE), 1, &all, |r| r % 2 == 0) {
                counts[budget.receiver as usize % 2] += u64::from(!is_glance(&budget));
            }
        }
        let share = counts[0] as f32 / counts[1] as f32;
        assert!((0.1..0.15).contains(&share), "{share}");
        let budgets = cells.budgets(1 << 20, 1, &all, |_| true);
        assert!(!budgets.is_empty(), "all of them");
    }

    #[test]
    fn no_lumels_are_no_trouble() {
        let mut cells = Cells::new(&mut [], PAGE);
        cells.expect_change();
        assert!(cells.budgets(1000, 1, &[], |_| false).is_empty());
    }
}
