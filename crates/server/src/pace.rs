//! Keeping time: when the next tick is due, and how many samples fit into it.

use std::ops::RangeInclusive;

/// The beat of a fixed rate that is never made up for: a tick that ends after the next one was due
/// is followed at once, and the beat goes on from there.
#[derive(Clone, Copy, Debug)]
pub struct Beat {
    period: f64,
    due: f64,
}

impl Beat {
    /// A beat of `period` seconds whose first tick is due at `now`.
    pub fn new(period: f64, now: f64) -> Self {
        Self { period, due: now }
    }

    /// Marks the start of a tick at `now` and sets when the following one is due: a period after
    /// this one was due, so that small delays do not add up, or, when this one began more than half
    /// a period late, a period from now.
    pub fn start(&mut self, now: f64) {
        let kept = if now - self.due < 0.5 * self.period { self.due } else { now };
        self.due = kept + self.period;
    }

    /// Seconds from `now` until the next tick is due; 0 when it is overdue.
    pub fn wait(&self, now: f64) -> f64 {
        (self.due - now).max(0.0)
    }
}

/// How many samples a probe takes in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleRange {
    /// At least this many, however long the tick takes; ≥ 1.
    pub min: u32,
    /// At most this many, however much time is left.
    pub max: u32,
}

impl SampleRange {
    /// Always the same number.
    pub fn fixed(samples: u32) -> Self {
        Self { min: samples, max: samples }
    }
}

impl Default for SampleRange {
    fn default() -> Self {
        Self { min: 4, max: 256 }
    }
}

/// Chooses the samples of the next tick from what the last ones took, so that a tick fills a share of
/// its period. It falls at once and rises slowly: a late tick is seen, an
/// unused millisecond is not.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    period: f64,
    /// Share of the period that a tick aims to fill. The rest takes up the jitter of the machine.
    share: f64,
    range: SampleRange,
    samples: u32,
    /// Seconds of gathering for one sample of every probe, smoothed.
    cost: Option<f64>,
}

impl Budget {
    /// The share of ticks that have the machine for themselves.
    pub const SHARE: f64 = 0.85;
    /// The same where lumels are gathered at beside them.
    pub const SHARE_BESIDE_LUMELS: f64 = 0.4;
    /// Largest growth of the number of samples from one tick to the next.
    const RISE: f64 = 1.25;
    /// Smallest cut after a late tick.
    const CUT: f64 = 0.8;
    /// Weight of a new, lower measurement of the cost; higher ones count at once.
    const SMOOTHING: f64 = 0.2;

    /// Begins with the fewest samples.
    pub fn new(period: f64, range: SampleRange) -> Self {
        let range = SampleRange { min: range.min.max(1), max: range.max.max(range.min).max(1) };
        Self { period, share: Self::SHARE, range, samples: range.min, cost: None }
    }

    /// The same for ticks that aim to fill another share of their period.
    #[must_use]
    pub fn filling(self, share: f64) -> Self {
        Self { share, ..self }
    }

    /// Samples a probe for the next tick.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Takes note of a tick whose jobs were not done in time, which counts as late: there will be fewer
    /// samples, and what they cost stays unknown.
    pub fn overrun(&mut self) -> bool {
        let samples = (f64::from(self.samples) * Self::CUT) as u32;
        self.samples = samples.clamp(self.range.min, self.range.max);
        true
    }

    /// Goes back to the fewest samples, while nobody watches.
    pub fn rest(&mut self) {
        self.samples = self.range.min;
    }

    /// Takes note of a tick: `gather` seconds spent on tracing [`Budget::samples`] samples a probe,
    /// out of `total` seconds. Returns whether the tick was late.
    pub fn record(&mut self, gather: f64, total: f64) -> bool {
        let late = total > self.period;
        let measured = gather / f64::from(self.samples);
        let cost = match self.cost {
            Some(cost) if measured < cost => cost + (measured - cost) * Self::SMOOTHING,
            _ => measured,
        };
        self.cost = Some(cost);

        let room = self.share * self.period - (total - gather).max(0.0);
        let fitting = (room / cost.max(1e-9)).max(0.0);
        let samples = f64::from(self.samples);
        let mut next = fitting.min(samples * Self::RISE + 1.0);
        if late {
            next = next.min(samples * Self::CUT);
        }
        // `as` saturates, and NaN becomes 0: both are then brought into the range.
        self.samples = (next as u32).clamp(self.range.min, self.range.max);
        late
    }
}

/// Chooses how many samples lumels take in a tick, and how many blocks of them are solved. They fill what
/// the rest of it leaves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LumelPace {
    period: f64,
    samples: u64,
    is_fixed: bool,
    /// Samples of this tick's jobs, and the seconds that they took.
    taken: (u64, f64),
}

impl LumelPace {
    /// Share of the period that a tick with lumels aims to fill.
    const SHARE: f64 = 0.8;
    /// Share of the period that lumels have, however long the rest takes.
    const LEAST_SHARE: f64 = 0.3;
    /// Samples of the first tick, and of any at least: few, for machines that are slow.
    const LEAST: u64 = 1024;
    /// Largest growth from one tick to the next.
    const RISE: f64 = 1.5;
    /// Solving a block takes about as long as so many samples.
    const SAMPLES_A_BLOCK: u64 = 700;
    /// Blocks that are solved in a tick, at most.
    const BLOCKS: RangeInclusive<u64> = 2..=24;

    /// Begins with few samples; or always takes so many.
    pub(crate) fn new(period: f64, fixed: Option<u64>) -> Self {
        let samples = fixed.unwrap_or(Self::LEAST);
        Self { period, samples, is_fixed: fixed.is_some(), taken: (0, 0.0) }
    }

    /// Samples of the next tick.
    pub(crate) fn samples(&self) -> u64 {
        self.samples
    }

    /// Blocks to be solved in this tick, at most: as long as sampling takes.
    pub(crate) fn blocks(&self) -> usize {
        let blocks = self.samples / Self::SAMPLES_A_BLOCK;
        blocks.clamp(*Self::BLOCKS.start(), *Self::BLOCKS.end()) as usize
    }

    /// Takes note of a job of so many samples that took so many seconds.
    pub(crate) fn record(&mut self, samples: u64, seconds: f64) {
        self.taken.0 += samples;
        self.taken.1 += seconds;
    }

    /// Takes note of a tick that took so many seconds, with its jobs.
    pub(crate) fn finish(&mut self, total: f64) {
        let (samples, seconds) = std::mem::take(&mut self.taken);
        if self.is_fixed || samples == 0 {
            return;
        }
        let rest = (total - seconds).max(0.0);
        let room = (Self::SHARE * self.period - rest).max(Self::LEAST_SHARE * self.period);
        let fitting = samples as f64 * room / seconds.max(1e-9);
        let most = self.samples as f64 * Self::RISE;
        self.samples = (fitting.min(most) as u64).max(Self::LEAST);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 0.04;

    /// Runs `ticks` ticks on a machine that needs `cost` seconds a sample and `other` besides.
    fn run(budget: &mut Budget, ticks: usize, cost: f64, other: f64) -> usize {
        (0..ticks)
            .filter(|_| {
                let gather = cost * f64::from(budget.samples());
                budget.record(gather, gather + other)
            })
            .count()
    }

    #[test]
    fn fills_its_share_of_the_period() {
        let mut budget = Budget::new(PERIOD, SampleRange { min: 1, max: 1000 });
        assert_eq!(run(&mut budget, 60, 0.001, 0.004), 0, "never late on the way up");
        assert_eq!(budget.samples(), 30, "(0.85 · 40 − 4) ms at 1 ms a sample");
    }

    #[test]
    fn late_tick_takes_fewer_samples_next_time() {
        let mut budget = Budget::new(PERIOD, SampleRange { min: 1, max: 1000 });
        run(&mut budget, 60, 0.001, 0.004);
        let before = budget.samples();
        assert_eq!(run(&mut budget, 1, 0.002, 0.004), 1, "twice as slow is late");
        assert!(f64::from(budget.samples()) <= 0.8 * f64::from(before));
        assert_eq!(run(&mut budget, 20, 0.002, 0.004), 0, "and then it fits");
        // Late for another reason than gathering: still fewer.
        let before = budget.samples();
        assert!(budget.record(0.001, 0.06));
        assert!(budget.samples() < before);
    }

    #[test]
    fn stays_within_its_range() {
        let mut budget = Budget::new(PERIOD, SampleRange { min: 8, max: 16 });
        run(&mut budget, 50, 1e-6, 0.0);
        assert_eq!(budget.samples(), 16);
        run(&mut budget, 50, 1.0, 1.0);
        assert_eq!(budget.samples(), 8);
        let mut fixed = Budget::new(PERIOD, SampleRange::fixed(16));
        run(&mut fixed, 10, 1.0, 0.0);
        assert_eq!(fixed.samples(), 16);
        assert!(!Budget::new(PERIOD, SampleRange { min: 0, max: 0 }).record(0.0, 0.0));
    }

    #[test]
    fn rises_slowly() {
        let mut budget = Budget::new(PERIOD, SampleRange { min: 4, max: 1000 });
        let before = budget.samples();
        run(&mut budget, 1, 1e-5, 0.0);
        assert!(budget.samples() <= before + before / 4 + 1);
    }

    #[test]
    fn lumels_fill_what_the_rest_leaves() {
        let after = |rest: f64| {
            let mut pace = LumelPace::new(PERIOD, None);
            for _ in 0..30 {
                let (samples, seconds) = (pace.samples(), pace.samples() as f64 * 1e-6);
                pace.record(samples, seconds);
                pace.finish(seconds + rest);
            }
            pace
        };
        for (rest, share) in [(0.0, LumelPace::SHARE), (0.01, 0.55), (1.0, LumelPace::LEAST_SHARE)]
        {
            let (samples, expected) = (after(rest).samples(), (share * PERIOD * 1e6) as u64);
            assert!(samples.abs_diff(expected) < expected / 100, "{rest}: {samples}");
        }
        let mut pace = after(0.0);
        let samples = pace.samples();
        pace.finish(0.01);
        assert_eq!(pace.samples(), samples, "no job has ended");
        pace.record(samples, 1.0);
        pace.finish(1.0);
        assert_eq!(pace.samples(), LumelPace::LEAST, "it falls at once");
        let mut fixed = LumelPace::new(PERIOD, Some(77));
        fixed.record(77, 1.0);
        fixed.finish(1.0);
        assert_eq!((fixed.samples(), fixed.blocks()), (77, 2));
        assert_eq!(LumelPace::new(PERIOD, Some(7000)).blocks(), 10);
        assert_eq!(LumelPace::new(PERIOD, Some(1 << 40)).blocks(), 24);
    }

    #[test]
    fn beat_is_kept_and_never_made_up_for() {
        let mut beat = Beat::new(PERIOD, 0.0);
        assert_eq!(beat.wait(0.0), 0.0);
        beat.start(0.0);
        assert!((beat.wait(0.01) - 0.03).abs() < 1e-12);
        // Woken 1 ms late: the beat stays at 80 ms.
        beat.start(0.041);
        assert!((beat.wait(0.041) - 0.039).abs() < 1e-12);
        // A tick of 150 ms: the next one follows at once, then one a period, no burst.
        assert_eq!(beat.wait(0.191), 0.0);
        beat.start(0.191);
        assert!((beat.wait(0.191) - PERIOD).abs() < 1e-12);
    }
}
