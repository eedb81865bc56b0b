//! One region of a volume: its decoder, and the passage to its newest light.

use std::ops::Range;

use lumencast_codec::{DecodeError, ProbeDecoder, Region};
use lumencast_light::{Order, ProbeVolume};

use crate::newest::Newest;
use crate::passage::Passage;

/// One region of a volume.
#[derive(Clone, Debug)]
pub(crate) struct RegionCache {
    region: Region,
    order: Order,
    decoder: ProbeDecoder,
    passage: Passage,
}

impl RegionCache {
    pub(crate) fn new(region: Region, order: Order) -> Self {
        let decoder = ProbeDecoder::new(region.size, order);
        Self { region, order, decoder, passage: Passage::default() }
    }

    /// See [`Passage::forget_updates`].
    pub(crate) fn forget_updates(&mut self) {
        self.decoder = ProbeDecoder::new(self.region.size, self.order);
        self.passage.forget_updates();
    }

    pub(crate) fn newest(&self) -> Option<&Newest> {
        self.passage.newest()
    }

    /// Takes a frame in; whether it is newer than what was there. `volume` is what is shown.
    pub(crate) fn add(
        &mut self,
        frame: &[u8],
        now: f64,
        tick_seconds: f64,
        volume: &mut ProbeVolume,
    ) -> Result<bool, DecodeError> {
        let light = self.decoder.decode(frame)?;
        let places = places(self.region, volume);
        let (info, shown) = (light.header.info, &mut volume.coefficients[..]);
        Ok(self.passage.take_in(info, light.coefficients, (now, tick_seconds), shown, places))
    }

    /// Brings `volume` to what is to be seen at `now`.
    pub(crate) fn show(&mut self, now: f64, volume: &mut ProbeVolume) {
        let places = places(self.region, volume);
        self.passage.show(now, &mut volume.coefficients, places);
    }
}

/// Where the coefficients of a region's probes lie among the volume's.
fn places(
    region: Region,
    volume: &ProbeVolume,
) -> impl Iterator<Item = Range<usize>> + Clone + use<> {
    let n = volume.order.coefficients();
    region.probes(volume.grid.resolution).map(move |probe| probe * n..(probe + 1) * n)
}
