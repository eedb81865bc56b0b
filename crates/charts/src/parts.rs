//! Parts of a surface that hang together.

use std::collections::HashMap;
use std::hash::Hash;

use lumencast_light::{ChartVertex, Charts};

/// Number of charts that have lumels: triangles that share a corner lie in one, and no two charts touch.
pub fn chart_count(charts: &Charts) -> usize {
    let corners = (0..charts.triangles.len() as u32).filter_map(|number| charts.corners(number));
    let place = |corners: [ChartVertex; 3]| {
        corners.map(|corner| (corner.rectangle, corner.at.to_array().map(f32::to_bits)))
    };
    parts(corners.map(place)) as usize
}

/// Number of parts that touch each other nowhere, where triangles share no place. Triangles are told by
/// the places of their corners.
pub(crate) fn parts<P: Eq + Hash>(triangles: impl Iterator<Item = [P; 3]>) -> u32 {
    let mut number_of = HashMap::new();
    let mut sets = UnionFind::default();
    let mut count = 0;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|place| {
            *number_of.entry(place).or_insert_with(|| {
                count += 1;
                sets.add()
            })
        });
        count -= u32::from(sets.unite(a, b)) + u32::from(sets.unite(b, c));
    }
    count
}

/// Sets of numbers, by trees whose roots name them.
#[derive(Clone, Debug, Default)]
pub struct UnionFind(Vec<u32>);

impl UnionFind {
    /// The number of a new set, of which it is all.
    pub fn add(&mut self) -> u32 {
        let number = self.0.len() as u32;
        self.0.push(number);
        number
    }

    /// The number that names the set of a number.
    pub fn root(&mut self, mut of: u32) -> u32 {
        while self.0[of as usize] != of {
            let above = self.0[of as usize];
            self.0[of as usize] = self.0[above as usize];
            of = above;
        }
        of
    }

    /// Makes one set of two; whether they were two.
    pub fn unite(&mut self, a: u32, b: u32) -> bool {
        let [a, b] = [self.root(a), self.root(b)];
        self.0[a.max(b) as usize] = a.min(b);
        a != b
    }
}
