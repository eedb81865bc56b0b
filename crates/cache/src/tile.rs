//! One tile of a lightmap: its decoder, and the passage to its newest light.

use lumencast_codec::{Coding, DecodeError, LumelDecoder, Tile};
use lumencast_light::Lightmap;

use crate::newest::Newest;
use crate::passage::Passage;

/// One tile of a lightmap.
#[derive(Debug)]
pub(crate) struct TileCache {
    coding: Coding,
    tile: Tile,
    decoder: LumelDecoder,
    passage: Passage,
}

impl TileCache {
    pub(crate) fn new(coding: Coding, tile: Tile) -> Self {
        let decoder = LumelDecoder::new(coding, tile.size);
        Self { coding, tile, decoder, passage: Passage::default() }
    }

    /// See [`Passage::forget_updates`].
    pub(crate) fn forget_updates(&mut self) {
        self.decoder = LumelDecoder::new(self.coding, self.tile.size);
        self.passage.forget_updates();
    }

    pub(crate) fn newest(&self) -> Option<&Newest> {
        self.passage.newest()
    }

    /// Takes a frame in; whether it is newer than what was there. `lightmap` is what is shown.
    pub(crate) fn add(
        &mut self,
        frame: &[u8],
        now: f64,
        tick_seconds: f64,
        lightmap: &mut Lightmap,
    ) -> Result<bool, DecodeError> {
        let light = self.decoder.decode(frame)?;
        let places = self.tile.rows(lightmap.layout.page_size);
        let (info, told) = (light.head.info, light.told(self.tile.told));
        let shown = lightmap.told_mut(self.tile.told);
        Ok(self.passage.take_in(info, told, (now, tick_seconds), shown, places))
    }

    /// Brings `lightmap` to what is to be seen at `now`.
    pub(crate) fn show(&mut self, now: f64, lightmap: &mut Lightmap) {
        let places = self.tile.rows(lightmap.layout.page_size);
        self.passage.show(now, lightmap.told_mut(self.tile.told), places);
    }
}
