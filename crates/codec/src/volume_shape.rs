//! The shape of a volume: where its probes are, and how they are sent.

use std::collections::HashSet;

use glam::{IVec3, Quat, Vec3};
use lumencast_light::{FieldId, Grid, Offset, Order, ProbeVolume};
use serde::{Deserialize, Serialize};

use crate::{DecodeError, Region, limits, regions};

/// Temporal layers that the encoder makes.
const LAYERS: u8 = 3;

/// A volume of probes, as a catalog describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VolumeShape {
    /// What the coefficients belong to.
    pub basis: Basis,
    /// Order of the spherical harmonics.
    pub order: Order,
    /// Where the probes are.
    pub grid: Grid,
    /// Where in front of a surface the light is meant to be read: less than half a cell for light that
    /// was fitted to be read there.
    #[serde(default, skip_serializing_if = "is_usual")]
    pub offset: Offset,
    /// Absolute integer coordinates of the grid's first cell; 0 unless the volume scrolls.
    #[serde(default)]
    pub cells_min: IVec3,
    /// Boxes of cells that together cover the grid, without overlap.
    pub regions: Vec<Region>,
    /// Temporal layers, 1 to 3.
    pub layers: u8,
}

/// Functions of direction that light is expanded in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// Real spherical harmonics.
    #[default]
    Sh,
}

fn is_usual(offset: &Offset) -> bool {
    *offset == Offset::default()
}

impl VolumeShape {
    /// The shape of a volume, cut into regions as [`regions`] does.
    pub fn of(volume: &ProbeVolume) -> Self {
        Self {
            basis: Basis::Sh,
            order: volume.order,
            grid: volume.grid,
            offset: volume.offset,
            cells_min: IVec3::ZERO,
            regions: regions(volume.grid.resolution),
            layers: LAYERS,
        }
    }

    /// A volume of this shape without light.
    pub fn dark(&self, id: FieldId) -> ProbeVolume {
        ProbeVolume::dark(id, self.grid, self.order).read_at(self.offset)
    }

    /// The region of a number.
    pub fn region(&self, id: u32) -> Option<Region> {
        self.regions.iter().copied().find(|region| region.id == id)
    }

    /// Distance of a world position from a region, metres; 0 inside.
    pub fn distance(&self, region: Region, position: Vec3) -> f32 {
        let Grid { center, rotation, size, .. } = self.grid;
        let cell = self.grid.spacing();
        let size_of_region = region.size.as_vec3() * cell;
        let from_corner = region.min.as_vec3() * cell + 0.5 * size_of_region;
        let center = center + rotation * (from_corner - 0.5 * size);
        let part = Grid { center, size: size_of_region, resolution: region.size, ..self.grid };
        part.distance(position)
    }

    /// The shape, if it can be one.
    ///
    /// # Errors
    /// A value out of its range, regions that do not cover the grid, a limit that is exceeded.
    pub(crate) fn validated(mut self) -> Result<Self, DecodeError> {
        let Grid { center, rotation, size, resolution } = self.grid;
        let probes = u128::from(resolution.x) * u128::from(resolution.y) * u128::from(resolution.z);
        if probes == 0 {
            return Err(DecodeError::Malformed("a grid without cells"));
        }
        let probes = usize::try_from(probes).unwrap_or(usize::MAX);
        DecodeError::limit("probes of a field", probes, limits::FIELD_PROBES)?;
        if !(center.is_finite() && size.is_finite() && size.min_element() > 0.0) {
            return Err(DecodeError::Malformed("a grid's center or size"));
        }
        if (rotation.length() - 1.0).abs() >= 1e-3 || !rotation.is_finite() {
            return Err(DecodeError::Malformed("a grid's rotation is no unit quaternion"));
        }
        if rotation != Quat::IDENTITY {
            self.grid.rotation = rotation.normalize();
        }
        let (Offset::Cells(offset) | Offset::Metres(offset)) = self.offset;
        if !offset.is_finite() {
            return Err(DecodeError::Malformed("offset"));
        }
        if !(1..=3).contains(&self.layers) {
            return Err(DecodeError::Malformed("layers"));
        }
        self.check_regions()?;
        Ok(self)
    }

    /// Regions must cover the grid without overlap.
    fn check_regions(&self) -> Result<(), DecodeError> {
        DecodeError::limit("regions of a field", self.regions.len(), limits::REGIONS)?;
        let ids: HashSet<u32> = self.regions.iter().map(|region| region.id).collect();
        if ids.len() < self.regions.len() {
            return Err(DecodeError::Malformed("two regions have the same id"));
        }
        let resolution = self.grid.resolution;
        let mut covered = vec![false; self.grid.probe_count()];
        for region in &self.regions {
            let cells = region.size.max_element() as usize;
            DecodeError::limit(
                "cells of a region along an axis",
                cells,
                limits::REGION_CELLS as usize,
            )?;
            if region.size.min_element() == 0
                || region.min.cmpgt(resolution).any()
                || (resolution - region.min).cmplt(region.size).any()
            {
                return Err(DecodeError::Malformed("a region is empty or lies outside its grid"));
            }
            for probe in region.probes(resolution) {
                if std::mem::replace(&mut covered[probe], true) {
                    return Err(DecodeError::Malformed("two regions overlap"));
                }
            }
        }
        if covered.contains(&false) {
            return Err(DecodeError::Malformed("the regions do not cover the grid"));
        }
        Ok(())
    }
}
