//! The random numbers that lumels draw.
//!
//! Lumels beside each other draw parts beside each other of one sequence, along a Morton curve (Ahmed and
//! Wonka 2020). Together they are sampled well. The filter takes means over them, so less noise is left.

use glam::UVec2;
use lumencast_gather::{Budget, Draws};

use super::blocks::{BLOCK, on_page};

/// Where one of so many lumels a side of a square draws so many samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(crate) spacing: u32,
    pub(crate) samples: u32,
}

impl Part {
    /// Index of the first sample that a place of a page, or of a block, draws.
    fn first(self, at: UVec2) -> u32 {
        morton(at / self.spacing).wrapping_mul(self.samples)
    }

    /// A lumel's numbers where all lumels of all pages are gathered at.
    pub(crate) fn of_page(self, lumel: u32, page_size: u32) -> Draws {
        let (sequence, at) = on_page(lumel, page_size);
        Draws::Shared { sequence, first: self.first(at) }
    }

    /// The same in a turn of a block.
    pub(crate) fn of_turn(self, turn: u64, lumel: u32, page_size: u32) -> Draws {
        let (_, at) = on_page(lumel, page_size);
        Draws::Shared { sequence: turn as u32, first: self.first(at % BLOCK) }
    }

    /// The same in a glance: always those.
    pub(crate) fn of_glance(self, lumel: u32, page_size: u32) -> Draws {
        let (sequence, at) = on_page(lumel, page_size);
        Draws::Same { sequence, first: self.first(at) }
    }
}

/// Whether a lumel is glanced at.
pub(crate) fn is_glance(budget: &Budget) -> bool {
    matches!(budget.draws, Draws::Same { .. })
}

/// The place along a Morton curve: the bits of x and y in turns.
fn morton(at: UVec2) -> u32 {
    let spread = |x: u32| {
        let x = (x | x << 8) & 0x00ff_00ff;
        let x = (x | x << 4) & 0x0f0f_0f0f;
        let x = (x | x << 2) & 0x3333_3333;
        (x | x << 1) & 0x5555_5555
    };
    spread(at.x & 0xffff) | spread(at.y & 0xffff) << 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_lie_together_on_the_curve() {
        let places = |side: u32| (0..side * side).map(move |k| UVec2::new(k % side, k / side));
        for side in [2, 16, 1024] {
            let mut along: Vec<u32> = places(side).map(morton).collect();
            along.sort_unstable();
            assert!(along.into_iter().eq(0..side * side));
        }
        assert_eq!(morton(UVec2::new(3, 5)), 0b100111);
    }

    /// Lumels that draw at all draw parts that do not overlap, one after the other.
    #[test]
    fn parts_follow_each_other() {
        for spacing in [1, 2, 4] {
            let part = Part { spacing, samples: 8 };
            let drawing = (0..64u32 * 64)
                .filter(|k| [k % 64, k / 64].iter().all(|at| at.is_multiple_of(spacing)));
            let first = |lumel| match part.of_turn(7, lumel, 64) {
                Draws::Shared { sequence: 7, first } => first,
                other => panic!("{other:?}"),
            };
            let mut all: Vec<u32> = drawing.map(first).collect();
            all.sort_unstable();
            assert!(all.into_iter().eq((0..64 * 64 / spacing.pow(2)).map(|k| 8 * k)));
        }
    }
}
