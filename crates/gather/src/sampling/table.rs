//! Cumulative tables of one and two dimensions, to choose by weight.

use glam::Vec2;

use super::ONE_MINUS_EPSILON;

/// A table that chooses an index with probability in proportion to its weight.
#[derive(Clone, Debug, Default)]
pub(crate) struct Table {
    /// Probability that the index is at most i; the last is 1. Empty when all weights are 0.
    cumulative: Vec<f32>,
    total: f64,
}

impl Table {
    /// Builds the table; weights that are not finite and positive count as 0.
    pub(crate) fn new(weights: impl IntoIterator<Item = f32>) -> Self {
        let mut total = 0.0;
        let sums: Vec<f64> = weights
            .into_iter()
            .map(|w| {
                total += if w.is_finite() { f64::from(w.max(0.0)) } else { 0.0 };
                total
            })
            .collect();
        if total <= 0.0 {
            return Self::default();
        }
        Self { cumulative: sums.iter().map(|s| (s / total) as f32).collect(), total }
    }

    /// Whether all weights are 0.
    pub(crate) fn is_empty(&self) -> bool {
        self.cumulative.is_empty()
    }

    /// Sum of the weights.
    pub(crate) fn total(&self) -> f64 {
        self.total
    }

    /// Returns the index whose share of [0, 1) holds `u`, its probability, and the position of `u`
    /// in that share, 0 to 1. The table must not be empty.
    #[inline]
    pub(crate) fn choose(&self, u: f32) -> (usize, f32, f32) {
        let index = self.cumulative.partition_point(|&c| c <= u).min(self.cumulative.len() - 1);
        let below = if index > 0 { self.cumulative[index - 1] } else { 0.0 };
        let p = self.cumulative[index] - below;
        (index, p, ((u - below) / p).clamp(0.0, ONE_MINUS_EPSILON))
    }

    /// Probability of an index; 0 when the table is empty.
    #[inline]
    pub(crate) fn probability(&self, index: usize) -> f32 {
        match self.cumulative.get(index) {
            Some(&c) if index > 0 => c - self.cumulative[index - 1],
            Some(&c) => c,
            None => 0.0,
        }
    }
}

/// A density over the unit square, constant in each cell of a grid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Grid2 {
    rows: Table,
    columns: Vec<Table>,
    width: usize,
    /// Densities row by row. They are stored apart from the tables, since they are read far more
    /// often than points are sampled.
    densities: Vec<f32>,
}

impl Grid2 {
    /// Builds the grid from `width * height` weights, row by row.
    pub(crate) fn new(weights: &[f32], width: usize) -> Self {
        let columns: Vec<_> =
            weights.chunks_exact(width).map(|row| Table::new(row.iter().copied())).collect();
        let rows = Table::new(columns.iter().map(|c| c.total() as f32));
        let cells = (width * columns.len()) as f32;
        let density = |row: usize, column: usize| {
            rows.probability(row) * columns[row].probability(column) * cells
        };
        let densities = (0..columns.len())
            .flat_map(|row| (0..width).map(move |column| (row, column)))
            .map(|(row, column)| density(row, column))
            .collect();
        Self { rows, columns, width, densities }
    }

    /// Whether all weights are 0.
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// A point and its density. The grid must not be empty.
    pub(crate) fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (row, p_row, v) = self.rows.choose(u.y);
        let (column, p_column, w) = self.columns[row].choose(u.x);
        let size = Vec2::new(self.width as f32, self.columns.len() as f32);
        let at = (Vec2::new(column as f32, row as f32) + Vec2::new(w, v)) / size;
        (at, p_row * p_column * size.x * size.y)
    }

    /// The density at a point.
    #[inline]
    pub(crate) fn density(&self, at: Vec2) -> f32 {
        let height = self.columns.len();
        if height == 0 {
            return 0.0;
        }
        let row = ((at.y * height as f32) as usize).min(height - 1);
        let column = ((at.x * self.width as f32) as usize).min(self.width - 1);
        self.densities[row * self.width + column]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chooses_in_proportion() {
        let t = Table::new([1.0, 0.0, 3.0, f32::NAN, 4.0]);
        let n = 8000;
        let mut seen = [0; 5];
        for i in 0..n {
            let (index, p, rest) = t.choose((i as f32 + 0.5) / n as f32);
            assert_eq!(p, t.probability(index));
            assert!((0.0..1.0).contains(&rest));
            seen[index] += 1;
        }
        assert_eq!(seen, [1000, 0, 3000, 0, 4000]);
        assert!(Table::new([0.0, -1.0]).is_empty());
    }

    #[test]
    fn grid_samples_have_the_density_it_states() {
        let g = Grid2::new(&[1.0, 2.0, 3.0, 0.0, 0.0, 10.0], 3);
        let mut cells = [0.0; 6];
        let n = 400;
        for i in 0..n * n {
            let (p, density) =
                g.sample((Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) / n as f32);
            assert!((density - g.density(p)).abs() < 1e-4 * density);
            cells[(p.y * 2.0) as usize * 3 + (p.x * 3.0) as usize] += 16.0 / (n * n) as f32;
        }
        for (seen, weight) in cells.iter().zip([1.0, 2.0, 3.0, 0.0, 0.0, 10.0]) {
            assert!((seen - weight).abs() < 0.1, "{cells:?}");
        }
    }
}
