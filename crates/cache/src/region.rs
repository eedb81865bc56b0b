//! One region: its decoder, and the passage from its last light to its newest.

use glam::Vec3;
use lumencast_codec::{DecodeError, ProbeDecoder, Region};
use lumencast_light::{Order, ProbeVolume};

use crate::newest::Newest;

/// The passage from one update to the next takes at most so long, seconds, however rare they are.
const LONGEST_PASSAGE: f64 = 0.5;

/// One region of a field.
#[derive(Clone, Debug)]
pub(crate) struct RegionCache {
    region: Region,
    order: Order,
    decoder: ProbeDecoder,
    newest: Option<Newest>,
    /// When light came last, of this run of the server or the one before.
    arrived: Option<f64>,
    /// What was shown when the newest light came; empty when nothing had come before.
    from: Vec<Vec3>,
    to: Vec<Vec3>,
    /// Seconds from the last light to the newest.
    passage: f64,
    /// Whether the volume holds `to` already.
    settled: bool,
}

impl RegionCache {
    pub(crate) fn new(region: Region, order: Order) -> Self {
        Self {
            region,
            order,
            decoder: ProbeDecoder::new(region.size, order),
            newest: None,
            arrived: None,
            from: Vec::new(),
            to: Vec::new(),
            passage: 0.0,
            settled: true,
        }
    }

    /// Forgets updates, which another run of the server numbers anew. What is shown stays, and passes
    /// into what comes.
    pub(crate) fn forget_updates(&mut self) {
        self.decoder = ProbeDecoder::new(self.region.size, self.order);
        self.newest = None;
    }

    pub(crate) fn newest(&self) -> Option<&Newest> {
        self.newest.as_ref()
    }

    /// Takes a frame in; whether it is newer than what was there. `volume` is what is shown.
    ///
    /// The passage to it takes as long as it was waited for: when layers are dropped, it adapts with
    /// the first frame. Frames that come in a burst pass over the time in which they were made.
    pub(crate) fn add(
        &mut self,
        frame: &[u8],
        now: f64,
        tick_seconds: f64,
        volume: &mut ProbeVolume,
    ) -> Result<bool, DecodeError> {
        let light = self.decoder.decode(frame)?;
        if self.newest.is_some_and(|n| n.info.update >= light.header.info.update) {
            return Ok(false);
        }
        if let Some(arrived) = self.arrived {
            self.show(now, volume);
            self.from.clear();
            for probe in self.region.probes(volume.grid.resolution) {
                self.from.extend_from_slice(volume.probe(probe));
            }
            let tick = self.newest.map_or(light.header.info.tick, |newest| newest.info.tick);
            let made = light.header.info.tick.saturating_sub(tick) as f64 * tick_seconds;
            self.passage = (now - arrived).max(made).clamp(0.0, LONGEST_PASSAGE);
        }
        self.newest = Some(Newest { info: light.header.info, arrived: now });
        self.arrived = Some(now);
        self.to = light.coefficients;
        self.settled = false;
        Ok(true)
    }

    /// Brings `volume` to what is to be seen at `now`: on the way from the last update to the
    /// newest, which it reaches one passage after that one came, and keeps.
    pub(crate) fn show(&mut self, now: f64, volume: &mut ProbeVolume) {
        let Some(arrived) = self.arrived.filter(|_| !self.settled) else { return };
        let passed = (now - arrived).max(0.0);
        let is_there = self.from.is_empty() || passed >= self.passage;
        let share = if is_there { 1.0 } else { passed / self.passage } as f32;
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
