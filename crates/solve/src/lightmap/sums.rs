//! What has arrived at lumels.

use glam::Vec3;
use lumencast_gather::SumsAt;
use lumencast_light::luminance;

/// Share of backs, by winding, above which a lumel lies within something: its light is that of the
/// lumels about it.
const BURIED_ABOVE: f32 = 0.5;
/// Samples of a lumel from which on its light is shown.
const SETTLED: f32 = 24.0;
/// By how much the squares of noise scatter more than those of a normal distribution do.
const TAILS: f32 = 1.5;
/// Share of the light by which lumels may differ together without counting as another light: their paths
/// end in the same light of the tick before, whose noise they share.
const SHARED: f32 = 0.02;

/// What has arrived at a lumel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sum {
    /// Sum over samples of irradiance, lux.
    sum: Vec3,
    /// Sum over samples of the square of its luminance.
    squares: f32,
    samples: f32,
    /// Samples that met the back of a surface first.
    backs: f32,
}

impl Sum {
    /// What was gathered at a lumel; nothing where that is not finite.
    pub(crate) fn of(found: &SumsAt<'_>) -> Option<Self> {
        let (sum, squares) = (*found.sum.first()?, *found.squares.first()?);
        let samples = found.count as f32;
        let backs = found.back_face_fraction * samples;
        let is_sound = sum.is_finite() && squares.is_finite() && samples > 0.0;
        is_sound.then_some(Self { sum, squares, samples, backs })
    }

    /// Adds what is new, which weighs no less than `ratio`.
    pub(crate) fn add(&mut self, new: &Self, ratio: f32) {
        let most = new.samples * (1.0 - ratio) / ratio;
        if self.samples > most {
            let share = most / self.samples;
            self.sum *= share;
            self.squares *= share;
            self.backs *= share;
            self.samples = most;
        }
        self.sum += new.sum;
        self.squares += new.squares;
        self.backs += new.backs;
        self.samples += new.samples;
    }

    /// Whether enough has arrived for light to be shown.
    pub(crate) fn is_settled(&self) -> bool {
        self.samples >= SETTLED
    }

    pub(crate) fn is_buried(&self) -> bool {
        self.backs > BURIED_ABOVE * self.samples
    }

    /// Irradiance and the variance of its luminance, infinite where nothing has arrived; nothing where
    /// the lumel lies within something.
    pub(crate) fn known(&self) -> Option<(Vec3, f32)> {
        if self.samples == 0.0 {
            return Some((Vec3::ZERO, f32::INFINITY));
        }
        let mean = self.sum / self.samples;
        (!self.is_buried()).then(|| (mean, self.scatter() / self.samples))
    }

    /// Variance a sample of the luminance.
    fn scatter(&self) -> f32 {
        let mean = luminance(self.sum / self.samples);
        (self.squares / self.samples - mean * mean).max(0.0)
    }
}

/// Whether what is new at some lumels differs from what is known there by more than chance explains. Two
/// sums tell: that of squared differences finds light that has changed here and there; that of
/// differences finds light that has changed a little everywhere. Each may lie so many of its own standard
/// deviations from what noise makes of it.
pub(crate) fn have_changed<'a>(
    known_and_new: impl Iterator<Item = (&'a Sum, &'a Sum)>,
    significance: f32,
) -> bool {
    let (mut squares, mut expected, mut count) = (0.0, 0.0, 0.0);
    let (mut drift, mut level) = (0.0f32, 0.0);
    for (known, new) in known_and_new.filter(|(known, _)| known.samples > 0.0) {
        let [before, now] = [known, new].map(|sum| luminance(sum.sum / sum.samples));
        // Few samples tell little of how they scatter: those of both together tell more.
        let (n, m) = (known.samples, new.samples);
        let scatter = (n * known.scatter() + m * new.scatter()) / (n + m);
        expected += scatter * (1.0 / n + 1.0 / m);
        squares += (now - before).powi(2);
        drift += now - before;
        level += before;
        count += 1.0;
    }
    let chance = 1.0 + significance * TAILS * (2.0 / count as f32).sqrt();
    squares > chance * expected || drift.abs() > significance * expected.sqrt() + SHARED * level
}

/// How noisy a sample is at some lumels, as it is displayed: the standard deviation of its luminance, by
/// the square root of that.
pub(crate) fn noise(sums: &[Sum]) -> f32 {
    let (mut squares, mut known) = (0.0, 0.0);
    for sum in sums.iter().filter(|sum| sum.samples > 0.0 && !sum.is_buried()) {
        let mean = luminance(sum.sum / sum.samples);
        squares += if mean > 0.0 { sum.scatter() / mean } else { 0.0 };
        known += 1.0;
    }
    if known > 0.0 { (squares / known as f32).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{mix, unit};

    /// Sums of so many samples of a level, each with noise of a standard deviation.
    fn sum(level: f32, noise: f32, samples: u32, seed: u64) -> Sum {
        let mut all = Sum::default();
        for sample in 0..samples {
            let random = unit((mix(seed << 32 | u64::from(sample)) >> 32) as u32);
            let value = level + noise * 12.0f32.sqrt() * (random - 0.5);
            all.sum += value;
            all.squares += value * value;
            all.samples += 1.0;
        }
        all
    }

    fn changed(before: f32, now: f32, seed: u64) -> bool {
        let pairs: Vec<(Sum, Sum)> = (0..16)
            .map(|k| {
                (
                    sum(before, 1.0, 64, 2 * (16 * seed + k)),
                    sum(now, 1.0, 16, 2 * (16 * seed + k) + 1),
                )
            })
            .collect();
        have_changed(pairs.iter().map(|(a, b)| (a, b)), 3.5)
    }

    #[test]
    fn changes_are_told_from_noise() {
        let false_alarms = (0..500).filter(|seed| changed(2.0, 2.0, *seed)).count();
        assert!(false_alarms <= 5, "{false_alarms} of 500");
        let found = (0..500).filter(|seed| changed(2.0, 2.8, *seed)).count();
        assert!(found > 450, "{found} of 500");
    }

    #[test]
    fn little_that_is_known_tells_nothing() {
        let (nothing, new) = (Sum::default(), sum(1.0, 0.1, 16, 1));
        assert!(!have_changed([(&nothing, &new); 16].into_iter(), 3.5));
        let before = sum(9.0, 0.1, 16, 2);
        assert!(have_changed([(&before, &new); 1].into_iter(), 3.5), "of one lumel, much");
        let near = sum(1.05, 0.1, 16, 2);
        assert!(!have_changed([(&near, &new); 1].into_iter(), 3.5), "little");
        assert!(have_changed([(&before, &new); 16].into_iter(), 3.5));
        assert!(!have_changed([(&before, &new); 16].into_iter(), f32::INFINITY));
    }

    /// Updates are averaged until they weigh the ratio.
    #[test]
    fn old_light_is_forgotten_by_the_ratio() {
        let mut all = Sum::default();
        let level = |value: f32| Sum {
            sum: Vec3::splat(8.0 * value),
            squares: 8.0 * value * value,
            samples: 8.0,
            backs: 0.0,
        };
        (0..10).for_each(|_| all.add(&level(1.0), 0.1));
        all.add(&level(2.0), 0.1);
        let (mean, _) = all.known().expect("light");
        assert!((mean.x - 1.1).abs() < 1e-4, "{mean}");
    }
}
