//! Whether volumes can be sent.

use lumencast_scene::VolumeSpec;
use thiserror::Error;

use crate::{limits, regions};

/// Volumes that a catalog cannot carry.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum VolumesError {
    /// A volume that makes no sense, or is too large.
    #[error("volume {volume}: {reason}")]
    Volume {
        /// Its number among the scene's volumes.
        volume: u32,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// More fields than a catalog holds.
    #[error(
        "{0} fields; a catalog holds at most {max}: give fewer volumes, or fewer cells along z, of \
         which 34 make a field",
        max = limits::FIELDS
    )]
    TooManyFields(usize),
}

/// Whether the fields of volumes, cut into pieces as [`VolumeSpec::split`] does, can be sent.
///
/// # Errors
/// The first volume that makes no sense or is beyond a limit.
pub fn check_volumes(volumes: &[VolumeSpec]) -> Result<(), VolumesError> {
    let (mut fields, mut total) = (0, 0);
    for (volume, spec) in (0..).zip(volumes) {
        let refused = |reason| VolumesError::Volume { volume, reason };
        let most = |count: usize, what: &str, limit: usize| {
            let reason = format!("{count} {what}; at most {limit}: give it fewer cells");
            if count > limit { Err(refused(reason)) } else { Ok(()) }
        };
        spec.check().map_err(refused)?;
        total += spec.grid.probe_count();
        most(total, "probes with those before it", limits::CATALOG_PROBES)?;
        for piece in spec.split() {
            most(piece.grid.probe_count(), "probes", limits::FIELD_PROBES)?;
            most(regions(piece.grid.resolution).len(), "regions", limits::REGIONS)?;
            fields += 1;
        }
    }
    if fields > limits::FIELDS {
        return Err(VolumesError::TooManyFields(fields));
    }
    Ok(())
}
