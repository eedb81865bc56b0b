//! How fast frames come.

use std::collections::VecDeque;

/// Seconds that are looked back.
const WINDOW: f64 = 2.0;

/// The frames of the last seconds.
#[derive(Clone, Debug, Default)]
pub(crate) struct Frames {
    /// When each was begun, oldest first.
    begun: VecDeque<f64>,
}

impl Frames {
    /// A frame begins; returns the seconds since the one before.
    pub(crate) fn begin(&mut self, now: f64) -> f64 {
        let since = self.begun.back().map_or(0.0, |last| (now - last).max(0.0));
        self.begun.push_back(now);
        while self.begun.len() > 2 && self.begun.front().is_some_and(|first| now - first > WINDOW) {
            self.begun.pop_front();
        }
        since
    }

    /// Frames a second.
    pub(crate) fn rate(&self) -> Option<f64> {
        let (first, last) = (self.begun.front()?, self.begun.back()?);
        (last > first).then(|| (self.begun.len() - 1) as f64 / (last - first))
    }

    /// The longest time between two, seconds.
    pub(crate) fn longest(&self) -> Option<f64> {
        let pairs = self.begun.iter().zip(self.begun.iter().skip(1));
        pairs.map(|(a, b)| b - a).max_by(f64::total_cmp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_the_last_seconds() {
        let mut frames = Frames::default();
        assert_eq!(frames.begin(5.0), 0.0);
        assert_eq!(frames.rate(), None);
        for i in 1..=200 {
            frames.begin(5.0 + 0.05 * f64::from(i));
        }
        assert!((frames.rate().expect("many") - 20.0).abs() < 0.1);
        assert!((frames.begin(15.25) - 0.25).abs() < 1e-9);
        assert!((frames.longest().expect("many") - 0.25).abs() < 1e-9);
        frames.begin(115.25);
        assert!((frames.rate().expect("two") - 0.01).abs() < 1e-4, "a stall shows");
    }
}
