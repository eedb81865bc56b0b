//! The server's clock as a client sees it.

use std::collections::VecDeque;

/// Seconds over which the least delay is sought: long enough to meet a quick frame, short enough to
/// follow clocks that drift (100 ppm make 2 ms in 20 s).
const WINDOW: f64 = 20.0;
/// One minimum is kept for each so many seconds.
const BUCKET: f64 = 1.0;
/// Ticks whose clock is remembered: 20 s at 25 Hz.
const TICKS: usize = 512;

/// Estimates the server's clock from the clocks that its frames carry.
///
/// Each frame says when it was sent; it arrives later by an unknown delay. The least of
/// (arrival − sending) over a while is the offset between the clocks plus the least delay, so the
/// estimate lags the server's true clock by that delay, which is what a client wants: it never
/// expects what cannot have come.
#[derive(Clone, Debug, Default)]
pub(crate) struct ServerClock {
    /// (second of arrival, least arrival − sending in it), oldest first.
    offsets: VecDeque<(f64, f64)>,
    /// (tick, clock), oldest first.
    ticks: VecDeque<(u64, f64)>,
}

impl ServerClock {
    /// A frame of `tick`, sent at `clock`, arrived `now`.
    pub(crate) fn sample(&mut self, tick: u64, clock: f64, now: f64) {
        if !(clock.is_finite() && now.is_finite()) {
            return;
        }
        let second = (now / BUCKET).floor();
        let offset = now - clock;
        match self.offsets.back_mut() {
            Some((last, least)) if *last >= second => *least = least.min(offset),
            _ => self.offsets.push_back((second, offset)),
        }
        while self.offsets.front().is_some_and(|(first, _)| (second - first) * BUCKET > WINDOW) {
            self.offsets.pop_front();
        }
        if self.ticks.back().is_none_or(|(last, _)| *last < tick) {
            self.ticks.push_back((tick, clock));
            if self.ticks.len() > TICKS {
                self.ticks.pop_front();
            }
        }
    }

    /// The server's clock at `now`, seconds.
    pub(crate) fn at(&self, now: f64) -> Option<f64> {
        let least = self.offsets.iter().map(|(_, offset)| *offset).reduce(f64::min)?;
        Some(now - least)
    }

    /// The server's clock when it finished `tick`, seconds; between known ticks by interpolation,
    /// beyond them by ticks of `tick_seconds`.
    pub(crate) fn of_tick(&self, tick: u64, tick_seconds: f64) -> Option<f64> {
        let after = self.ticks.partition_point(|(known, _)| *known < tick);
        match (after.checked_sub(1).map(|i| self.ticks[i]), self.ticks.get(after)) {
            (_, Some((known, clock))) if *known == tick => Some(*clock),
            (Some((t0, c0)), Some((t1, c1))) => {
                Some(c0 + (c1 - c0) * (tick - t0) as f64 / (t1 - t0) as f64)
            }
            (Some((t0, c0)), None) => Some(c0 + (tick - t0) as f64 * tick_seconds),
            (None, Some((t1, c1))) => Some(c1 - (t1 - tick) as f64 * tick_seconds),
            (None, None) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_delay_counts_and_old_ones_are_forgotten() {
        let mut clock = ServerClock::default();
        assert_eq!(clock.at(5.0), None);
        for (i, delay) in [0.08, 0.02, 0.3, 0.05].into_iter().enumerate() {
            let sent = 100.0 + i as f64;
            clock.sample(i as u64, sent, sent - 60.0 + delay);
        }
        assert!((clock.at(50.0).unwrap() - (110.0 - 0.02)).abs() < 1e-9);
        // The way becomes longer for good: after the window the estimate follows.
        for i in 4..60 {
            let sent = 100.0 + f64::from(i);
            clock.sample(i as u64, sent, sent - 60.0 + 0.5);
        }
        assert!((clock.at(100.0).unwrap() - (160.0 - 0.5)).abs() < 1e-9);
        assert!(clock.offsets.len() <= 22);
    }

    #[test]
    fn ticks_have_clocks_also_between_and_beyond() {
        let mut clock = ServerClock::default();
        clock.sample(10, 1.0, 0.0);
        clock.sample(14, 2.0, 0.0);
        for (tick, expected) in [(10, 1.0), (12, 1.5), (14, 2.0), (15, 2.04), (9, 0.96)] {
            assert!((clock.of_tick(tick, 0.04).unwrap() - expected).abs() < 1e-9, "{tick}");
        }
        for tick in 15..5000 {
            clock.sample(tick, tick as f64, 0.0);
        }
        assert_eq!(clock.ticks.len(), TICKS);
    }
}
