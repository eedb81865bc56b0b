//! The scale of a field: half floats hold value / scale.

use glam::Vec3;

/// Follows a field's largest coefficient by powers of two, with hysteresis.
///
/// Photometric light overflows half floats (65,504): white ground in a sun of 100 klx has
/// c0 ≈ 45,000. Divided by the scale the largest value lies between ¼ and 2, which leaves room for
/// a 32,000-fold jump before the scale is changed, and resolves 2⁻²⁴ of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScaleRule {
    log2: Option<i8>,
}

impl ScaleRule {
    /// log2 of the scale for a field's coefficients. It changes when the largest of them leaves
    /// [¼, 2) times the scale; then the largest lies in [½, 1) times the new one. A field without
    /// light keeps its scale; 1 at first.
    pub fn update(&mut self, coefficients: &[Vec3]) -> i8 {
        let largest = coefficients
            .iter()
            .filter(|c| c.is_finite())
            .fold(0.0_f32, |largest, c| largest.max(c.abs().max_element()));
        self.follow(largest)
    }

    /// The same, by the largest coefficient.
    pub fn follow(&mut self, largest: f32) -> i8 {
        let current = self.log2.unwrap_or(0);
        if largest > 0.0 {
            let ratio = f64::from(largest) / f64::from(current).exp2();
            if self.log2.is_none() || !(0.25..2.0).contains(&ratio) {
                let log2 = f64::from(largest).log2().floor() as i32 + 1;
                self.log2 = Some(log2.clamp(i8::MIN.into(), i8::MAX.into()) as i8);
            }
        }
        self.log2.unwrap_or(0)
    }

    /// log2 of the scale; none before there was any light.
    pub fn log2(&self) -> Option<i8> {
        self.log2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_follows_with_hysteresis() {
        let mut rule = ScaleRule::default();
        assert_eq!(rule.update(&[Vec3::ZERO]), 0);
        assert_eq!(rule.log2(), None);
        assert_eq!(rule.update(&[Vec3::splat(45_000.0)]), 16);
        for (value, log2) in [
            (60_000.0, 16),
            (16_384.0, 16),
            (131_071.0, 16),
            (131_072.0, 18),
            (65_536.0, 18),
            (1e-3, -9),
        ] {
            assert_eq!(rule.update(&[Vec3::new(0.0, -value, 0.0)]), log2, "{value}");
        }
        assert_eq!(rule.update(&[Vec3::NAN, Vec3::splat(1e-3)]), -9);
        assert_eq!(rule.update(&[]), -9);
        assert_eq!(rule.log2(), Some(-9));
    }
}
