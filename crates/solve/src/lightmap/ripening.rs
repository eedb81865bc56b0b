//! When what is known of blocks is worth solving.
//!
//! Solving a block takes time, and bits for those who watch. So it is solved when its light has visibly
//! changed, or when samples have come that are a good share of what is known. Blocks that are nearly ripe
//! are solved with those that are, so that light rests in between.

use std::collections::BTreeMap;

use super::blocks::Block;

/// New samples' share of what is known from which on a block is ripe.
const RIPE: f32 = 0.4;
/// The same for blocks that are solved with one that is ripe.
const NEARLY_RIPE: f32 = 0.2;
/// A change by this share of the light is visible.
const VISIBLE: f32 = 0.01;

/// What has come since a block was solved.
#[derive(Clone, Copy, Debug, Default)]
struct News {
    /// Share of new samples in what is known.
    samples: f32,
    /// Sum of changes of its light, as shares of it.
    change: f32,
}

/// What has come since blocks were solved, of those that were solved once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ripening(BTreeMap<Block, News>);

impl Ripening {
    /// Samples have come that are this share of what is known of a block, or its light has changed by a
    /// share of it. Whether it is to be solved at once: it never was, or has visibly changed.
    pub(crate) fn add(&mut self, block: Block, samples: f32, change: f32) -> bool {
        let Some(news) = self.0.get_mut(&block) else { return true };
        news.samples += samples;
        news.change += change;
        news.change >= VISIBLE
    }

    /// A block is solved.
    pub(crate) fn solved(&mut self, block: Block) {
        self.0.insert(block, News::default());
    }

    /// Whether a block was solved since its light was forgotten.
    pub(crate) fn is_solved(&self, block: &Block) -> bool {
        self.0.contains_key(block)
    }

    /// What was known of a block's light counts no more.
    pub(crate) fn forget(&mut self, block: &Block) {
        self.0.remove(block);
    }

    /// Blocks to be solved.
    pub(crate) fn ripe(&self) -> impl Iterator<Item = Block> + '_ {
        let is_any_ripe = self.0.values().any(|news| news.samples >= RIPE);
        let nearly = self.0.iter().filter(|(_, news)| news.samples >= NEARLY_RIPE);
        nearly.filter(move |_| is_any_ripe).map(|(block, _)| *block)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(k: u32) -> Block {
        Block::of(64 * k, 1024)
    }

    #[test]
    fn first_light_and_visible_changes_are_solved_at_once() {
        let mut blocks = Ripening::default();
        assert!(blocks.add(block(0), 0.01, 0.0), "first light");
        blocks.solved(block(0));
        assert!(!blocks.add(block(0), 0.1, 0.006));
        assert!(blocks.add(block(0), 0.0, 0.006), "changes add up");
        blocks.solved(block(0));
        assert!(!blocks.add(block(0), 0.0, 0.006));
        blocks.forget(&block(0));
        assert!(blocks.add(block(0), 0.0, 0.0), "light of another place");
    }

    /// Light rests while samples come, and blocks are solved together.
    #[test]
    fn blocks_ripen_together() {
        let mut blocks = Ripening::default();
        (0..3).for_each(|k| blocks.solved(block(k)));
        for _ in 0..3 {
            assert_eq!(blocks.ripe().count(), 0);
            blocks.add(block(0), 0.14, 0.0);
            blocks.add(block(1), 0.07, 0.0);
            blocks.add(block(2), 0.02, 0.0);
        }
        assert_eq!(blocks.ripe().collect::<Vec<_>>(), [block(0), block(1)]);
        blocks.solved(block(0));
        assert_eq!(blocks.ripe().count(), 0);
    }
}
