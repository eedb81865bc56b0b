//! Frames onto their tracks.

use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError};

use bytes::Bytes;
use lumencast_codec::tracks::{self, LightTrack};
use lumencast_codec::{Catalog, EncodedRegion, Resource};
use lumencast_transport::{Broadcast, TrackWriter};

use crate::http::Shared;

/// Where a tick's frames go.
pub trait Outlet {
    /// Whether anyone reads this region of this field: what nobody reads is not encoded.
    fn is_watched(&self, field: u32, region: u32) -> bool;
    /// Takes what the next catalog's shapes name by hash.
    fn resources(&mut self, _resources: Vec<Resource>) {}
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

    fn resources(&mut self, resources: Vec<Resource>) {
        let mut known = self.shared.resources.write().unwrap_or_else(PoisonError::into_inner);
        known.replace(resources);
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

#[cfg(test)]
mod tests {
    use std::sync::RwLock;
    use std::sync::atomic::AtomicU64;
    use std::time::{Duration, Instant};

    use glam::{Quat, UVec3, Vec3};
    use lumencast_codec::{Epoch, FieldInfo, SceneInfo};
    use lumencast_light::{FieldId, Grid, Order, ProbeVolume};
    use lumencast_transport::{Client, ConnectOptions, ReadOptions, Server, ServerConfig};

    use super::*;
    use crate::http::Ticked;
    use crate::metrics::Metrics;

    /// So long something may take that has to come.
    const PATIENCE: Duration = Duration::from_secs(60);

    fn catalog(fields: &[u32]) -> Catalog {
        let grid = Grid {
            center: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            size: Vec3::ONE,
            resolution: UVec3::ONE,
        };
        let info = |id: &u32| {
            FieldInfo::of_volume(&ProbeVolume::dark(FieldId(*id), grid, Order::L1), None, "")
        };
        let scene = SceneInfo { name: "room".into(), root: "room.glb".into() };
        let fields = fields.iter().map(info).collect();
        Catalog { epoch: Epoch(1), scene, tick_seconds: 0.04, fields, unknown: vec![] }
    }

    fn light(bytes: &[u8]) -> EncodedRegion {
        EncodedRegion { region: 0, layer: 0, new_group: true, bytes: bytes.into(), error: 0.0 }
    }

    /// Fields come and go: their tracks with them, while those that stay go on.
    #[tokio::test]
    async fn tracks_follow_catalogs() {
        let shared = Arc::new(Shared {
            metrics: Metrics::default(),
            page: Default::default(),
            scene_files: Default::default(),
            resources: Default::default(),
            scene: "room".into(),
            root: "room.glb".into(),
            tick: AtomicU64::new(0),
            ticked: RwLock::new(Ticked::at(Instant::now(), 0.04, 0.0)),
        });
        let config = ServerConfig::new("127.0.0.1:0".parse().unwrap());
        let server = Server::bind(config, axum::Router::new()).await.unwrap();
        let broadcast = server.publish("room").unwrap();
        let mut publisher = Publisher::new(broadcast, &catalog(&[0, 1]), shared).unwrap();
        let address = format!("http://{}/room", server.local_addr());
        let client = Client::connect(&address, ConnectOptions::default()).await.unwrap();
        let read = |field| {
            let track = LightTrack { field, region: 0, layer: 0 }.to_string();
            client.subscribe("room", &track, ReadOptions::default())
        };
        let frame = async |reader: &mut lumencast_transport::TrackReader| {
            let frame = tokio::time::timeout(PATIENCE, reader.next()).await.expect("in time");
            frame.expect("a track").map(|frame| frame.bytes)
        };

        let (mut stays, mut goes) = (read(0), read(1));
        publisher.light(0, light(b"a"));
        publisher.light(1, light(b"b"));
        assert_eq!(frame(&mut stays).await.as_deref(), Some(&b"a"[..]));
        assert_eq!(frame(&mut goes).await.as_deref(), Some(&b"b"[..]));
        assert!(publisher.is_watched(0, 0) && publisher.is_watched(1, 0));

        publisher.catalog(&catalog(&[0, 2]));
        let mut comes = read(2);
        publisher.light(0, light(b"c"));
        publisher.light(1, light(b"to nobody"));
        publisher.light(2, light(b"d"));
        assert_eq!(frame(&mut stays).await.as_deref(), Some(&b"c"[..]));
        assert_eq!(frame(&mut comes).await.as_deref(), Some(&b"d"[..]));
        assert!(publisher.is_watched(0, 0) && !publisher.is_watched(1, 0));
        drop(goes);
        server.shutdown(Duration::ZERO).await;
    }
}
