//! Light of any kind of field → frames.

use lumencast_light::Field;

use crate::field_info::FieldInfo;
use crate::{
    EncodedRegion, LightmapShape, LumelCoding, LumelEncoder, ProbeEncoder, UpdateInfo, VideoError,
};

/// Encodes the updates of a field, by its kind.
#[derive(Debug)]
pub enum FieldEncoder {
    /// Encodes a volume of probes.
    Volume(ProbeEncoder),
    /// Encodes a lightmap.
    Lightmap(LumelEncoder),
}

impl FieldEncoder {
    /// Prepares for a field of this shape, whose lumels, if it has any, are coded so.
    pub fn new(field: &Field, lumels: LumelCoding) -> Self {
        match field {
            Field::Volume(volume) => {
                Self::Volume(ProbeEncoder::new(volume.grid.resolution, volume.order))
            }
            Field::Lightmap(lightmap) => {
                let shape = LightmapShape::of(lightmap, lumels.coding());
                Self::Lightmap(LumelEncoder::new(shape, lumels))
            }
        }
    }

    /// Goes on with a field of the same kind whose surfaces lie elsewhere, and begins anew where it has
    /// other pages.
    pub fn follow(&mut self, field: &Field, lumels: LumelCoding) {
        if let (Self::Lightmap(encoder), Field::Lightmap(lightmap)) = (&mut *self, field)
            && encoder.follow(LightmapShape::of(lightmap, lumels.coding()))
        {
            return;
        }
        *self = Self::new(field, lumels);
    }

    /// Encodes an update for the regions that somebody watches; see [`ProbeEncoder::encode`] and
    /// [`LumelEncoder::encode`].
    ///
    /// # Errors
    /// [`VideoError`] where lumels cannot be coded as video.
    ///
    /// # Panics
    /// If `field` is of another shape than that given to [`Self::new`].
    pub fn encode(
        &mut self,
        field: &Field,
        info: UpdateInfo,
        watched: impl Fn(u32) -> bool,
    ) -> Result<Vec<EncodedRegion>, VideoError> {
        match (self, field) {
            (Self::Volume(encoder), Field::Volume(volume)) => {
                Ok(encoder.encode(volume, info, watched))
            }
            (Self::Lightmap(encoder), Field::Lightmap(lightmap)) => {
                encoder.encode(lightmap, info, watched)
            }
            (Self::Volume(_), Field::Lightmap(_)) | (Self::Lightmap(_), Field::Volume(_)) => {
                panic!("a field of another kind")
            }
        }
    }

    /// Numbers of the field's regions.
    pub fn regions(&self) -> impl Iterator<Item = u32> + '_ {
        let numbers: Box<dyn Iterator<Item = u32> + '_> = match self {
            Self::Volume(encoder) => Box::new(encoder.regions().map(|region| region.id)),
            Self::Lightmap(encoder) => Box::new(encoder.shape().tiles().map(|tile| tile.id)),
        };
        numbers
    }

    /// log2 of the field's scale after the last update; none before there was any light.
    pub fn scale_log2(&self) -> Option<i8> {
        match self {
            Self::Volume(encoder) => encoder.scale_log2(),
            Self::Lightmap(encoder) => encoder.scale_log2(),
        }
    }

    /// The field as a catalog lists it; `source` as in [`FieldInfo::source`].
    ///
    /// # Panics
    /// If `field` is of another kind than that given to [`Self::new`].
    pub fn describe(&self, field: &Field, source: &str) -> FieldInfo {
        let scale_log2 = self.scale_log2();
        match (self, field) {
            (Self::Volume(_), Field::Volume(volume)) => {
                FieldInfo::of_volume(volume, scale_log2, source)
            }
            (Self::Lightmap(encoder), Field::Lightmap(lightmap)) => {
                FieldInfo::of_lightmap(lightmap.id, encoder.shape().clone(), scale_log2, source)
            }
            (Self::Volume(_), Field::Lightmap(_)) | (Self::Lightmap(_), Field::Volume(_)) => {
                panic!("a field of another kind")
            }
        }
    }
}
