//! Messages that may come often and must not flood a log.

use std::time::{Duration, Instant};

/// The least time from one message to the next of its kind.
const PAUSE: Duration = Duration::from_secs(10);

/// Counts what happens and tells it every ten seconds at most.
#[derive(Debug, Default)]
pub struct Rarely {
    told: Option<Instant>,
    times: u64,
}

impl Rarely {
    /// Something has happened: how often it has since it was told last, if it is to be told now.
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
