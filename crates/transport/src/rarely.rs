//! Limits messages that may come often, so that they do not flood a log.

use std::time::{Duration, Instant};

/// Least time between two messages of a kind.
const PAUSE: Duration = Duration::from_secs(10);

/// Counts events and reports them at most every ten seconds.
#[derive(Debug, Default)]
pub struct Rarely {
    told: Option<Instant>,
    times: u64,
}

impl Rarely {
    /// Counts an event. Returns the number of events since the last report if a report is due, else
    /// `None`.
    pub fn now(&mut self) -> Option<u64> {
        self.times += 1;
        if self.told.is_some_and(|told| told.elapsed() < PAUSE) {
            return None;
        }
        self.told = Some(Instant::now());
        Some(std::mem::take(&mut self.times))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_is_told_and_the_others_are_counted() {
        let mut rarely = Rarely::default();
        assert_eq!([rarely.now(), rarely.now(), rarely.now()], [Some(1), None, None]);
        rarely.told = Instant::now().checked_sub(PAUSE);
        assert_eq!(rarely.now(), Some(3));
    }
}
