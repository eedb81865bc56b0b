//! One field: what its kind makes of frames.

use lumencast_codec::{FieldInfo, LightTrack, Shape};
use lumencast_light::{Field, Light};

use crate::CacheError;
use crate::newest::Newest;
use crate::received::Received;
use crate::volume::VolumeCache;

/// What is known of a field, by its kind. What is shown of it stands beside, in the cache's light, and
/// comes with each call.
#[derive(Clone, Debug)]
pub(crate) enum FieldCache {
    Volume(VolumeCache),
}

impl FieldCache {
    /// Of a field of which nothing has come yet.
    pub(crate) fn new(info: &FieldInfo) -> Self {
        match &info.shape {
            Shape::Volume(shape) => Self::Volume(VolumeCache::new(shape)),
        }
    }

    /// A field that shows the light that was known before where it is.
    pub(crate) fn lit_by(light: &Light, info: &FieldInfo) -> Field {
        let mut field = info.dark();
        match &mut field {
            Field::Volume(volume) => VolumeCache::light_by(light, volume),
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
        }
    }

    /// Forgets updates, which another run of the server numbers anew; what is shown stays.
    pub(crate) fn forget_updates(&mut self) {
        match self {
            Self::Volume(cache) => cache.forget_updates(),
        }
    }

    /// Brings what is shown to `now`.
    pub(crate) fn show(&mut self, now: f64, shown: &mut Field) {
        match (self, shown) {
            (Self::Volume(cache), Field::Volume(volume)) => cache.show(now, volume),
        }
    }

    /// The newest light of each region that has any.
    pub(crate) fn newest(&self) -> impl Iterator<Item = &Newest> {
        match self {
            Self::Volume(cache) => cache.newest(),
        }
    }

    /// The newest light of a region.
    pub(crate) fn newest_of(&self, region: u32) -> Option<&Newest> {
        match self {
            Self::Volume(cache) => cache.newest_of(region),
        }
    }
}
