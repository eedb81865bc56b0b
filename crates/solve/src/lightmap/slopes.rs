//! How the light that has arrived at lumels depends on the normal ([`lumencast_light::slope_by`]).

use glam::Vec3;
use lumencast_gather::SumsAt;
use lumencast_light::luminance;

use super::sums::Sum;

/// The slope of each receiver's light: S over luminance, whatever becomes of the light's sum.
#[derive(Clone, Debug)]
pub(crate) struct Slopes(Vec<Vec3>);

impl Slopes {
    /// Bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }

    /// Of so many receivers, at which nothing has arrived.
    pub(crate) fn new(receivers: usize) -> Self {
        Self(vec![Vec3::ZERO; receivers])
    }

    /// Adds what is new at a receiver: the sum over samples of S, beside those of light that were there,
    /// are new, and are there now.
    pub(crate) fn add(&mut self, receiver: usize, new: Vec3, [before, came, now]: [&Sum; 3]) {
        let kept = now.samples() - came.samples();
        let all = kept * luminance(before.mean()) * self.0[receiver] + new;
        let slope = all / (now.samples() * luminance(now.mean()));
        self.0[receiver] = if slope.is_finite() { slope } else { Vec3::ZERO };
    }

    /// Takes over what another list has of a receiver.
    pub(crate) fn keep(&mut self, receiver: usize, other: &Self, before: usize) {
        self.0[receiver] = other.0[before];
    }

    /// The slope of a receiver.
    pub(crate) fn at(&self, receiver: usize) -> Vec3 {
        self.0[receiver]
    }
}

/// What was gathered at a lumel; 0 where that is not finite, or was not asked for.
pub(crate) fn sum_of(found: &SumsAt<'_>) -> Vec3 {
    let [_, x, y, z] = found.sum else { return Vec3::ZERO };
    let sum = Vec3::new(luminance(*x), luminance(*y), luminance(*z));
    if sum.is_finite() { sum } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lightmap::change::Change;

    fn sum(light: f32, samples: usize) -> Sum {
        Sum::of_samples(std::iter::repeat_n(light, samples))
    }

    /// Light of which one half comes from one side and one from the other, the second twice as bright.
    #[test]
    fn slopes_are_those_of_all_light() {
        let mut slopes = Slopes::new(1);
        let (nothing, one, two) = (Sum::default(), sum(1.0, 8), sum(2.0, 8));
        slopes.add(0, 8.0 * Vec3::X, [&nothing, &one, &one]);
        assert!(slopes.at(0).abs_diff_eq(Vec3::X, 1e-6));
        let mut all = one;
        all.add(&two, 0.01);
        slopes.add(0, -16.0 * Vec3::X, [&one, &two, &all]);
        assert!(slopes.at(0).abs_diff_eq(Vec3::new(-1.0 / 3.0, 0.0, 0.0), 1e-6));
        // What has become brighter before something came, and then counts less.
        let mut brighter = all;
        brighter.follow(&Change { by: 2.0 * all.mean(), ..Change::default() }, all.scatter());
        let mut now = brighter;
        now.add(&one, 0.5);
        slopes.add(0, 8.0 * Vec3::Y, [&brighter, &one, &now]);
        let right = Vec3::new(-4.5 / 3.0, 1.0, 0.0) / 5.5;
        assert!(slopes.at(0).abs_diff_eq(right, 1e-5), "{}", slopes.at(0));
        slopes.add(0, Vec3::ZERO, [&nothing, &sum(0.0, 4), &sum(0.0, 4)]);
        assert_eq!(slopes.at(0), Vec3::ZERO, "in the dark");
    }
}
