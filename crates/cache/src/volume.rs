//! A volume: its regions, each on the way to its newest light.

use std::collections::BTreeMap;

use lumencast_codec::{LightTrack, ProbeHeader, VolumeShape};
use lumencast_light::{Light, Place, ProbeVolume};

use crate::CacheError;
use crate::newest::Newest;
use crate::received::Received;
use crate::region::RegionCache;

/// The regions of a volume; those for which frames have come hold memory.
#[derive(Clone, Debug)]
pub(crate) struct VolumeCache {
    shape: VolumeShape,
    regions: BTreeMap<u32, RegionCache>,
}

impl VolumeCache {
    pub(crate) fn new(shape: &VolumeShape) -> Self {
        Self { shape: shape.clone(), regions: BTreeMap::new() }
    }

    /// Gives a volume the light that was known before at its probes.
    pub(crate) fn light_by(light: &Light, volume: &mut ProbeVolume) {
        let n = volume.order.coefficients();
        for probe in 0..volume.grid.probe_count() {
            let position = volume.grid.position(volume.grid.cell(probe));
            if let Some(before) = light.sample(&Place::in_space(position)) {
                volume.probe_mut(probe).copy_from_slice(&before.coefficients[..n]);
            }
        }
    }

    pub(crate) fn add(
        &mut self,
        track: LightTrack,
        frame: &[u8],
        now: f64,
        tick_seconds: f64,
        shown: &mut ProbeVolume,
    ) -> Result<Received, CacheError> {
        let LightTrack { field, region, layer } = track;
        let unknown = CacheError::UnknownRegion { field, region };
        let cells = self.shape.region(region).ok_or(unknown)?;
        let info = ProbeHeader::read(frame)?.info;
        if info.layer() != layer {
            return Err(CacheError::WrongLayer { update: info.update, layer });
        }
        let news = self
            .regions
            .entry(region)
            .or_insert_with(|| RegionCache::new(cells, self.shape.order))
            .add(frame, now, tick_seconds, shown)?;
        Ok(Received { info, news })
    }

    pub(crate) fn forget_updates(&mut self) {
        self.regions.values_mut().for_each(RegionCache::forget_updates);
    }

    pub(crate) fn show(&mut self, now: f64, shown: &mut ProbeVolume) {
        self.regions.values_mut().for_each(|region| region.show(now, shown));
    }

    pub(crate) fn newest(&self) -> impl Iterator<Item = &Newest> {
        self.regions.values().filter_map(RegionCache::newest)
    }

    pub(crate) fn newest_of(&self, region: u32) -> Option<&Newest> {
        self.regions.get(&region)?.newest()
    }
}
