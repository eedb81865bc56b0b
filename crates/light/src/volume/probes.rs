//! A volume's probes with their light.

use glam::Vec3;

use super::{Grid, Offset};
use crate::Order;
use crate::field_id::FieldId;

/// A volume of probes with their light.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeVolume {
    /// Its number within the scene.
    pub id: FieldId,
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
    pub fn dark(id: FieldId, grid: Grid, order: Order) -> Self {
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
