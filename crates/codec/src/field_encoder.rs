//! Light of any kind of field → frames.

use lumencast_light::Field;

use crate::field_info::FieldInfo;
use crate::{EncodedRegion, ProbeEncoder, UpdateInfo};

/// Encodes the updates of a field, by its kind.
#[derive(Clone, Debug)]
pub enum FieldEncoder {
    /// Encodes a volume of probes.
    Volume(ProbeEncoder),
}

impl FieldEncoder {
    /// Prepares for a field of this shape.
    pub fn new(field: &Field) -> Self {
        match field {
            Field::Volume(volume) => {
                Self::Volume(ProbeEncoder::new(volume.grid.resolution, volume.order))
            }
        }
    }

    /// Encodes an update for the regions that somebody watches; see [`ProbeEncoder::encode`].
    ///
    /// # Panics
    /// If `field` is of another shape than that given to [`Self::new`].
    pub fn encode(
        &mut self,
        field: &Field,
        info: UpdateInfo,
        watched: impl Fn(u32) -> bool,
    ) -> Vec<EncodedRegion> {
        match (self, field) {
            (Self::Volume(encoder), Field::Volume(volume)) => encoder.encode(volume, info, watched),
        }
    }

    /// Numbers of the field's regions.
    pub fn regions(&self) -> impl Iterator<Item = u32> + '_ {
        match self {
            Self::Volume(encoder) => encoder.regions().map(|region| region.id),
        }
    }

    /// log2 of the field's scale after the last update; none before there was any light.
    pub fn scale_log2(&self) -> Option<i8> {
        match self {
            Self::Volume(encoder) => encoder.scale_log2(),
        }
    }

    /// The field as a catalog lists it; `source` as in [`FieldInfo::source`].
    pub fn describe(&self, field: &Field, source: &str) -> FieldInfo {
        match field {
            Field::Volume(volume) => FieldInfo::of_volume(volume, self.scale_log2(), source),
        }
    }
}
