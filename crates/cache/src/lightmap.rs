//! A lightmap: its tiles, each on the way to its newest light.

use std::collections::BTreeMap;
use std::sync::Arc;

use lumencast_codec::{FrameHead, LightTrack, LightmapShape};
use lumencast_light::{Field, FieldId, Layout, Light, Lightmap, LumelAges, Told};

use crate::CacheError;
use crate::newest::Newest;
use crate::received::Received;
use crate::tile::TileCache;

/// The tiles of a lightmap; those for which frames have come hold memory.
#[derive(Debug)]
pub(crate) struct LightmapCache {
    shape: LightmapShape,
    tiles: BTreeMap<u32, TileCache>,
}

impl LightmapCache {
    pub(crate) fn new(shape: &LightmapShape) -> Self {
        Self { shape: shape.clone(), tiles: BTreeMap::new() }
    }

    /// Gives a lightmap the pages of the one that had its number before, where they are as large, and
    /// their layout until its own is known.
    pub(crate) fn light_by(light: &Light, lightmap: &mut Lightmap) {
        let Layout { page_size, pages, .. } = *lightmap.layout;
        let before = light.field(lightmap.id).and_then(Field::as_lightmap);
        let Some(before) = before.filter(|before| before.layout.page_size == page_size) else {
            return;
        };
        let common = lightmap.irradiance.len().min(before.irradiance.len());
        lightmap.irradiance[..common].copy_from_slice(&before.irradiance[..common]);
        if let Some((slopes, before)) = lightmap.slopes.as_mut().zip(before.slopes.as_ref()) {
            slopes[..common].copy_from_slice(&before[..common]);
        }
        lightmap.layout = match before.layout.pages == pages {
            true => before.layout.clone(),
            false => {
                let all = before.layout.surfaces().iter();
                let surfaces = all.filter(|surface| surface.is_on_first(pages)).cloned();
                Arc::new(Layout::new(page_size, pages, surfaces.collect()))
            }
        };
    }

    pub(crate) fn add(
        &mut self,
        track: LightTrack,
        frame: &[u8],
        now: f64,
        tick_seconds: f64,
        shown: &mut Lightmap,
    ) -> Result<Received, CacheError> {
        let LightTrack { field, region, layer } = track;
        let unknown = CacheError::UnknownRegion { field, region };
        let tile = self.shape.tile(region).ok_or(unknown)?;
        let info = FrameHead::read(frame)?.info;
        if layer != 0 {
            return Err(CacheError::WrongLayer { update: info.update, layer });
        }
        let news = self
            .tiles
            .entry(region)
            .or_insert_with(|| TileCache::new(self.shape.coding, tile))
            .add(frame, now, tick_seconds, shown)?;
        Ok(Received { info, news })
    }

    pub(crate) fn forget_updates(&mut self) {
        self.tiles.values_mut().for_each(TileCache::forget_updates);
    }

    pub(crate) fn show(&mut self, now: f64, shown: &mut Lightmap) {
        self.tiles.values_mut().for_each(|tile| tile.show(now, shown));
    }

    pub(crate) fn newest(&self) -> impl Iterator<Item = &Newest> {
        self.tiles.values().filter_map(TileCache::newest)
    }

    pub(crate) fn newest_of(&self, region: u32) -> Option<&Newest> {
        self.tiles.get(&region)?.newest()
    }

    /// How long ago the light of each tile came; `field` is the lightmap's number.
    pub(crate) fn ages(&self, field: FieldId, now: f64) -> LumelAges {
        let tiles = || self.shape.tiles().filter(|tile| tile.told == Told::Irradiance);
        let age = |region| Some((now - self.newest_of(region)?.arrived).max(0.0));
        // The first tile is as large as any.
        let side = tiles().next().map_or(1, |tile| tile.size.x);
        LumelAges { field, side, seconds: tiles().map(|tile| age(tile.id)).collect() }
    }
}
