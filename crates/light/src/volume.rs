//! Probe volumes: spherical-harmonic probes at the cell centres of an oriented box.

use glam::{Quat, UVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::{Offset, Order};

/// Number of a volume within a scene.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct VolumeId(pub u32);

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
}

/// A volume of probes with their light.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeVolume {
    /// Its number within the scene.
    pub id: VolumeId,
    /// Where the probes are.
    pub grid: Grid,
    /// Order of the expansion.
    pub order: Order,
    /// Where in front of a surface its light is meant to be read.
    pub offset: Offset,
    /// Coefficients of arriving radiance (r, g, b), cd/m²: `order.coefficients()` a probe, probe by
    /// probe in index order.
    pub coefficients: Vec<Vec3>,
}

impl ProbeVolume {
    /// A volume without light, read half a cell in front of surfaces.
    pub fn dark(id: VolumeId, grid: Grid, order: Order) -> Self {
        let coefficients = vec![Vec3::ZERO; grid.probe_count() * order.coefficients()];
        Self { id, grid, order, offset: Offset::default(), coefficients }
    }

    /// The same light, to be read elsewhere.
    #[must_use]
    pub fn read_at(self, offset: Offset) -> Self {
        Self { offset, ..self }
    }

    /// The coefficients of one probe.
    pub fn probe(&self, index: usize) -> &[Vec3] {
        let n = self.order.coefficients();
        &self.coefficients[index * n..][..n]
    }

    /// The coefficients of one probe, to be set.
    pub fn probe_mut(&mut self, index: usize) -> &mut [Vec3] {
        let n = self.order.coefficients();
        &mut self.coefficients[index * n..][..n]
    }
}
