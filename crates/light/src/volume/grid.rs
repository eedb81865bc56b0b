//! The box that a volume's probes stand in.

use glam::{Quat, UVec3, Vec3};
use serde::{Deserialize, Serialize};

/// An oriented box divided into cells, one probe at the centre of each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Centre of the box, metres.
    pub center: Vec3,
    /// Axes of the box in the world; SH coefficients stay in world axes.
    #[serde(default)]
    pub rotation: Quat,
    /// Full extent along the box's axes, metres, each > 0.
    pub size: Vec3,
    /// Cells along each axis, each ≥ 1.
    pub resolution: UVec3,
}

impl Grid {
    /// Number of probes.
    pub fn probe_count(&self) -> usize {
        self.resolution.as_usizevec3().element_product()
    }

    /// Index of the probe of a cell: x fastest, then y, then z.
    pub fn index(&self, cell: UVec3) -> usize {
        let r = self.resolution.as_usizevec3();
        let c = cell.as_usizevec3();
        (c.z * r.y + c.y) * r.x + c.x
    }

    /// The cell of a probe index; the inverse of [`Grid::index`].
    pub fn cell(&self, index: usize) -> UVec3 {
        let r = self.resolution.as_usizevec3();
        UVec3::new((index % r.x) as u32, (index / r.x % r.y) as u32, (index / (r.x * r.y)) as u32)
    }

    /// World position of the probe of a cell.
    pub fn position(&self, cell: UVec3) -> Vec3 {
        self.world_from_cell(cell.as_vec3())
    }

    /// World positions of all probes, in index order.
    pub fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        (0..self.probe_count()).map(|i| self.position(self.cell(i)))
    }

    /// Size of a cell along the box's axes, metres.
    pub fn spacing(&self) -> Vec3 {
        self.size / self.resolution.as_vec3()
    }

    /// A world position in cells: the first probe lies at 0, the next along x at (1, 0, 0).
    pub fn cell_from_world(&self, position: Vec3) -> Vec3 {
        let local = self.rotation.inverse() * (position - self.center);
        (local / self.size + 0.5) * self.resolution.as_vec3() - 0.5
    }

    /// The inverse of [`Self::cell_from_world`].
    pub fn world_from_cell(&self, cell: Vec3) -> Vec3 {
        let unit = (cell + 0.5) / self.resolution.as_vec3() - 0.5;
        self.center + self.rotation * (unit * self.size)
    }

    /// Distance of a world position from the box, metres; 0 inside.
    pub fn distance(&self, position: Vec3) -> f32 {
        self.beyond(self.cell_from_world(position))
    }

    /// Distance of a place in cells from the box, metres; 0 inside.
    pub fn beyond(&self, cell: Vec3) -> f32 {
        (self.outside(cell) * self.spacing()).length()
    }

    /// How much a place in cells belongs to the box: 1 inside the outermost probes' centres, falling
    /// smoothly (3t² − 2t³) to 0 at the border, half a cell farther out.
    pub fn weight(&self, cell: Vec3) -> f32 {
        let to_border = (cell + 0.5).min(self.resolution.as_vec3() - 0.5 - cell);
        // An axis of one cell reaches from border to border: half of it is half a cell.
        let t = (2.0 * to_border).clamp(Vec3::ZERO, Vec3::ONE);
        (t * t * (3.0 - 2.0 * t)).element_product()
    }

    /// How much of what no box claims belongs to this one: 1 inside and on the border, falling
    /// linearly to 0 half a cell outside.
    pub fn reach(&self, cell: Vec3) -> f32 {
        (1.0 - 2.0 * self.outside(cell)).max(Vec3::ZERO).element_product()
    }

    /// By how many cells a place lies outside the box, along each axis.
    fn outside(&self, cell: Vec3) -> Vec3 {
        (-0.5 - cell).max(cell + 0.5 - self.resolution.as_vec3()).max(Vec3::ZERO)
    }
}
