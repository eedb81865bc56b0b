//! Which lumels are gathered at next, where light is live.
//!
//! Lumels lie in *cells* of 16 × 16 of a page, and cells in *blocks*, which are solved together. A
//! *glance* gathers at about every sixteenth lumel of a cell. Whenever the scene is another one, all
//! cells get a glance first: a coarse picture of every page. Then blocks take turns, all lumels of each,
//! so that little has to be solved anew. Blocks whose light has changed come first; noisy ones come more
//! often (stride scheduling, Waldspurger and Weihl 1995).

use std::collections::{BTreeSet, HashSet, VecDeque};
use std::ops::Range;

use glam::{UVec2, Vec3};
use lumencast_gather::Budget;

use super::places::LumelPlace;

/// Lumels a side of a cell.
const CELL: u32 = 16;
/// Cells a side of a block.
const CELLS: u32 = 4;
/// Lumels a side of a block.
pub(crate) const BLOCK: u32 = CELL * CELLS;
/// Lumels a side of a square of which a glance takes one, of each surface and direction.
const GLANCE: u32 = 4;
/// Samples of a lumel in a glance, and in a turn.
const GLANCE_SAMPLES: u32 = 16;
const TURN_SAMPLES: u32 = 8;
/// The same in a turn that was hurried.
const HURRIED_SAMPLES: u32 = 32;
/// Updates of a cell for which a change is expected.
const EXPECTING: u8 = 3;
/// Share of turns that all blocks have alike, however noisy they are.
const EVEN: f32 = 0.5;

/// A square of lumels that are gathered at together.
#[derive(Clone, Debug, PartialEq)]
struct Cell {
    /// Its lumels' receivers. The first ones are those of a glance.
    receivers: Range<u32>,
    glance: u32,
    /// The version of the scene at which it had its last glance.
    seen: Option<u64>,
    /// For so many updates its light may be another, since the scene was edited.
    expecting: u8,
}

/// The turns of a block.
#[derive(Clone, Debug, Default)]
struct Turns {
    cells: Range<usize>,
    /// The block with the least has the next turn.
    due: f64,
    /// The number of its last turn.
    last: u64,
    /// How noisy a sample is there: the standard deviation of its luminance, by the square root of that.
    noise: f32,
}

/// A square of lumels that are solved together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Block {
    pub(crate) page: u32,
    row: u32,
    column: u32,
}

impl Block {
    /// The block of a lumel.
    pub(crate) fn of(lumel: u32, page_size: u32) -> Self {
        let (page, at) = on_page(lumel, page_size);
        Self { page, row: at.y / BLOCK, column: at.x / BLOCK }
    }

    /// Those about it on its page.
    pub(crate) fn beside(&self, page_size: u32) -> impl Iterator<Item = Self> {
        let Self { page, row, column } = *self;
        let blocks = page_size.div_ceil(BLOCK);
        let near = move |at: u32| at.saturating_sub(1)..(at + 2).min(blocks);
        let all = near(row).flat_map(move |row| near(column).map(move |column| (row, column)));
        all.filter(move |at| *at != (row, column)).map(move |(row, column)| Self {
            page,
            row,
            column,
        })
    }

    /// Its first lumel.
    pub(crate) fn corner(&self) -> UVec2 {
        BLOCK * UVec2::new(self.column, self.row)
    }
}

/// The cells of all pages, and whose turn it is.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cells {
    /// Block by block.
    cells: Vec<Cell>,
    next_glance: usize,
    blocks: Vec<Turns>,
    /// Cells that have not been gathered at in the turn that is under way.
    turn: Range<usize>,
    /// Number of turns until now.
    turns: u64,
    /// Cells whose turn comes before all others.
    hurried: VecDeque<usize>,
    /// Glances that come before all turns.
    first: usize,
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
                let glance = glanced(cell, page_size);
                let receivers = first..first + cell.len() as u32;
                first = receivers.end;
                cells.push(Cell { receivers, glance, seen: None, expecting: 0 });
            }
            blocks.push(Turns { cells: start..cells.len(), ..Turns::default() });
        }
        Self { first: cells.len(), cells, blocks, ..Self::default() }
    }

    /// Light may be another: all cells get a glance before any has its turn. Those that wait for
    /// one already are not put off.
    pub(crate) fn expect_change(&mut self) {
        self.first = self.cells.len();
        self.cells.iter_mut().for_each(|cell| cell.expecting = EXPECTING);
    }

    /// Counts an update of a cell; whether its light may be another since the scene was edited.
    pub(crate) fn count_update(&mut self, cell: usize) -> bool {
        let expecting = &mut self.cells[cell].expecting;
        let is_expected = *expecting > 0;
        *expecting = expecting.saturating_sub(1);
        is_expected
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

    /// The receivers of a block.
    pub(crate) fn receivers_of_block(&self, block: usize) -> Range<usize> {
        let Range { start, end } = self.blocks[block].cells;
        self.receivers_of(start).start..self.receivers_of(end - 1).end
    }

    /// The next cell in turn.
    fn next_turn(&mut self) -> Option<usize> {
        if self.turn.is_empty() {
            let all: f32 = self.blocks.iter().map(|block| block.noise).sum();
            let mean = all / self.blocks.len() as f32;
            let next = self
                .blocks
                .iter_mut()
                .min_by(|a, b| a.due.total_cmp(&b.due).then_with(|| a.last.cmp(&b.last)))?;
            self.turns += 1;
            self.turn = next.cells.clone();
            next.last = self.turns;
            let share = if mean > 0.0 { next.noise / mean } else { 1.0 };
            next.due += 1.0 / f64::from(EVEN + (1.0 - EVEN) * share);
        }
        self.turn.next()
    }

    /// Lets the cells of these receivers have their turn next.
    pub(crate) fn hurry(&mut self, receivers: impl Iterator<Item = u32>) {
        let cells: BTreeSet<usize> = receivers.map(|receiver| self.cell_of(receiver)).collect();
        self.hurried.extend(cells);
    }

    /// What to gather next, about so many samples in all.
    pub(crate) fn budgets(&mut self, samples: u64, version: u64) -> Vec<Budget> {
        let mut budgets = Vec::new();
        let (mut glances, mut turns) = (0, 0);
        while turns < samples
            && let Some(cell) = self.hurried.pop_front()
        {
            let each = HURRIED_SAMPLES;
            let receivers = self.cells[cell].receivers.clone();
            turns += receivers.len() as u64 * u64::from(each);
            budgets.extend(receivers.map(|receiver| Budget { receiver, samples: each }));
        }
        while glances + turns < samples && !self.cells.is_empty() {
            let is_first = self.first > 0;
            self.first = self.first.saturating_sub(1);
            let glance =
                (is_first || glances <= turns).then(|| self.next_glance(version)).flatten();
            let (cell, count, each) = match glance {
                Some(cell) => (cell, self.cells[cell].glance, GLANCE_SAMPLES),
                None if is_first => {
                    self.first = 0;
                    continue;
                }
                None => {
                    let Some(cell) = self.next_turn() else { break };
                    (cell, self.cells[cell].receivers.len() as u32, TURN_SAMPLES)
                }
            };
            let Range { start, .. } = self.cells[cell].receivers;
            let receivers = start..start + count;
            budgets.extend(receivers.map(|receiver| Budget { receiver, samples: each }));
            let spent = u64::from(count * each);
            if glance.is_some() {
                glances += spent
            } else {
                turns += spent
            }
            // However many samples there are, a job asks for no more than all lumels.
            if budgets.len() >= self.receivers() {
                break;
            }
        }
        budgets
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

    /// The cell of a receiver.
    pub(crate) fn cell_of(&self, receiver: u32) -> usize {
        self.cells.partition_point(|cell| cell.receivers.end <= receiver)
    }

    /// The receivers of a cell.
    pub(crate) fn receivers_of(&self, cell: usize) -> Range<usize> {
        let Range { start, end } = self.cells[cell].receivers;
        start as usize..end as usize
    }

    fn receivers(&self) -> usize {
        self.cells.last().map_or(0, |cell| cell.receivers.end as usize)
    }
}

/// The page of a lumel, and its place there.
fn on_page(lumel: u32, page_size: u32) -> (u32, UVec2) {
    let (page, at) = (lumel / (page_size * page_size), lumel % (page_size * page_size));
    (page, UVec2::new(at % page_size, at / page_size))
}

/// Puts those lumels of a cell first that a glance takes, and counts them: of each square one of every
/// main direction of surfaces, so that thin charts are not passed over.
fn glanced(cell: &mut [LumelPlace], page_size: u32) -> u32 {
    let mut taken = HashSet::new();
    let is_glanced: Vec<bool> = cell
        .iter()
        .map(|place| {
            let (_, at) = on_page(place.lumel, page_size);
            taken.insert((at / GLANCE, main_direction(place.normal)))
        })
        .collect();
    let mut order: Vec<usize> = (0..cell.len()).collect();
    order.sort_by_key(|k| !is_glanced[*k]);
    let sorted: Vec<LumelPlace> = order.into_iter().map(|k| cell[k]).collect();
    cell.copy_from_slice(&sorted);
    taken.len() as u32
}

/// The axis that a direction is nearest to, and its sign.
fn main_direction(direction: Vec3) -> (usize, bool) {
    let axis = direction.abs().max_position();
    (axis, direction[axis] < 0.0)
}

#[cfg(test)]
mod tests {
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

    fn lumels(places: &[LumelPlace], budgets: &[Budget]) -> HashSet<u32> {
        budgets.iter().map(|budget| places[budget.receiver as usize].lumel).collect()
    }

    #[test]
    fn a_coarse_picture_comes_first() {
        let (places, mut cells) = cells();
        let mut seen = HashSet::new();
        // A sixteenth of the lumels.
        let glances = u64::from(PAGE * PAGE / 16 * GLANCE_SAMPLES);
        for _ in 0..8 {
            let budgets = cells.budgets(glances / 8, 1);
            assert!(budgets.iter().all(|budget| budget.samples == GLANCE_SAMPLES));
            seen.extend(lumels(&places, &budgets));
        }
        assert_eq!(seen.len(), (PAGE * PAGE / 16) as usize);
        let squares: HashSet<UVec2> =
            seen.iter().map(|lumel| on_page(*lumel, PAGE).1 / GLANCE).collect();
        assert_eq!(squares.len(), seen.len(), "one of each square");
        // Then all of them, in turns.
        let turns = u64::from(PAGE * PAGE * TURN_SAMPLES);
        let all: HashSet<u32> =
            (0..4).flat_map(|_| lumels(&places, &cells.budgets(turns / 4, 1))).collect();
        assert_eq!(all.len(), (PAGE * PAGE) as usize);
    }

    /// A scene that changes all the time takes half the samples for glances; an edit all, until every
    /// cell had one.
    #[test]
    fn changes_are_glanced_at() {
        let (_, mut cells) = cells();
        let all = u64::from(PAGE * PAGE);
        let share = |budgets: &[Budget]| {
            let of = |samples: u32| -> u64 {
                budgets
                    .iter()
                    .map(|b| u64::from(b.samples))
                    .filter(|s| *s == u64::from(samples))
                    .sum()
            };
            of(GLANCE_SAMPLES) as f32 / (of(GLANCE_SAMPLES) + of(TURN_SAMPLES)) as f32
        };
        assert_eq!(share(&cells.budgets(all, 1)), 1.0);
        for version in 2..20 {
            let half = share(&cells.budgets(all / 4, version));
            assert!((0.4..0.7).contains(&half), "{half}");
        }
        cells.budgets(4 * all, 19);
        assert_eq!(share(&cells.budgets(all, 19)), 0.0, "nothing has changed");
        cells.expect_change();
        assert_eq!(share(&cells.budgets(all / 2, 20)), 1.0);
    }

    #[test]
    fn no_lumels_are_no_trouble() {
        let mut cells = Cells::new(&mut [], PAGE);
        cells.expect_change();
        assert!(cells.budgets(1000, 1).is_empty());
    }
}
