//! Blocks that wait.

use std::collections::BTreeSet;
use std::ops::Bound::{Excluded, Unbounded};

use super::blocks::Block;

/// Blocks that wait to be solved. They are taken round about, so that none waits for ever.
#[derive(Clone, Debug, Default)]
pub(crate) struct Queue {
    blocks: BTreeSet<Block>,
    last: Option<Block>,
}

impl Queue {
    pub(crate) fn insert(&mut self, block: Block) {
        self.blocks.insert(block);
    }

    pub(crate) fn remove(&mut self, block: &Block) {
        self.blocks.remove(block);
    }

    pub(crate) fn len(&self) -> usize {
        self.blocks.len()
    }

    /// All that wait.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Block> {
        self.blocks.iter()
    }

    /// Takes all of them.
    pub(crate) fn take_all(&mut self) -> BTreeSet<Block> {
        std::mem::take(&mut self.blocks)
    }

    /// Takes some.
    pub(crate) fn take(&mut self, most: usize) -> BTreeSet<Block> {
        let after = (self.last.map_or(Unbounded, Excluded), Unbounded);
        let next = self.blocks.range(after).chain(&self.blocks).take(most.min(self.blocks.len()));
        let next: Vec<Block> = next.copied().collect();
        self.last = next.last().copied().or(self.last);
        let next = BTreeSet::from_iter(next);
        self.blocks.retain(|block| !next.contains(block));
        next
    }
}

impl Extend<Block> for Queue {
    fn extend<T: IntoIterator<Item = Block>>(&mut self, blocks: T) {
        self.blocks.extend(blocks);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Those that come anew wait for the others.
    #[test]
    fn none_waits_for_ever() {
        let block = |k: u32| Block::of(64 * k, 1024);
        let mut queue = Queue::default();
        queue.extend((0..5).map(block));
        assert_eq!(queue.take(2), BTreeSet::from([block(0), block(1)]));
        queue.extend([block(0), block(1)]);
        assert_eq!(queue.take(2), BTreeSet::from([block(2), block(3)]));
        assert_eq!(queue.take(2), BTreeSet::from([block(4), block(0)]));
        assert_eq!(queue.take(2), BTreeSet::from([block(1)]));
        assert!(queue.take(2).is_empty());
        queue.extend([block(3), block(1)]);
        queue.remove(&block(3));
        assert_eq!(queue.all().count(), 1);
        assert_eq!(queue.take_all().len(), 1);
    }
}
