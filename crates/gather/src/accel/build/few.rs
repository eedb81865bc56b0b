//! Optimal splits of a few items: all ways are tried.

use super::super::Aabb;
use super::{Item, leaf_cost};

/// Greatest number of items that are split this way; up to here it is faster than planes are.
pub(super) const FEW: usize = 4;

/// The items on the left, as a set of bits, and the cost of both sides. The cost is the number of
/// full leaves times half the area of their box.
pub(super) struct Parting {
    left: usize,
    pub(super) cost: f32,
}

impl Parting {
    /// The cheapest split of 2 to [`FEW`] items.
    pub(super) fn cheapest(items: &[Item], leaf: f32) -> Self {
        match items {
            [a, b] => Self::of::<2, 4>([a, b], leaf),
            [a, b, c] => Self::of::<3, 8>([a, b, c], leaf),
            [a, b, c, d] => Self::of::<4, 16>([a, b, c, d], leaf),
            _ => unreachable!("few items"),
        }
    }

    /// The cheapest split; `SETS` must be 2 to the power of `N`.
    fn of<const N: usize, const SETS: usize>(items: [&Item; N], leaf: f32) -> Self {
        let mut bounds = [Aabb::EMPTY; SETS];
        let mut costs = [0.0; SETS];
        let mut counts = [0.0; SETS];
        for set in 1..SETS - 1 {
            let (item, rest) = (items[set.trailing_zeros() as usize], set & (set - 1));
            bounds[set] = bounds[rest].union(item.bounds());
            counts[set] = counts[rest] + item.count() as f32;
            costs[set] = bounds[set].half_area() * leaf_cost(counts[set], leaf);
        }
        // The last item stays on the right, so that each split is tried once.
        let cost = |left: usize| costs[left] + costs[SETS - 1 - left];
        (2..SETS / 2).fold(Self { left: 1, cost: cost(1) }, |best, left| {
            if cost(left) < best.cost { Self { left, cost: cost(left) } } else { best }
        })
    }

    /// Moves the left side to the front; returns its number of items.
    pub(super) fn bring_left(&self, items: &mut [Item]) -> usize {
        let mut middle = 0;
        for n in 0..items.len() {
            if self.left >> n & 1 == 1 {
                items.swap(n, middle);
                middle += 1;
            }
        }
        middle
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::items;
    use super::*;

    /// No split is cheaper: the test tries every one, box by box.
    #[test]
    fn no_way_to_part_is_cheaper() {
        let all = items(600);
        for items in (2..=FEW).flat_map(|n| all.chunks_exact(n)) {
            let side = |left: usize, is_left: bool| -> Vec<Item> {
                let on = |n: usize| (left >> n & 1 == 1) == is_left;
                (0..items.len()).filter(|&n| on(n)).map(|n| items[n]).collect()
            };
            let cost = |side: &[Item]| {
                let bounds = side.iter().fold(Aabb::EMPTY, |all, item| all.union(item.bounds()));
                let count: u32 = side.iter().map(Item::count).sum();
                bounds.half_area() * leaf_cost(count as f32, 4.0)
            };
            let both = |left| cost(&side(left, true)) + cost(&side(left, false));
            let best = Parting::cheapest(items, 4.0);
            assert_eq!((1..(1 << items.len()) - 1).map(both).reduce(f32::min), Some(best.cost));

            let mut parted = items.to_vec();
            let middle = best.bring_left(&mut parted);
            let mut found: Vec<_> = parted.iter().map(Item::indices).collect();
            found.sort_by_key(|indices| indices.start);
            assert!(found.into_iter().eq(items.iter().map(Item::indices)));
            assert_eq!(cost(&parted[..middle]) + cost(&parted[middle..]), best.cost);
        }
    }
}
