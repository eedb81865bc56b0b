//! Frames onto their tracks.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;
use lumencast_codec::tracks::{self, LightTrack};
use lumencast_codec::{Catalog, EncodedRegion};
use lumencast_transport::{Broadcast, TrackWriter};

use crate::http::Shared;

/// Where a tick's frames go.
pub trait Outlet {
    /// Whether anyone reads this region of this field: what nobody reads is not encoded.
    fn is_watched(&self, field: u32, region: u32) -> bool;
    /// Takes a catalog that replaces the one before.
    fn catalog(&mut self, catalog: &Catalog);
    /// Takes a state frame; it begins a group where it is a snapshot.
    fn state(&mut self, frame: Vec<u8>, new_group: bool);
    /// Takes a region's light.
    fn light(&mut self, field: u32, frame: EncodedRegion);
}

/// The tracks of a scene's broadcast. Those of light follow the catalog: they come and go with its
/// fields.
pub(crate) struct Publisher {
    /// Ends for its readers when it is dropped.
    broadcast: Broadcast,
    catalog: TrackWriter,
    state: TrackWriter,
    light: BTreeMap<LightTrack, TrackWriter>,
    shared: Arc<Shared>,
}

impl Publisher {
    /// Makes the tracks that a catalog lists, and announces the broadcast.
    pub(crate) fn new(
        broadcast: Broadcast,
        catalog: &Catalog,
        shared: Arc<Shared>,
    ) -> lumencast_transport::Result<Self> {
        let catalog_track = broadcast.track(tracks::CATALOG, tracks::CATALOG_PRIORITY)?;
        let state = broadcast.track(tracks::STATE, tracks::STATE_PRIORITY)?;
        let light = BTreeMap::new();
        let mut publisher = Self { broadcast, catalog: catalog_track, state, light, shared };
        publisher.catalog(catalog);
        publisher.broadcast.announce()?;
        Ok(publisher)
    }

    /// Makes the tracks that a catalog lists and there are not yet, and ends those that it lacks.
    fn follow(&mut self, catalog: &Catalog) {
        let mut known = std::mem::take(&mut self.light);
        for track in LightTrack::of_catalog(catalog) {
            let kept = known.remove(&track).map(Ok);
            let made = || self.broadcast.track(&track.to_string(), track.server_priority());
            match kept.unwrap_or_else(made) {
                Ok(writer) => drop(self.light.insert(track, writer)),
                Err(error) => tracing::warn!(%track, %error, "a track cannot be made"),
            }
        }
        for (track, writer) in known {
            if let Err(error) = writer.finish() {
                tracing::debug!(%track, %error, "a track ended before its last frame");
            }
        }
    }
}

impl Outlet for Publisher {
    fn is_watched(&self, field: u32, region: u32) -> bool {
        let layer = |layer| self.light.get(&LightTrack { field, region, layer });
        (0..tracks::LAYERS).filter_map(layer).any(TrackWriter::is_used)
    }

    fn catalog(&mut self, catalog: &Catalog) {
        // Tracks come first, so that readers of the catalog find them.
        self.follow(catalog);
        write(&mut self.catalog, catalog.encode(), true, &self.shared);
    }

    fn state(&mut self, frame: Vec<u8>, new_group: bool) {
        write(&mut self.state, frame, new_group, &self.shared);
    }

    fn light(&mut self, field: u32, frame: EncodedRegion) {
        let track = LightTrack { field, region: frame.region, layer: frame.layer };
        if let Some(track) = self.light.get_mut(&track) {
            write(track, frame.bytes, frame.new_group, &self.shared);
        }
    }
}

/// A frame that cannot be written is lost as one lost on the way would be: clients wait for the
/// next keyframe.
fn write(track: &mut TrackWriter, frame: Vec<u8>, new_group: bool, shared: &Shared) {
    let bytes = frame.len();
    match track.write(Bytes::from(frame), new_group) {
        Ok(()) => shared.metrics.sent(track.name(), bytes),
        Err(error) => tracing::warn!(track = track.name(), %error, "frame not published"),
    }
}
