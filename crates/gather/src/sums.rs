//! What a gatherer found.

use glam::Vec3;

/// What arrived at a job's receivers, in columns: an entry for each of its budgets, in their order.
///
/// A *term* is what one sample adds: for a probe 4π·Y_lm(ω), one of each of `order.coefficients()`,
/// directions being spread evenly over the sphere; for a lumel the single π, directions being spread
/// by the cosine about its normal and origins over its footprint.
///
/// Costs, in memory: 16 bytes a term, and 16 an entry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    heads: Vec<Head>,
    sum: Vec<Vec3>,
    squares: Vec<f32>,
    distances: Vec<[f32; 2]>,
    surfaces: Vec<Option<SurfacePoint>>,
    /// Where each entry's surfaces end; empty where nobody asked for them.
    surfaces_end: Vec<u32>,
}

/// What there is one of an entry.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Head {
    /// Where its terms end.
    end: u32,
    count: u32,
    back_face_fraction: f32,
    culled_fraction: f32,
}

/// What arrived at one receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SumsAt<'a> {
    /// Sum over samples of terms times radiance, cd/m²: divided by `count`, the unbiased estimate
    /// of the coefficients of arriving radiance, or of irradiance in lux.
    pub sum: &'a [Vec3],
    /// Sum over samples of the squares of the luminance of the same.
    pub squares: &'a [f32],
    /// Samples taken.
    pub count: u32,
    /// Share of the samples that met the back of a surface first, by its winding: near 1 for probes
    /// inside of solid things.
    pub back_face_fraction: f32,
    /// Share of the samples that met a back first that nobody is meant to see, its material being
    /// single-sided.
    pub culled_fraction: f32,
    /// Sums over samples of terms times the distance to the first surface, and times its square
    /// (metres, square metres); empty unless [`crate::Job::distances`] asks for them.
    pub distances: &'a [[f32; 2]],
    /// The surface that each sample met first, if any; empty unless [`crate::Job::surfaces`] asks for
    /// them.
    pub surfaces: &'a [Option<SurfacePoint>],
}

/// A point of a surface, as it is seen from somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// World, metres.
    pub position: Vec3,
    /// World unit normal of the triangle, on the side that is seen.
    pub normal: Vec3,
    /// Whether that side is the triangle's front, by its winding, whatever its material shows.
    pub front: bool,
}

impl Sums {
    /// Number of entries.
    pub fn len(&self) -> usize {
        self.heads.len()
    }

    /// Whether there are no entries.
    pub fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }

    /// The entry of a budget.
    ///
    /// # Panics
    /// If there are not so many.
    pub fn at(&self, entry: usize) -> SumsAt<'_> {
        let head = self.heads[entry];
        let before = entry.checked_sub(1);
        let first = before.map_or(0, |before| self.heads[before].end) as usize;
        let terms = first..head.end as usize;
        let surface = |entry: usize| self.surfaces_end.get(entry).copied().unwrap_or(0) as usize;
        SumsAt {
            sum: &self.sum[terms.clone()],
            squares: &self.squares[terms.clone()],
            count: head.count,
            back_face_fraction: head.back_face_fraction,
            culled_fraction: head.culled_fraction,
            distances: self.distances.get(terms).unwrap_or_default(),
            surfaces: &self.surfaces[before.map_or(0, surface)..surface(entry)],
        }
    }

    /// The entries, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = SumsAt<'_>> {
        (0..self.len()).map(|entry| self.at(entry))
    }

    /// Adds an entry. Either all entries have distances, or none has; so with surfaces, unless an entry
    /// has no samples.
    pub fn push(&mut self, entry: SumsAt<'_>) {
        let SumsAt { sum, squares, count, back_face_fraction, culled_fraction, .. } = entry;
        self.sum.extend_from_slice(sum);
        self.squares.extend_from_slice(squares);
        self.distances.extend_from_slice(entry.distances);
        self.surfaces.extend_from_slice(entry.surfaces);
        if !self.surfaces.is_empty() {
            // Entries before the first with surfaces have none.
            self.surfaces_end.resize(self.heads.len(), 0);
            self.surfaces_end.push(self.surfaces.len() as u32);
        }
        let end = self.sum.len() as u32;
        self.heads.push(Head { end, count, back_face_fraction, culled_fraction });
    }
}

impl<'a> FromIterator<SumsAt<'a>> for Sums {
    fn from_iter<T: IntoIterator<Item = SumsAt<'a>>>(entries: T) -> Self {
        let mut sums = Self::default();
        entries.into_iter().for_each(|entry| sums.push(entry));
        sums
    }
}

impl<'a> SumsAt<'a> {
    /// The estimates: coefficients of radiance, or irradiance; not numbers where there is no sample.
    pub fn mean(&self) -> impl Iterator<Item = Vec3> + use<'a> {
        let count = self.count as f32;
        self.sum.iter().map(move |sum| sum / count)
    }
}
