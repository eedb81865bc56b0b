//! What has arrived at lumels.

use glam::Vec3;
use lumencast_gather::SumsAt;
use lumencast_light::luminance;

use super::change::Change;

/// Share of backs without light above which a lumel lies within something: its light is that of the
/// lumels about it.
const BURIED_ABOVE: f32 = 0.5;
/// So many samples tell whether it does.
const CERTAIN: f32 = 16.0;
/// What was known of light that has changed weighs as many samples, at least.
const LEAST: f32 = 0.25;
/// Noise grows with light that becomes brighter up to that.
const BRIGHTER: f32 = 4.0;
/// Samples of a lumel from which on its light is shown.
const SETTLED: f32 = 24.0;

/// What has arrived at a lumel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sum {
    /// Sum over samples of irradiance, lux.
    sum: Vec3,
    /// Sum over samples of the square of its luminance.
    squares: f32,
    samples: f32,
    /// Samples that first met the back of a surface, by winding, and found no light from there.
    backs: f32,
}

impl Sum {
    /// What was gathered at a lumel; nothing where that is not finite.
    pub(crate) fn of(found: &SumsAt<'_>) -> Option<Self> {
        let (sum, squares) = (*found.sum.first()?, *found.squares.first()?);
        let samples = found.count as f32;
        let backs = found.dark_back_fraction * samples;
        let is_sound = sum.is_finite() && squares.is_finite() && samples > 0.0;
        is_sound.then_some(Self { sum, squares, samples, backs })
    }

    /// Samples of these luminances.
    #[cfg(test)]
    pub(crate) fn of_samples(values: impl Iterator<Item = f32>) -> Self {
        let add = |all: Self, value: f32| Self {
            sum: all.sum + value,
            squares: all.squares + value * value,
            samples: all.samples + 1.0,
            ..all
        };
        values.fold(Self::default(), add)
    }

    /// Adds what is new, which weighs no less than `ratio`.
    pub(crate) fn add(&mut self, new: &Self, ratio: f32) {
        self.limit(new.samples * (1.0 - ratio) / ratio);
        self.sum += new.sum;
        self.squares += new.squares;
        self.backs += new.backs;
        self.samples += new.samples;
    }

    /// Lets what is known weigh no more than so many samples.
    pub(crate) fn limit(&mut self, most: f32) {
        if self.samples > most {
            let share = most / self.samples;
            self.sum *= share;
            self.squares *= share;
            self.backs *= share;
            self.samples = most;
        }
    }

    /// Follows a change of light. Its noise is thought to grow and shrink with it. What is known weighs as
    /// many samples as make the change's variance of a `scatter` that lumels about it have alike: by its
    /// own, lumels that are too bright would weigh more.
    pub(crate) fn follow(&mut self, change: &Change, scatter: f32) {
        if self.samples == 0.0 || *change == Change::default() {
            return;
        }
        let (before, own) = (self.mean(), self.scatter());
        let now = change.left * before + change.by.max(Vec3::ZERO);
        let level = luminance(before);
        let brighter = if level > 0.0 { (luminance(now) / level).min(BRIGHTER) } else { 1.0 };
        let louder = brighter * brighter;
        self.sum = self.samples * now;
        self.squares = self.samples * (louder * own + luminance(now).powi(2));
        if change.variance > 0.0 {
            self.limit((louder * scatter / change.variance).max(LEAST));
        }
    }

    pub(crate) fn samples(&self) -> f32 {
        self.samples
    }

    /// Irradiance, lux; zero where nothing has arrived.
    pub(crate) fn mean(&self) -> Vec3 {
        if self.samples > 0.0 { self.sum / self.samples } else { Vec3::ZERO }
    }

    /// Whether enough has arrived for light to be shown.
    pub(crate) fn is_settled(&self) -> bool {
        self.samples >= SETTLED
    }

    pub(crate) fn is_buried(&self) -> bool {
        self.backs > BURIED_ABOVE * self.samples
    }

    /// Whether more samples would hardly find otherwise.
    pub(crate) fn is_certainly_buried(&self) -> bool {
        self.is_buried() && self.samples >= CERTAIN
    }

    /// Irradiance and the variance of its luminance, both zero where nothing has arrived; nothing where
    /// the lumel lies within something. Samples differ less from their own mean than from the true one:
    /// two of them by half of their variance.
    pub(crate) fn known(&self) -> Option<(Vec3, f32)> {
        if self.samples == 0.0 {
            return Some((Vec3::ZERO, 0.0));
        }
        let variance = self.scatter() / (self.samples - 1.0).max(0.5 * self.samples);
        (!self.is_buried()).then(|| (self.mean(), variance))
    }

    /// Variance a sample of the luminance.
    pub(crate) fn scatter(&self) -> f32 {
        let mean = luminance(self.mean());
        (self.squares / self.samples - mean * mean).max(0.0)
    }
}

/// Those at which something has arrived, and that do not lie within something.
fn known(sums: &[Sum]) -> impl Iterator<Item = &Sum> {
    sums.iter().filter(|sum| sum.samples > 0.0 && !sum.is_buried())
}

/// Mean variance a sample of the luminance, at some lumels.
pub(crate) fn scatter(sums: &[Sum]) -> f32 {
    known(sums).map(Sum::scatter).sum::<f32>() / known(sums).count().max(1) as f32
}

/// How noisy a sample is at some lumels, as it is displayed: the standard deviation of its luminance, by
/// the square root of that.
pub(crate) fn noise(sums: &[Sum]) -> f32 {
    let (mut squares, mut count) = (0.0, 0.0);
    for sum in known(sums) {
        let mean = luminance(sum.mean());
        squares += if mean > 0.0 { sum.scatter() / mean } else { 0.0 };
        count += 1.0;
    }
    if count > 0.0 { (squares / count as f32).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// Of values ±1 about the true mean, n have a mean of variance 1 / n.
    #[test]
    fn few_samples_are_not_thought_better_than_they_are() {
        let either = [-1.0, 1.0];
        let variances =
            either.iter().flat_map(|a| either.map(|b| [10.0 + a, 10.0 + b])).map(|two| {
                let (_, variance) = Sum::of_samples(two.into_iter()).known().expect("light");
                variance
            });
        assert!((variances.sum::<f32>() / 4.0 - 0.5).abs() < 1e-4);
        let many = Sum::of_samples((0..64).map(|k| either[k % 2]));
        let (_, variance) = many.known().expect("light");
        assert!((variance - 1.0 / 63.0).abs() < 1e-6, "{variance}");
    }

    /// What is known follows changes, and weighs as much as they leave of it.
    #[test]
    fn changes_are_followed() {
        let known = Sum::of_samples((0..64).map(|k| if k % 2 == 0 { 1.0 } else { 3.0 }));
        let after = |by: f32, variance: f32| {
            let mut sum = known;
            let left = Vec3::splat(if by < 0.0 { 0.25 } else { 1.0 });
            sum.follow(&Change { by: Vec3::splat(by), left, variance }, known.scatter());
            sum
        };
        assert_eq!(after(0.0, 0.0), known);
        let brighter = after(2.0, 0.0);
        assert!((brighter.mean() - 4.0).abs().max_element() < 1e-5);
        assert!((brighter.scatter() - 4.0).abs() < 1e-4 && brighter.samples() == 64.0);
        assert!((after(2.0, 0.25).samples() - 16.0).abs() < 1e-3);
        // One that is bright by chance weighs no more than those about it.
        let mut bright = Sum::of_samples((0..64).map(|k| if k % 16 == 0 { 50.0 } else { 1.0 }));
        bright.follow(&Change { variance: 0.1, ..Change::default() }, known.scatter());
        assert!((bright.samples() - 10.0).abs() < 1e-3, "{}", bright.samples());
        let dark = after(-9.0, 1.0);
        assert_eq!((dark.mean(), dark.samples()), (Vec3::splat(0.5), LEAST));
        assert!((dark.scatter() - 1.0 / 16.0).abs() < 1e-4);
        let mut nothing = Sum::default();
        nothing.follow(&Change { by: Vec3::ONE, variance: 1.0, ..Change::default() }, 1.0);
        assert_eq!(nothing, Sum::default());
    }
}
