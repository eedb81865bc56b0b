//! The passage of a region's light from what was shown to its newest.

use std::ops::Range;

use glam::Vec3;
use lumencast_codec::UpdateInfo;

use crate::newest::Newest;

/// The passage from one update to the next takes at most so long, seconds, however rare they are.
const LONGEST: f64 = 0.5;

/// The passage of a region's values, whatever they are, from what was shown to the newest.
///
/// `places` says in each call where the region's values lie among those that are shown, in their order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Passage {
    newest: Option<Newest>,
    /// When light came last, of this run of the server or the one before.
    arrived: Option<f64>,
    /// What was shown when the newest light came; empty when nothing had come before.
    from: Vec<Vec3>,
    /// The newest light; empty once it is shown.
    to: Vec<Vec3>,
    /// Seconds from the last light to the newest.
    seconds: f64,
}

impl Passage {
    /// Forgets updates, which another run of the server numbers anew. What is shown stays, and passes
    /// into what comes.
    pub(crate) fn forget_updates(&mut self) {
        self.newest = None;
    }

    pub(crate) fn newest(&self) -> Option<&Newest> {
        self.newest.as_ref()
    }

    /// Takes light in; whether it is newer than what was there.
    ///
    /// The passage to it takes as long as it was waited for: when layers are dropped, it adapts with
    /// the first frame. Frames that come in a burst pass over the time in which they were made.
    pub(crate) fn take_in(
        &mut self,
        info: UpdateInfo,
        light: Vec<Vec3>,
        (now, tick_seconds): (f64, f64),
        shown: &mut [Vec3],
        places: impl Iterator<Item = Range<usize>> + Clone,
    ) -> bool {
        if self.newest.is_some_and(|newest| newest.info.update >= info.update) {
            return false;
        }
        if let Some(arrived) = self.arrived {
            self.show(now, shown, places.clone());
            self.from.clear();
            places.for_each(|place| self.from.extend_from_slice(&shown[place]));
            let tick = self.newest.map_or(info.tick, |newest| newest.info.tick);
            let made = info.tick.saturating_sub(tick) as f64 * tick_seconds;
            self.seconds = (now - arrived).max(made).clamp(0.0, LONGEST);
        }
        self.newest = Some(Newest { info, arrived: now });
        self.arrived = Some(now);
        self.to = light;
        true
    }

    /// Brings `shown` to what is to be seen at `now`: on the way from the last update to the newest,
    /// which it reaches one passage after that one came, and keeps.
    pub(crate) fn show(
        &mut self,
        now: f64,
        shown: &mut [Vec3],
        places: impl Iterator<Item = Range<usize>>,
    ) {
        let Some(arrived) = self.arrived.filter(|_| !self.to.is_empty()) else { return };
        let passed = (now - arrived).max(0.0);
        let is_there = self.from.is_empty() || passed >= self.seconds;
        let share = if is_there { 1.0 } else { passed / self.seconds } as f32;
        let mut first = 0;
        for place in places {
            let range = first..first + place.len();
            first = range.end;
            let (own, to) = (&mut shown[place], &self.to[range.clone()]);
            if share < 1.0 {
                let both = self.from[range].iter().zip(to);
                own.iter_mut().zip(both).for_each(|(own, (a, b))| *own = a.lerp(*b, share));
            } else {
                own.copy_from_slice(to);
            }
        }
        if share >= 1.0 {
            (self.from, self.to) = (Vec::new(), Vec::new());
        }
    }
}
