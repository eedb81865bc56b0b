//! A part of a scene's light.

use crate::field_id::FieldId;
use crate::volume::ProbeVolume;

/// A part of a scene's light, of one kind. Matches on it name every kind, so that the compiler shows
/// what a new one needs.
#[derive(Clone, Debug, PartialEq)]
pub enum Field {
    /// Probes in the cells of a box.
    Volume(ProbeVolume),
}

impl Field {
    /// Its number within the scene.
    pub fn id(&self) -> FieldId {
        match self {
            Self::Volume(volume) => volume.id,
        }
    }

    /// Number of its probes.
    pub fn probe_count(&self) -> usize {
        match self {
            Self::Volume(volume) => volume.grid.probe_count(),
        }
    }

    /// The volume, where it is one.
    pub fn as_volume(&self) -> Option<&ProbeVolume> {
        match self {
            Self::Volume(volume) => Some(volume),
        }
    }

    /// The volume, where it is one, to give it other light.
    pub fn as_volume_mut(&mut self) -> Option<&mut ProbeVolume> {
        match self {
            Self::Volume(volume) => Some(volume),
        }
    }
}

impl From<ProbeVolume> for Field {
    fn from(volume: ProbeVolume) -> Self {
        Self::Volume(volume)
    }
}
