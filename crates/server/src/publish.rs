//! Frames onto their tracks.

use std::sync::Arc;

use bytes::Bytes;
use lumencast_codec::{Catalog, EncodedRegion};
use lumencast_transport::{Broadcast, TrackWriter};

use crate::http::Shared;

/// Where a tick's frames go.
pub trait Outlet {
    /// Whether anyone reads this region of this field: what nobody reads is not encoded.
    fn is_watched(&self, field: u32, region: u32) -> bool;
    /// Takes a catalog that replaces the one before.
    fn catalog(&mut self, frame: Vec<u8>);
    /// Takes a state frame; it begins a group where it is a snapshot.
    fn state(&mut self, frame: Vec<u8>, new_group: bool);
    /// Takes a region's light.
    fn probes(&mut self, field: u32, frame: EncodedRegion);
}

/// Priorities of the tracks among themselves (docs/wire.md); clients grade regions on their own.
const CATALOG_PRIORITY: u8 = 255;
const STATE_PRIORITY: u8 = 254;
const LAYER_PRIORITY: [u8; 3] = [2, 1, 0];

/// The tracks of a scene's broadcast.
pub(crate) struct Publisher {
    /// Ends for its readers when it is dropped.
    _broadcast: Broadcast,
    catalog: TrackWriter,
    state: TrackWriter,
    /// By field, region and layer.
    probes: Vec<Vec<[TrackWriter; 3]>>,
    shared: Arc<Shared>,
}

impl Publisher {
    /// Makes the tracks that a catalog lists, and announces the broadcast.
    pub(crate) fn new(
        broadcast: Broadcast,
        catalog: &Catalog,
        shared: Arc<Shared>,
    ) -> lumencast_transport::Result<Self> {
        let frame = catalog.encode();
        let mut catalog_track = broadcast.track("catalog", CATALOG_PRIORITY)?;
        shared.metrics.sent("catalog", frame.len());
        catalog_track.write(frame.into(), true)?;
        let state = broadcast.track("state", STATE_PRIORITY)?;

        let mut probes = Vec::with_capacity(catalog.fields.len());
        for field in &catalog.fields {
            let mut tracks = Vec::with_capacity(field.regions.len());
            for region in &field.regions {
                let track = |layer: usize| {
                    let name = format!("f{}/r{}/l{layer}", field.id, region.id);
                    broadcast.track(&name, LAYER_PRIORITY[layer])
                };
                tracks.push([track(0)?, track(1)?, track(2)?]);
            }
            probes.push(tracks);
        }
        broadcast.announce()?;
        Ok(Self { _broadcast: broadcast, catalog: catalog_track, state, probes, shared })
    }

    fn tracks(&self, field: u32, region: u32) -> Option<&[TrackWriter; 3]> {
        self.probes.get(field as usize)?.get(region as usize)
    }
}

impl Outlet for Publisher {
    fn is_watched(&self, field: u32, region: u32) -> bool {
        self.tracks(field, region).is_some_and(|layers| layers.iter().any(TrackWriter::is_used))
    }

    fn catalog(&mut self, frame: Vec<u8>) {
        write(&mut self.catalog, frame, true, &self.shared);
    }

    fn state(&mut self, frame: Vec<u8>, new_group: bool) {
        write(&mut self.state, frame, new_group, &self.shared);
    }

    fn probes(&mut self, field: u32, frame: EncodedRegion) {
        let tracks = self.probes.get_mut(field as usize);
        let layers = tracks.and_then(|tracks| tracks.get_mut(frame.region as usize));
        if let Some(track) = layers.and_then(|layers| layers.get_mut(usize::from(frame.layer))) {
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
