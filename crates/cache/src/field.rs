//! One field: what its kind makes of frames.

use lumencast_codec::{FieldInfo, LightTrack, Shape};
use lumencast_light::{Field, FieldId, Light, LumelAges};

use crate::CacheError;
use crate::lightmap::LightmapCache;
use crate::newest::Newest;
use crate::received::Received;
use crate::volume::VolumeCache;

/// What is known of a field, by its kind. What is shown of it stands beside, in the cache's light, and
/// comes with each call.
#[derive(Debug)]
pub(crate) enum FieldCache {
    Volume(VolumeCache),
    Lightmap(LightmapCache),
}

impl FieldCache {
    /// Of a field of which nothing has come yet.
    pub(crate) fn new(info: &FieldInfo) -> Self {
        match &info.shape {
            Shape::Volume(shape) => Self::Volume(VolumeCache::new(shape)),
            Shape::Lightmap(shape) => Self::Lightmap(LightmapCache::new(shape)),
        }
    }

    /// A field that shows the light that was known before where it is.
    pub(crate) fn lit_by(light: &Light, info: &FieldInfo) -> Field {
        let mut field = info.dark();
        match &mut field {
            Field::Volume(volume) => VolumeCache::light_by(light, volume),
            Field::Lightmap(lightmap) => LightmapCache::light_by(light, lightmap),
        }
        field
    }

    /// Takes a frame in.
    pub(crate) fn add(
        &mut self,
        track: LightTrack,
        frame: &[u8],
        now: f64,
        tick_seconds: f64,
        shown: &mut Field,
    ) -> Result<Received, CacheError> {
        match (self, shown) {
            (Self::Volume(cache), Field::Volume(volume)) => {
                cache.add(track, frame, now, tick_seconds, volume)
            }
            (Self::Lightmap(cache), Field::Lightmap(lightmap)) => {
                cache.add(track, frame, now, tick_seconds, lightmap)
            }
            (Self::Volume(_), Field::Lightmap(_)) | (Self::Lightmap(_), Field::Volume(_)) => {
                Err(CacheError::UnknownField(track.field))
            }
        }
    }

    /// Forgets updates, which another run of the server numbers anew; what is shown stays.
    pub(crate) fn forget_updates(&mut self) {
        match self {
            Self::Volume(cache) => cache.forget_updates(),
            Self::Lightmap(cache) => cache.forget_updates(),
        }
    }

    /// Brings what is shown to `now`.
    pub(crate) fn show(&mut self, now: f64, shown: &mut Field) {
        match (self, shown) {
            (Self::Volume(cache), Field::Volume(volume)) => cache.show(now, volume),
            (Self::Lightmap(cache), Field::Lightmap(lightmap)) => cache.show(now, lightmap),
            (Self::Volume(_), Field::Lightmap(_)) | (Self::Lightmap(_), Field::Volume(_)) => {}
        }
    }

    /// The newest light of each region that has any.
    pub(crate) fn newest(&self) -> impl Iterator<Item = &Newest> {
        let newest: Box<dyn Iterator<Item = &Newest>> = match self {
            Self::Volume(cache) => Box::new(cache.newest()),
            Self::Lightmap(cache) => Box::new(cache.newest()),
        };
        newest
    }

    /// The newest light of a region.
    pub(crate) fn newest_of(&self, region: u32) -> Option<&Newest> {
        match self {
            Self::Volume(cache) => cache.newest_of(region),
            Self::Lightmap(cache) => cache.newest_of(region),
        }
    }

    /// How long ago the light of its lumels came, where it has some; `field` is its number.
    pub(crate) fn lumel_ages(&self, field: FieldId, now: f64) -> Option<LumelAges> {
        match self {
            Self::Volume(_) => None,
            Self::Lightmap(cache) => Some(cache.ages(field, now)),
        }
    }
}
