use glam::{BVec3, Vec3};

/// An axis-aligned box, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// The corner with the least coordinates.
    pub min: Vec3,
    /// The corner with the greatest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The empty box.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Whether the box is empty.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Its eight corners; of an empty box, points that are not finite.
    pub fn corners(&self) -> impl Iterator<Item = Vec3> + '_ {
        (0..8).map(|i| {
            let far = BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0);
            Vec3::select(far, self.max, self.min)
        })
    }

    /// The box around the transformed corners of this one.
    pub fn transformed(&self, transform: impl Fn(Vec3) -> Vec3) -> Self {
        let mut result = Self::EMPTY;
        self.corners().for_each(|corner| result.grow(transform(corner)));
        result
    }

    /// Grows the box to hold a point; points that are not finite are ignored.
    pub fn grow(&mut self, point: Vec3) {
        if point.is_finite() {
            self.min = self.min.min(point);
            self.max = self.max.max(point);
        }
    }
}
