//! How bright the picture is shown: set by hand, or following what is seen.

/// Seconds in which automatic exposure goes most of the way (1 − 1/e).
const REACTION: f32 = 0.4;
/// Exposure before anything was measured.
const UNKNOWN: f32 = 1.0 / 1024.0;

/// Exposure in stops: radiance times 2^stops is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Whether it follows the picture: the middle of its luminances becomes middle grey.
    pub auto: bool,
    /// People set it by hand.
    pub stops: f32,
    /// Added to what follows the picture.
    pub compensation: f32,
    /// Where following it has come to.
    followed: Option<f32>,
}

impl Exposure {
    /// Least and most by hand.
    pub const STOPS: std::ops::RangeInclusive<f32> = -20.0..=14.0;
    /// Least and most compensation.
    pub const COMPENSATION: std::ops::RangeInclusive<f32> = -5.0..=5.0;

    /// Following the picture, or by hand.
    pub fn new(fixed: Option<f32>) -> Self {
        Self {
            auto: fixed.is_none(),
            stops: fixed.map_or(0.0, f32::log2),
            compensation: 0.0,
            followed: None,
        }
    }

    /// The factor on radiance.
    pub fn factor(&self) -> f32 {
        match (self.auto, self.followed) {
            (false, _) => self.stops.exp2(),
            (true, Some(stops)) => (stops + self.compensation).exp2(),
            (true, None) => UNKNOWN,
        }
    }

    /// A picture was measured, `seconds` after the one before.
    pub fn measured(&mut self, exposure: Option<f32>, seconds: f32) {
        let Some(target) = exposure.map(f32::log2).filter(|stops| stops.is_finite()) else {
            return;
        };
        let target = target.clamp(*Self::STOPS.start(), *Self::STOPS.end());
        let step = 1.0 - (-seconds / REACTION).exp();
        let followed = self.followed.map_or(target, |stops| stops + (target - stops) * step);
        self.followed = Some(followed);
        if self.auto {
            // So that switching to manual changes nothing.
            self.stops = followed + self.compensation;
        }
    }

    /// Whether something has been measured, or need not be.
    pub fn is_known(&self) -> bool {
        !self.auto || self.followed.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_the_picture() {
        let mut exposure = Exposure::new(None);
        assert!(!exposure.is_known());
        exposure.measured(Some(0.01), 0.0);
        assert!((exposure.factor() - 0.01).abs() < 1e-6, "the first at once");
        for _ in 0..20 {
            exposure.measured(Some(0.04), 0.1);
        }
        assert!((exposure.factor() / 0.04 - 1.0).abs() < 0.02, "{}", exposure.factor());
        exposure.measured(None, 0.1);
        exposure.measured(Some(f32::INFINITY), 0.1);
        assert!(exposure.factor() < 0.05, "black says nothing");
        exposure.compensation = 1.0;
        assert!((exposure.factor() / 0.08 - 1.0).abs() < 0.02);
        exposure.measured(Some(0.04), 0.1);
        let before = exposure.factor();
        exposure.auto = false;
        assert!((exposure.factor() / before - 1.0).abs() < 1e-5, "taken over by hand");
    }

    #[test]
    fn stays_where_it_was_set() {
        let mut exposure = Exposure::new(Some(0.25));
        exposure.measured(Some(8.0), 1.0);
        assert_eq!(exposure.factor(), 0.25);
    }
}
