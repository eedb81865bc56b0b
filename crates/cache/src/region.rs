//! One region: its decoder, and the passage from its last light to its newest.

use glam::Vec3;
use lumencast_codec::{DecodeError, ProbeDecoder, ProbeHeader, Region};
use lumencast_light::{Order, ProbeVolume};

/// Share of a new interval in the measured one.
const INTERVAL_SHARE: f64 = 0.2;
/// The passage from one update to the next takes at most so long, seconds, however rare they are.
const LONGEST_PASSAGE: f64 = 0.5;

/// One region of a field.
#[derive(Clone, Debug)]
pub(crate) struct RegionCache {
    region: Region,
    decoder: ProbeDecoder,
    newest: Option<Newest>,
    /// What was shown when the newest light came; empty when nothing had come before.
    from: Vec<Vec3>,
    to: Vec<Vec3>,
    /// Measured seconds between updates.
    interval: Option<f64>,
    /// Whether the volume holds `to` already.
    settled: bool,
}

/// The newest update of a region.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Newest {
    pub(crate) header: ProbeHeader,
    /// When it came.
    pub(crate) arrived: f64,
}

impl RegionCache {
    pub(crate) fn new(region: Region, order: Order) -> Self {
        Self {
            region,
            decoder: ProbeDecoder::new(region.size, order),
            newest: None,
            from: Vec::new(),
            to: Vec::new(),
            interval: None,
            settled: true,
        }
    }

    pub(crate) fn newest(&self) -> Option<&Newest> {
        self.newest.as_ref()
    }

    /// Takes a frame in; whether it is newer than what was there. `volume` is what is shown.
    pub(crate) fn add(
        &mut self,
        frame: &[u8],
        now: f64,
        volume: &mut ProbeVolume,
    ) -> Result<bool, DecodeError> {
        let light = self.decoder.decode(frame)?;
        if self.newest.is_some_and(|n| n.header.info.update >= light.header.info.update) {
            return Ok(false);
        }
        if let Some(newest) = self.newest {
            self.show(now, volume);
            self.from.clear();
            for probe in self.region.probes(volume.grid.resolution) {
                self.from.extend_from_slice(volume.probe(probe));
            }
            let passed = (now - newest.arrived).max(0.0);
            let measured = self.interval.unwrap_or(passed);
            self.interval = Some(measured + INTERVAL_SHARE * (passed - measured));
        }
        self.newest = Some(Newest { header: light.header, arrived: now });
        self.to = light.coefficients;
        self.settled = false;
        Ok(true)
    }

    /// Brings `volume` to what is to be seen at `now`: on the way from the last update to the
    /// newest, which it reaches one measured interval after that one came, and keeps.
    pub(crate) fn show(&mut self, now: f64, volume: &mut ProbeVolume) {
        let Some(newest) = self.newest else { return };
        if self.settled {
            return;
        }
        let passage = self.interval.unwrap_or(0.0).min(LONGEST_PASSAGE);
        let passed = (now - newest.arrived).max(0.0);
        let share =
            if self.from.is_empty() || passed >= passage { 1.0 } else { passed / passage } as f32;
        let n = volume.order.coefficients();
        for (i, probe) in self.region.probes(volume.grid.resolution).enumerate() {
            let (own, range) = (volume.probe_mut(probe), i * n..(i + 1) * n);
            let to = &self.to[range.clone()];
            if share < 1.0 {
                let both = self.from[range].iter().zip(to);
                own.iter_mut().zip(both).for_each(|(own, (a, b))| *own = a.lerp(*b, share));
            } else {
                own.copy_from_slice(to);
            }
        }
        self.settled = share >= 1.0;
    }
}
