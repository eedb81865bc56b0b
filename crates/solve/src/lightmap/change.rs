//! How the light of a cell has changed since it was gathered.
//!
//! Light mostly changes smoothly over a surface: a lamp that moves makes a cell brighter or darker as a
//! whole, and noise that lumels have each on their own hides it. So what is new at a cell's lumels is
//! compared with what is known there by their sums. What is known is multiplied by the ratio of both, as
//! far as noise lets it be trusted: the gain of a Kalman filter. Its pattern stays. Where the pattern is
//! another by more than chance explains, what was known weighs little from then on.

use glam::Vec3;
use lumencast_light::luminance;

use super::sums::Sum;

/// By how much the squares of noise scatter more than those of a normal distribution do.
const TAILS: f32 = 1.5;
/// Light of a cell changes by this ratio at most at once, up or down.
const MOST: f32 = 4.0;

/// What is known of a lumel weighs so many samples where the pattern of light is another now.
const OTHER: f32 = 4.0;
/// Of light that was scaled after an edit, so much is still wrong at a lumel, as a share of it.
const WRONG: f32 = 0.1;
/// A cell that is brighter or darker by this ratio has changed much.
const MUCH: f32 = 0.1;

/// What speaks for a change of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// The scene was edited.
    Edit,
    /// Something in the scene moves.
    Motion,
    /// Nothing does: all is still.
    Nothing,
}

impl Cause {
    /// Standard deviation of the ratio by which light changes from update to update.
    fn deviation(self) -> f32 {
        match self {
            Self::Edit => 0.2,
            Self::Motion => 0.02,
            Self::Nothing => 0.0,
        }
    }
}

/// What is known about a change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Change {
    /// How much brighter the cell is.
    pub(crate) gain: Vec3,
    /// Whether its light has another pattern.
    pub(crate) is_other: bool,
}

impl Change {
    /// How lumels differ from what is known of them. From so many standard deviations of noise on,
    /// `significance`, a difference is a change in any case.
    pub(crate) fn of<'a>(
        known_and_new: impl Iterator<Item = (&'a Sum, &'a Sum)> + Clone,
        cause: Cause,
        significance: f32,
    ) -> Self {
        let none = Self { gain: Vec3::ONE, is_other: false };
        let pairs = known_and_new.filter(|(known, _)| known.samples() > 0.0);
        let (mut before, mut now, mut variance) = (Vec3::ZERO, Vec3::ZERO, 0.0);
        for (known, new) in pairs.clone() {
            (before, now) = (before + known.mean(), now + new.mean());
            variance += chance(known, new, 1.0);
        }
        let level = luminance(before);
        let drift = (luminance(now) - level).abs();
        let is_significant = drift > significance * variance.sqrt();
        if level <= 0.0 {
            return Self { is_other: is_significant, ..none };
        }
        let likely = (cause.deviation() * level).powi(2);
        let trust = if is_significant { 1.0 } else { likely / (likely + variance).max(1e-30) };
        let ratio = (now / before.max(Vec3::splat(1e-30)))
            .clamp(Vec3::splat(1.0 / MOST), Vec3::splat(MOST));
        let ratio = Vec3::select(before.cmpgt(Vec3::ZERO), ratio, Vec3::ONE);
        let gain = 1.0 + trust * (ratio - 1.0);

        let brighter = luminance(gain * before) / level;
        let (mut squares, mut expected, mut count) = (0.0, 0.0, 0.0);
        for (known, new) in pairs {
            squares += luminance(new.mean() - gain * known.mean()).powi(2);
            expected += chance(known, new, brighter);
            count += 1.0f32;
        }
        let most = 1.0 + significance * TAILS * (2.0 / count).sqrt();
        Self { gain, is_other: squares > most * expected }
    }

    /// Lets what is known of a cell's lumels follow.
    pub(crate) fn apply(&self, known: &mut [Sum], cause: Cause) {
        if self.gain == Vec3::ONE && !self.is_other {
            return;
        }
        for sum in known {
            sum.brighten(self.gain);
            if self.is_other {
                sum.limit(OTHER);
            } else if cause == Cause::Edit {
                sum.doubt(WRONG);
            }
        }
    }

    /// Whether the cell is to be gathered at sooner than others.
    pub(crate) fn is_much(&self) -> bool {
        self.is_other || (self.gain - 1.0).abs().max_element() > MUCH
    }
}

/// The variance of a difference that noise alone makes, where what is known is so much brighter now. Few
/// samples tell little of how they scatter: those of both together tell more.
fn chance(known: &Sum, new: &Sum, brighter: f32) -> f32 {
    let (n, m) = (known.samples(), new.samples());
    let scatter = (n * brighter.powi(2) * known.scatter() + m * new.scatter()) / (n + m);
    scatter * (1.0 / n + 1.0 / m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{mix, unit};

    /// Sums of so many samples of a level, each with noise of a standard deviation.
    fn sum(level: f32, noise: f32, samples: u32, seed: u64) -> Sum {
        let values = (0..samples).map(|sample| {
            let random = unit((mix(seed << 32 | u64::from(sample)) >> 32) as u32);
            level + noise * 12.0f32.sqrt() * (random - 0.5)
        });
        Sum::of_samples(values)
    }

    const SIGNIFICANCE: f32 = 3.5;

    /// Sixteen lumels, known by 64 samples and new by 16; `now` gives the level of each.
    fn change(cause: Cause, seed: u64, now: impl Fn(u64) -> f32) -> Change {
        let pairs: Vec<(Sum, Sum)> = (0..16)
            .map(|k| {
                let seed = 2 * (16 * seed + k);
                (sum(2.0, 1.0, 64, seed), sum(now(k), 1.0, 16, seed + 1))
            })
            .collect();
        Change::of(pairs.iter().map(|(a, b)| (a, b)), cause, SIGNIFICANCE)
    }

    #[test]
    fn patterns_are_told_from_noise() {
        let is_other = |seed, now: fn(u64) -> f32| change(Cause::Nothing, seed, now).is_other;
        let false_alarms = (0..500).filter(|seed| is_other(*seed, |_| 2.0)).count();
        assert!(false_alarms <= 5, "{false_alarms} of 500");
        let stripes = |k: u64| if k.is_multiple_of(2) { 1.0 } else { 3.0 };
        let found = (0..500).filter(|seed| is_other(*seed, stripes)).count();
        assert!(found > 450, "{found} of 500");
    }

    #[test]
    fn brighter_light_keeps_its_pattern() {
        for seed in 0..100 {
            let Change { gain, is_other } = change(Cause::Nothing, seed, |_| 4.0);
            assert!(!is_other && (gain.y - 2.0).abs() < 0.15, "{gain} {is_other}");
        }
    }

    /// A change that noise would hide is followed where one is expected, and else is not.
    #[test]
    fn small_changes_are_followed_where_they_are_likely() {
        let mean = |cause, level: f32| {
            (0..200).map(|seed| change(cause, seed, |_| level).gain.y).sum::<f32>() / 200.0
        };
        assert!((mean(Cause::Edit, 2.2) - 1.1).abs() < 0.02, "{}", mean(Cause::Edit, 2.2));
        let still: Vec<f32> =
            (0..200).map(|seed| change(Cause::Nothing, seed, |_| 2.0).gain.y).collect();
        assert!(still.iter().filter(|gain| **gain != 1.0).count() <= 2);
    }

    #[test]
    fn little_that_is_known_tells_nothing() {
        let (nothing, new) = (Sum::default(), sum(1.0, 0.1, 16, 1));
        let of = |known: &Sum, cause, significance| {
            Change::of(std::iter::repeat_n((known, &new), 16), cause, significance)
        };
        let none = Change { gain: Vec3::ONE, is_other: false };
        assert_eq!(of(&nothing, Cause::Edit, SIGNIFICANCE), none);
        let dark = sum(0.0, 0.0, 16, 2);
        assert!(of(&dark, Cause::Nothing, SIGNIFICANCE).is_other);
        let bright = sum(9.0, 0.1, 16, 2);
        assert_eq!(of(&bright, Cause::Nothing, f32::INFINITY), none);
    }
}
