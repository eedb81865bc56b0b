//! Irradiance as codes of 8 bits.
//!
//! `code = 255 · log2(1 + 2^toe · x) / octaves`, x being irradiance over the scale: equal steps of
//! codes are equal ratios of light, but in the dark, where they are equal differences. What is below
//! the toe, 2^-toe of the scale, has few codes; what is above has as many for each doubling.

use glam::Vec3;
use lumencast_light::luminance;

use super::news::brightest;

/// How irradiance becomes codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mapping {
    /// log2 of the field's scale.
    pub(crate) scale_log2: i8,
    /// −log2 of the light, over the scale, at which equal differences become equal ratios.
    pub(crate) toe: u8,
    /// Eighths of octaves that 255 codes span.
    pub(crate) range: u8,
}

/// The greatest toe: beyond it nothing is told apart that is 2^32 times darker than the brightest.
pub(crate) const MAX_TOE: u8 = 32;
/// One lumel of so many is looked at for a mapping.
const STRIDE: usize = 7;
/// The toe lies so many octaves below the median.
const BELOW_MEDIAN: f64 = 2.0;
/// The brightest light may grow by so much until another mapping is needed.
const HEADROOM: f64 = 1.25;

impl Mapping {
    /// A mapping for light, by its brightest channel and its median.
    pub(crate) fn of(irradiance: &[Vec3], scale_log2: i8) -> Self {
        let scale = f64::from(scale_log2).exp2();
        let mut values: Vec<f32> =
            irradiance.iter().step_by(STRIDE).map(|e| luminance(*e)).filter(|e| *e > 0.0).collect();
        let middle = values.len() / 2;
        let median = match values.is_empty() {
            true => scale,
            false => f64::from(*values.select_nth_unstable_by(middle, f32::total_cmp).1),
        };
        let toe = ((scale / median).log2() + BELOW_MEDIAN).round().clamp(0.0, MAX_TOE.into()) as u8;
        let octaves = (f64::from(toe).exp2() * HEADROOM * f64::from(brightest(irradiance)) / scale
            + 1.0)
            .log2();
        let range = (octaves * 8.0).ceil().clamp(8.0, u8::MAX.into()) as u8;
        Self { scale_log2, toe, range }
    }

    /// Whether light can still be told by it, by its brightest channel: none is too bright, and it does
    /// not lie in the lowest codes alone.
    pub(crate) fn suits(self, brightest: f32) -> bool {
        let brightest = f64::from(brightest);
        brightest <= self.irradiance(255.0) && brightest * 8.0 >= self.irradiance(255.0)
    }

    fn octaves(self) -> f64 {
        f64::from(self.range) / 8.0
    }

    /// The code of irradiance, not rounded.
    fn code(self, irradiance: f64) -> f64 {
        let toes = irradiance * (f64::from(self.toe) - f64::from(self.scale_log2)).exp2();
        (255.0 * toes.ln_1p() / std::f64::consts::LN_2 / self.octaves()).clamp(0.0, 255.0)
    }

    /// The irradiance of a code, lux.
    fn irradiance(self, code: f64) -> f64 {
        let toes = (code / 255.0 * self.octaves()).exp2() - 1.0;
        toes * (f64::from(self.scale_log2) - f64::from(self.toe)).exp2()
    }
}

/// Codes in 1/256, by the first bits of irradiance as f32: its exponent, and 9 bits of its fraction.
#[derive(Clone, Debug)]
pub(crate) struct CodeTable {
    first: u32,
    codes: Vec<u16>,
}

/// Bits of the fraction that are left out.
const SHIFT: u32 = 14;
/// Octaves below the toe where codes begin: there they are below 1/256 of a code.
const DARK: i32 = 16;

impl CodeTable {
    pub(crate) fn new(mapping: Mapping) -> Self {
        let toe = i32::from(mapping.scale_log2) - i32::from(mapping.toe);
        let power = |log2: i32| (f64::from(log2).exp2() as f32).clamp(f32::MIN_POSITIVE, f32::MAX);
        let first = power(toe - DARK).to_bits() >> SHIFT;
        let top = power(toe + i32::from(mapping.range) / 8 + 2).to_bits() >> SHIFT;
        let middle = |step: u32| f32::from_bits((step << SHIFT) | (1 << (SHIFT - 1)));
        let code = |step| (mapping.code(middle(step).into()) * 256.0).round() as u16;
        Self { first, codes: (first..=top).map(code).collect() }
    }

    /// The code of irradiance in 1/256; that of 0 where it is negative or no number.
    pub(crate) fn code(&self, irradiance: f32) -> u16 {
        let step = if irradiance > 0.0 { irradiance.to_bits() >> SHIFT } else { 0 };
        let at = step.saturating_sub(self.first) as usize;
        self.codes[at.min(self.codes.len() - 1)]
    }
}

/// Irradiance of codes in 1/16.
#[derive(Clone, Debug)]
pub(crate) struct LightTable(Vec<f32>);

impl LightTable {
    pub(crate) fn new(mapping: Mapping) -> Self {
        Self((0..=255 * 16).map(|code| mapping.irradiance(f64::from(code) / 16.0) as f32).collect())
    }

    /// The irradiance of a code in 1/16; codes beyond 0 to 255 are bounded.
    pub(crate) fn irradiance(&self, code: i32) -> f32 {
        self.0[code.clamp(0, 255 * 16) as usize]
    }

    /// Whether every code is a number.
    pub(crate) fn is_finite(&self) -> bool {
        self.0.iter().all(|irradiance| irradiance.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAPPING: Mapping = Mapping { scale_log2: 3, toe: 7, range: 66 };

    /// The formula of docs/wire.md, and back.
    #[test]
    fn codes_are_equal_ratios_above_the_toe() {
        let toe = 8.0 / 128.0;
        assert_eq!(MAPPING.code(0.0), 0.0);
        assert!((MAPPING.code(toe) - 255.0 / 8.25).abs() < 1e-9);
        assert!((MAPPING.code(toe * 255.0) - 8.0 * 255.0 / 8.25).abs() < 1e-9);
        for code in 0..=255 {
            let code = f64::from(code);
            assert!((MAPPING.code(MAPPING.irradiance(code)) - code).abs() < 1e-6);
        }
        assert_eq!(MAPPING.code(1e9), 255.0);
    }

    #[test]
    fn tables_follow_the_formula() {
        let (codes, light) = (CodeTable::new(MAPPING), LightTable::new(MAPPING));
        for step in 0..4000 {
            let irradiance = 1e-6 * 1.006_f32.powi(step);
            let exact = MAPPING.code(irradiance.into()) * 256.0;
            assert!((f64::from(codes.code(irradiance)) - exact).abs() < 20.0, "{irradiance}");
        }
        for odd in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY, 1e-38] {
            assert_eq!(codes.code(odd), 0, "{odd}");
        }
        assert_eq!([f32::INFINITY, f32::MAX].map(|e| codes.code(e)), [255 * 256; 2]);
        for code in 0..=255 {
            let coded = codes.code(light.irradiance(code * 16));
            assert!(coded.abs_diff(code as u16 * 256) < 20, "{code}: {coded}");
        }
        assert_eq!((light.irradiance(-5), light.irradiance(0)), (0.0, 0.0));
        assert_eq!(light.irradiance(9999), light.irradiance(4080));
    }

    #[test]
    fn a_mapping_suits_its_light() {
        let light: Vec<Vec3> = (0..1000).map(|i| Vec3::splat(0.01 * i as f32)).collect();
        let mapping = Mapping::of(&light, 4);
        assert!(mapping.suits(brightest(&light)));
        assert!(mapping.irradiance(255.0) >= 9.99 * 1.25);
        assert!(mapping.irradiance(255.0) < 9.99 * 1.5);
        // A quarter of the median, about 5 of 16.
        assert_eq!(mapping.toe, 4);
        let brighter: Vec<Vec3> = light.iter().map(|e| 2.0 * *e).collect();
        let darker: Vec<Vec3> = light.iter().map(|e| 0.05 * *e).collect();
        assert!(!mapping.suits(brightest(&brighter)) && !mapping.suits(brightest(&darker)));
        for odd in [vec![], vec![Vec3::ZERO; 9], vec![Vec3::NAN; 9], vec![Vec3::MAX; 9]] {
            let mapping = Mapping::of(&odd, 127);
            assert!(LightTable::new(mapping).irradiance(0) == 0.0, "{odd:?}");
        }
    }
}
