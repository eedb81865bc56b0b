//! What comes in, counted.

use std::collections::VecDeque;

/// Seconds over which rates are averaged.
const WINDOW: f64 = 2.0;

/// How a session goes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Ticks of the server a second, as its state arrives.
    pub ticks: f64,
    /// Light frames a second, of all regions.
    pub frames: f64,
    /// Bytes a second, of all tracks.
    pub bytes: f64,
    /// Bytes of all frames so far.
    pub received: u64,
    /// Milliseconds that the server's last tick took.
    pub tick_ms: Option<f64>,
    /// Samples a probe that it took.
    pub samples: Option<f64>,
    /// Frames that could not be read.
    pub dropped: u64,
}

/// An amount a second, over the last seconds.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rate {
    /// When, and how much.
    added: VecDeque<(f64, f64)>,
    sum: f64,
}

impl Rate {
    pub(crate) fn add(&mut self, amount: f64, now: f64) {
        self.added.push_back((now, amount));
        self.sum += amount;
        self.forget(now);
    }

    pub(crate) fn at(&mut self, now: f64) -> f64 {
        self.forget(now);
        self.sum / WINDOW
    }

    fn forget(&mut self, now: f64) {
        while let Some((when, amount)) = self.added.front()
            && now - when > WINDOW
        {
            self.sum -= amount;
            self.added.pop_front();
        }
        if self.added.is_empty() {
            // Nothing is left of what rounding has added up.
            self.sum = 0.0;
        }
    }
}

/// The counters of a session.
#[derive(Clone, Debug, Default)]
pub(crate) struct Meter {
    pub(crate) ticks: Rate,
    pub(crate) frames: Rate,
    pub(crate) bytes: Rate,
    pub(crate) received: u64,
    pub(crate) dropped: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_of_the_last_seconds() {
        let mut rate = Rate::default();
        for i in 0..100 {
            rate.add(3.0, f64::from(i) * 0.1);
        }
        assert!((rate.at(9.9) - 30.0).abs() < 2.0, "{}", rate.at(9.9));
        assert_eq!(rate.at(20.0), 0.0);
    }
}
