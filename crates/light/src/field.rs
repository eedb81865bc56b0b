//! A part of a scene's light.

use crate::field_id::FieldId;
use crate::lightmap::Lightmap;
use crate::volume::ProbeVolume;

/// A part of a scene's light, of one kind. Matches on it name every kind, so that the compiler shows
/// what a new one needs.
#[derive(Clone, Debug, PartialEq)]
pub enum Field {
    /// Probes in the cells of a box.
    Volume(ProbeVolume),
    /// Lumels on surfaces.
    Lightmap(Lightmap),
}

impl Field {
    /// Its number within the scene.
    pub fn id(&self) -> FieldId {
        match self {
            Self::Volume(volume) => volume.id,
            Self::Lightmap(lightmap) => lightmap.id,
        }
    }

    /// Number of its probes.
    pub fn probe_count(&self) -> usize {
        match self {
            Self::Volume(volume) => volume.grid.probe_count(),
            Self::Lightmap(_) => 0,
        }
    }

    /// The volume, where it is one.
    pub fn as_volume(&self) -> Option<&ProbeVolume> {
        match self {
            Self::Volume(volume) => Some(volume),
            Self::Lightmap(_) => None,
        }
    }

    /// The volume, where it is one, to give it other light.
    pub fn as_volume_mut(&mut self) -> Option<&mut ProbeVolume> {
        match self {
            Self::Volume(volume) => Some(volume),
            Self::Lightmap(_) => None,
        }
    }

    /// The lightmap, where it is one.
    pub fn as_lightmap(&self) -> Option<&Lightmap> {
        match self {
            Self::Volume(_) => None,
            Self::Lightmap(lightmap) => Some(lightmap),
        }
    }

    /// The lightmap, where it is one, to give it other light.
    pub fn as_lightmap_mut(&mut self) -> Option<&mut Lightmap> {
        match self {
            Self::Volume(_) => None,
            Self::Lightmap(lightmap) => Some(lightmap),
        }
    }
}

impl From<ProbeVolume> for Field {
    fn from(volume: ProbeVolume) -> Self {
        Self::Volume(volume)
    }
}

impl From<Lightmap> for Field {
    fn from(lightmap: Lightmap) -> Self {
        Self::Lightmap(lightmap)
    }
}
