//! Results of a gatherer.

use glam::Vec3;

/// Light that arrived at a job's receivers, in columns: one entry for each budget, in their order.
///
/// A *term* is the weight of one sample. A probe has `order.coefficients()` terms, 4π·Y_lm(ω), with
/// directions spread uniformly over the sphere. A lumel has the single term π. Its directions are
/// distributed by the cosine about its normal, its origins uniformly over its footprint. Where other
/// normals count too, terms differ by direction, and flat directions are more frequent.
///
/// Memory: 16 bytes a term and 16 bytes an entry, plus distances and surfaces where they are asked
/// for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    heads: Vec<Head>,
    sum: Vec<Vec3>,
    squares: Vec<f32>,
    distances: Vec<[f32; 2]>,
    surfaces: Vec<Option<SurfacePoint>>,
    /// End of each entry's surfaces in `surfaces`; empty where no job asked for surfaces.
    surfaces_end: Vec<u32>,
}

/// The part of an entry that has a fixed size.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Head {
    /// End of the entry's terms in `sum` and `squares`.
    end: u32,
    count: u32,
    dark_back_fraction: f32,
    culled_fraction: f32,
}

/// Light that arrived at one receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SumsAt<'a> {
    /// Sum over samples of terms times radiance, cd/m². Divided by `count` it is an unbiased
    /// estimate: of the coefficients of arriving radiance (cd/m²), or of irradiance (lux).
    pub sum: &'a [Vec3],
    /// Sum over samples of the squared luminance of terms times radiance.
    pub squares: &'a [f32],
    /// Number of samples taken.
    pub count: u32,
    /// Share of the samples that first met the back of a surface (by winding order), which emits or
    /// from which they found no source of light, 0 to 1. It is near 1 inside solid objects and lamps.
    /// Light of an earlier job is no source.
    pub dark_back_fraction: f32,
    /// Share of the samples that first met the back of a single-sided material, 0 to 1. Such backs
    /// are not meant to be seen.
    pub culled_fraction: f32,
    /// Sums over samples of terms times the distance to the first surface, and times its square
    /// (metres, square metres). Empty unless [`crate::Job::distances`] asks for them.
    pub distances: &'a [[f32; 2]],
    /// The surface that each sample met first, `None` where there is none. Empty unless
    /// [`crate::Job::surfaces`] asks for them.
    pub surfaces: &'a [Option<SurfacePoint>],
}

/// A point on a surface as seen from a receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// World position, metres.
    pub position: Vec3,
    /// World unit normal of the triangle, on the seen side.
    pub normal: Vec3,
    /// Whether the seen side is the front, by winding order; the material does not matter.
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

    /// The entry of a budget, by its index in the job.
    ///
    /// # Panics
    /// If the index is out of range.
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
            dark_back_fraction: head.dark_back_fraction,
            culled_fraction: head.culled_fraction,
            distances: self.distances.get(terms).unwrap_or_default(),
            surfaces: &self.surfaces[before.map_or(0, surface)..surface(entry)],
        }
    }

    /// The entries, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = SumsAt<'_>> {
        (0..self.len()).map(|entry| self.at(entry))
    }

    /// Adds an entry. Either all entries have distances or none has. The same holds for surfaces,
    /// except that an entry without samples may lack them.
    pub fn push(&mut self, entry: SumsAt<'_>) {
        let SumsAt { sum, squares, count, dark_back_fraction, culled_fraction, .. } = entry;
        self.sum.extend_from_slice(sum);
        self.squares.extend_from_slice(squares);
        self.distances.extend_from_slice(entry.distances);
        self.surfaces.extend_from_slice(entry.surfaces);
        if !self.surfaces.is_empty() {
            // Earlier entries without surfaces end at 0.
            self.surfaces_end.resize(self.heads.len(), 0);
            self.surfaces_end.push(self.surfaces.len() as u32);
        }
        let end = self.sum.len() as u32;
        self.heads.push(Head { end, count, dark_back_fraction, culled_fraction });
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
    /// The estimates: coefficients of radiance (cd/m²) or irradiance (lux). NaN where there is no
    /// sample.
    pub fn mean(&self) -> impl Iterator<Item = Vec3> + use<'a> {
        let count = self.count as f32;
        self.sum.iter().map(move |sum| sum / count)
    }
}
