//! Blending over time: many small, noisy updates become a steady estimate that still follows the
//! light.
//!
//! **Averaging.** An update of n samples moves an estimate that rests on N samples by
//! n/(N + n), until that falls to the ratio r, where it stays. So the first updates average
//! exactly, later ones exponentially; the noise that is left is √(r/2) of an update's.
//!
//! **Following.** At r = 0.01 alone, 95 % of a change needs 300 updates. So every receiver keeps a
//! *ladder* of means of the same updates, with weights no smaller than ½, ⅛, 1/32 and r; the last is
//! the estimate. After each update, going from the quick to the slow: where a mean differs from the
//! next quicker one by more than chance explains, it is replaced by that one. "More than chance" is
//! κ standard deviations ([`BlendSettings::significance`]) in the luminance of any of the first
//! four coefficients. What chance explains follows from q, the variance of a mean for unit variance
//! a sample (q' = (1 − w)²q + w²/n), and from the variance a sample, of which there are two
//! estimates; the larger counts.
//!
//! - The *noise*: minus the product of successive differences of updates, averaged. A rare bright
//!   path gives two large differences of opposite sign and so counts as noise; a change of light
//!   gives a single one, and does not.
//! - The *scatter* of the updates around the quick mean itself. A single outlier moves a mean by no
//!   more than about one of its own standard deviations, however bright it is; a change that stays
//!   stands out after three updates.
//!
//! Where the caller knows that light may have changed ([`History::expect_change`]: an edit), two
//! standard deviations are enough for a while.
//!
//! A lamp that jumps is thus answered within a few updates, a slow drift within as many as its
//! significance needs, and while nothing changes the ladder leaves the estimate alone, also where
//! light comes by rare paths only. Measured by `examples/reaction.rs` and `examples/still.rs`. A
//! change of colour alone, at equal luminance, is followed at the ratio.
//!
//! Memory: 4 means a receiver, 12 bytes a coefficient and 24 more each (528 bytes at L2). All in f32.

use glam::Vec3;

use lumencast_gather::SumsAt;
use lumencast_light::luminance;

/// The least weights of the quick means.
const QUICK: [f32; 3] = [0.5, 0.125, 1.0 / 32.0];
/// Least weight of the estimate of the noise: it has to remember rare paths.
const NOISE: f32 = 1.0 / 128.0;
/// Share of a mean's own scatter that counts as chance. Of a change that has just begun, most of the
/// scatter is the change itself.
const SCATTER: f32 = 0.64;
/// Standard deviations that are enough while a change is expected, and for how many updates it is.
const EXPECTED: f32 = 2.0;
const EXPECTING: u32 = 12;
/// Coefficients that are watched, where there are so many: bands 0 and 1.
const WATCHED: usize = 4;

/// How updates are blended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlendSettings {
    /// Least weight of an update, above 0 to 1; 1 shows each update alone.
    pub ratio: f32,
    /// Standard deviations by which a change must stand out to be followed at once; infinite to
    /// follow by the ratio alone.
    pub significance: f32,
}

impl Default for BlendSettings {
    fn default() -> Self {
        Self { ratio: 0.01, significance: 3.5 }
    }
}

/// The blended light of a set of receivers.
#[derive(Clone, Debug)]
pub struct History {
    settings: BlendSettings,
    receivers: Vec<Ladder>,
    /// Updates for which a change is still expected.
    expecting: u32,
}

impl History {
    /// Nothing known yet about `receivers` receivers of so many sums each: an order's coefficients
    /// for probes, one for lumels.
    pub fn new(settings: BlendSettings, receivers: usize, sums: usize) -> Self {
        let ladder = Ladder::new(settings.ratio.clamp(f32::MIN_POSITIVE, 1.0), sums);
        Self { settings, receivers: vec![ladder; receivers], expecting: 0 }
    }

    /// Number of receivers.
    pub fn len(&self) -> usize {
        self.receivers.len()
    }

    /// Whether there are no receivers.
    pub fn is_empty(&self) -> bool {
        self.receivers.is_empty()
    }

    /// Forgets all that is known of one receiver.
    pub fn forget(&mut self, receiver: usize) {
        let ladder = &mut self.receivers[receiver];
        *ladder = Ladder::new(ladder.ratio, ladder.coefficients());
    }

    /// Takes an update, one entry a receiver in order. Entries without samples, or with numbers that
    /// are not finite, change nothing.
    pub fn update<'a>(&mut self, sums: impl IntoIterator<Item = SumsAt<'a>>) {
        self.update_at((0..self.len()).zip(sums));
    }

    /// Takes an update of the receivers with these numbers.
    pub fn update_at<'a>(&mut self, entries: impl IntoIterator<Item = (usize, SumsAt<'a>)>) {
        let mut significance = self.settings.significance;
        if self.expecting > 0 && significance.is_finite() {
            significance = significance.min(EXPECTED);
        }
        self.expecting = self.expecting.saturating_sub(1);
        for (receiver, sums) in entries {
            let ladder = &mut self.receivers[receiver];
            if let Some(update) = Update::new(&sums, ladder.coefficients()) {
                ladder.update(&update, significance);
            }
        }
    }

    /// Light may be another from the next update on: something was moved, switched, changed. Makes
    /// the next updates follow it sooner, at the price of a little noise where it is the same.
    pub fn expect_change(&mut self) {
        self.expecting = EXPECTING;
    }

    /// The estimate: coefficients of arriving radiance, cd/m²; zero before the first update.
    pub fn coefficients(&self, receiver: usize) -> &[Vec3] {
        &self.receivers[receiver].estimate().coefficients
    }

    /// On how many samples the estimate's noise rests.
    pub fn effective_samples(&self, receiver: usize) -> f32 {
        let q = self.receivers[receiver].estimate().q;
        if q > 0.0 { 1.0 / q } else { 0.0 }
    }
}

/// One update of one receiver.
struct Update {
    mean: Vec<Vec3>,
    samples: f32,
    /// Variance a sample of the watched luminances, were samples independent.
    variance: [f32; WATCHED],
}

impl Update {
    fn new(sums: &SumsAt<'_>, coefficients: usize) -> Option<Self> {
        let usable =
            sums.count > 0 && sums.sum.len() == coefficients && sums.squares.len() == coefficients;
        let samples = sums.count as f32;
        let mean: Vec<Vec3> = sums.mean().collect();
        if !usable || !mean.iter().all(|m| m.is_finite()) {
            return None;
        }
        let variance = std::array::from_fn(|k| {
            let Some(mean) = mean.get(k) else { return 0.0 };
            (sums.squares[k] / samples - luminance(*mean).powi(2)).max(0.0)
        });
        Some(Self { mean, samples, variance })
    }

    fn watched(&self) -> [f32; WATCHED] {
        watched(&self.mean)
    }
}

fn watched(coefficients: &[Vec3]) -> [f32; WATCHED] {
    std::array::from_fn(|k| coefficients.get(k).map_or(0.0, |c| luminance(*c)))
}

/// The means of one receiver, the quickest first, the estimate last.
#[derive(Clone, Debug)]
struct Ladder {
    means: [Mean; QUICK.len() + 1],
    ratio: f32,
    noise: Noise,
}

impl Ladder {
    fn new(ratio: f32, coefficients: usize) -> Self {
        let coefficients = vec![Vec3::ZERO; coefficients];
        let mean = Mean { coefficients, samples: 0.0, q: 0.0, scatter: [0.0; WATCHED] };
        Self { means: std::array::from_fn(|_| mean.clone()), ratio, noise: Noise::default() }
    }

    fn coefficients(&self) -> usize {
        self.estimate().coefficients.len()
    }

    fn estimate(&self) -> &Mean {
        &self.means[QUICK.len()]
    }

    fn update(&mut self, update: &Update, significance: f32) {
        for (mean, least) in self.means.iter_mut().zip(QUICK.into_iter().chain([self.ratio])) {
            mean.update(update, least.max(self.ratio));
        }
        for slow in 1..self.means.len() {
            let (quick, rest) = self.means.split_at_mut(slow);
            let quick = &quick[slow - 1];
            if quick.differs(&rest[0], &self.noise, significance) {
                rest[0].clone_from(quick);
            }
        }
        self.noise.update(update);
    }
}

/// A weighted mean of updates.
#[derive(Clone, Debug)]
struct Mean {
    coefficients: Vec<Vec3>,
    /// N: on how many samples it counts as resting when the next update is weighed.
    samples: f32,
    /// Its variance for unit variance a sample.
    q: f32,
    /// Variance a sample, as the updates that it is a mean of scatter around it.
    scatter: [f32; WATCHED],
}

impl Mean {
    fn update(&mut self, update: &Update, least: f32) {
        let n = update.samples;
        let w = (n / (self.samples + n)).max(least);
        let (new, old) = (update.watched(), watched(&self.coefficients));
        for k in 0..WATCHED {
            self.scatter[k] = (1.0 - w) * (self.scatter[k] + w * n * (new[k] - old[k]).powi(2));
        }
        for (mean, new) in self.coefficients.iter_mut().zip(&update.mean) {
            *mean += w * (new - *mean);
        }
        self.q = (1.0 - w).powi(2) * self.q + w * w / n;
        self.samples = n / w;
    }

    /// Whether another mean of the same updates lies further away than chance explains.
    fn differs(&self, other: &Self, noise: &Noise, significance: f32) -> bool {
        let q = self.q + other.q;
        let [a, b] = [watched(&self.coefficients), watched(&other.coefficients)];
        (0..WATCHED).any(|k| {
            let difference = a[k] - b[k];
            let variance = noise.variance[k].max(SCATTER * self.scatter[k]);
            difference * difference > significance * significance * variance * q
        })
    }
}

/// What is known of the variance a sample, from how updates follow one another.
#[derive(Clone, Debug, Default)]
struct Noise {
    variance: [f32; WATCHED],
    /// The mean of what was seen; by chance it may be negative.
    mean: [f32; WATCHED],
    previous: Option<Previous>,
    updates: f32,
}

#[derive(Clone, Copy, Debug)]
struct Previous {
    update: [f32; WATCHED],
    /// How it differed from the one before it.
    step: Option<[f32; WATCHED]>,
}

impl Noise {
    fn update(&mut self, update: &Update) {
        /// The variance within the first update counts as so many updates.
        const PRIOR: f32 = 4.0;
        /// Least variance, as a share of that within an update.
        const LEAST: f32 = 1e-6;
        let new = update.watched();
        let Some(previous) = self.previous else {
            (self.variance, self.mean) = (update.variance, update.variance);
            self.updates = PRIOR;
            self.previous = Some(Previous { update: new, step: None });
            return;
        };
        let step: [f32; WATCHED] = std::array::from_fn(|k| new[k] - previous.update[k]);
        if let Some(last) = previous.step {
            let w = (1.0 / (self.updates + 1.0)).max(NOISE);
            for k in 0..WATCHED {
                let seen = -last[k] * step[k] * update.samples;
                self.mean[k] += w * (seen - self.mean[k]);
                self.variance[k] = self.mean[k].max(LEAST * update.variance[k]);
            }
            self.updates += 1.0;
        }
        self.previous = Some(Previous { update: new, step: Some(step) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{mix, unit};

    /// Noise of standard deviation 1, about normal.
    fn normal(seed: u64) -> f32 {
        (0..12).map(|k| unit(mix(seed * 12 + k) as u32)).sum::<f32>() - 6.0
    }

    const COUNT: u32 = 16;

    /// The sums of one receiver.
    #[derive(Clone, Default)]
    struct Owned {
        sum: Vec<Vec3>,
        squares: Vec<f32>,
        count: u32,
    }

    impl Owned {
        fn at(&self) -> SumsAt<'_> {
            let Self { sum, squares, count } = self;
            SumsAt { sum, squares, count: *count, ..SumsAt::default() }
        }
    }

    /// An update whose mean has c₀ = `level` with a standard deviation of `noise`.
    fn sums(level: f32, noise: f32, seed: u64) -> Owned {
        let n = COUNT as f32;
        let value =
            |k: u64| Vec3::splat((if k == 0 { level } else { 0.0 }) + noise * normal(seed * 9 + k));
        let sum: Vec<Vec3> = (0..9).map(|k| n * value(k)).collect();
        let squares = sum.iter().map(|s| s.y * s.y / n + n * n * noise * noise).collect();
        Owned { sum, squares, count: COUNT }
    }

    fn blend(settings: BlendSettings, updates: impl IntoIterator<Item = Owned>) -> Vec<f32> {
        let mut history = History::new(settings, 1, 9);
        updates
            .into_iter()
            .map(|s| {
                history.update([s.at()]);
                history.coefficients(0)[0].x
            })
            .collect()
    }

    #[test]
    fn single_sums_are_blended_too() {
        let mut history = History::new(BlendSettings::default(), 2, 1);
        let one = |value: f32| Owned {
            sum: vec![Vec3::splat(value * 4.0)],
            squares: vec![value * value * 4.0],
            count: 4,
        };
        for value in [1.0, 3.0] {
            history.update([one(value), one(5.0)].iter().map(Owned::at));
        }
        assert_eq!(history.coefficients(0), [Vec3::splat(2.0)]);
        assert_eq!(history.coefficients(1), [Vec3::splat(5.0)]);
    }

    #[test]
    fn first_updates_average_exactly_and_later_ones_by_the_ratio() {
        let settings = BlendSettings { ratio: 0.25, significance: f32::INFINITY };
        let seen = blend(settings, [1.0, 2.0, 6.0, 7.0, 4.0, 8.0].map(|x| sums(x, 0.0, 1)));
        for (seen, expected) in seen.iter().zip([1.0, 1.5, 3.0, 4.0, 4.0, 5.0]) {
            assert!((seen - expected).abs() < 1e-5, "{seen} {expected}");
        }
    }

    #[test]
    fn no_stall_at_small_ratios() {
        let settings = BlendSettings { ratio: 0.001, significance: f32::INFINITY };
        let levels = std::iter::repeat_n(1.0, 1000).chain(std::iter::repeat_n(1.01, 20_000));
        let seen = blend(settings, levels.map(|x| sums(x, 0.0, 1)));
        // f32 stops where w·(x − mean) falls below half an ulp; a half float would stop at the start.
        assert!((seen.last().unwrap() - 1.01).abs() < 1e-4);
    }

    #[test]
    fn weights_follow_samples() {
        let mut history =
            History::new(BlendSettings { ratio: 1e-6, significance: f32::INFINITY }, 1, 9);
        let mut few = sums(1.0, 0.0, 1);
        let scaled = |s: &Owned, n: u32| Owned {
            sum: s.sum.iter().map(|x| x / COUNT as f32 * n as f32).collect(),
            count: n,
            ..s.clone()
        };
        few = scaled(&few, 10);
        history.update([few.at()]);
        history.update([scaled(&sums(4.0, 0.0, 1), 30).at()]);
        assert!((history.coefficients(0)[0].x - 3.25).abs() < 1e-5);
        assert!((history.effective_samples(0) - 40.0).abs() < 1e-3);
        history.update([SumsAt::default()]);
        assert!((history.coefficients(0)[0].x - 3.25).abs() < 1e-5);
    }

    /// Still light: the ladder leaves the noise where the ratio puts it.
    #[test]
    fn still_light_stays_still() {
        let settings = BlendSettings::default();
        let (mut worst, mut total) = (0.0f32, 0.0);
        for receiver in 0..200 {
            let seen = blend(settings, (0..1000).map(|t| sums(10.0, 1.0, receiver * 1000 + t)));
            for x in &seen[400..] {
                worst = worst.max((x - 10.0).abs());
                total += (x - 10.0).powi(2) / (200.0 * 600.0);
            }
        }
        let expected = (0.01f32 / 1.99).sqrt();
        assert!((total.sqrt() / expected - 1.0).abs() < 0.1, "{} {expected}", total.sqrt());
        assert!(worst < 6.0 * expected, "{worst}");
    }

    /// Light that comes by rare, bright paths: one update in twenty is two hundred times as bright.
    #[test]
    fn rare_paths_are_no_change() {
        let settings = BlendSettings::default();
        let steady = BlendSettings { significance: f32::INFINITY, ..settings };
        let update = |receiver: u64, t: u64| {
            let rare = unit(mix(receiver * 5000 + t) as u32) < 0.05;
            sums(if rare { 200.0 } else { 1.0 }, 0.1, receiver * 5000 + t)
        };
        for receiver in 0..50 {
            let updates = || (0..1000).map(|t| update(receiver, t));
            let (seen, steady) = (blend(settings, updates()), blend(steady, updates()));
            for (seen, steady) in seen.iter().zip(&steady).skip(100) {
                assert!((seen / steady - 1.0).abs() < 0.5, "{receiver}: {seen} {steady}");
            }
        }
    }

    #[test]
    fn expected_changes_are_followed_sooner() {
        let settings = BlendSettings::default();
        let after = |expected: bool| {
            let answers = (0..100).map(|receiver| {
                let mut history = History::new(settings, 1, 9);
                (0..400).for_each(|t| history.update([sums(10.0, 1.0, receiver * 2000 + t).at()]));
                if expected {
                    history.expect_change();
                }
                let mut update = |t: u64| {
                    history.update([sums(12.0, 1.0, receiver * 2000 + t).at()]);
                    history.coefficients(0)[0].x
                };
                (400..1000).take_while(|t| update(*t) < 11.0).count()
            });
            let mut answers: Vec<usize> = answers.collect();
            answers.sort_unstable();
            answers[50]
        };
        assert!(after(true) * 3 <= after(false) * 2, "{} {}", after(true), after(false));
    }

    /// Updates until the error stays below a share of a jump of `jump` standard deviations.
    fn updates_to(share: f32, jump: f32, significance: f32) -> usize {
        let settings = BlendSettings { significance, ..Default::default() };
        let mut answers: Vec<usize> = (0..100)
            .map(|receiver| {
                let at = |t: u64| {
                    sums(if t < 400 { 10.0 } else { 10.0 + jump }, 1.0, receiver * 2000 + t)
                };
                let seen = blend(settings, (0..1200).map(at));
                1200 - 400
                    - seen[400..]
                        .iter()
                        .rev()
                        .take_while(|x| (*x - 10.0 - jump).abs() < share * jump)
                        .count()
                    + 1
            })
            .collect();
        answers.sort_unstable();
        answers[answers.len() / 2]
    }

    #[test]
    fn jumps_are_answered_at_once() {
        // Twenty standard deviations of an update: as when a lamp is switched.
        let significance = BlendSettings::default().significance;
        assert!(updates_to(0.5, 20.0, significance) <= 4);
        assert!(updates_to(0.1, 20.0, significance) <= 12);
        assert!(updates_to(0.05, 20.0, significance) <= 25);
        // Five: hidden in the noise of single updates.
        assert!(updates_to(0.5, 5.0, significance) <= 10);
        // By the ratio alone: ln 2/0.01 and ln 10/0.01.
        assert!((60..80).contains(&updates_to(0.5, 20.0, f32::INFINITY)));
        assert!((220..240).contains(&updates_to(0.1, 20.0, f32::INFINITY)));
    }
}
