//! Residuals of lumels as bits: how many bits the magnitude has, in unary, those bits below the first,
//! the sign (docs/wire.md, "Residuals").

use crate::range_coder::{BitCoder, Context};

/// Bits of the largest magnitude: differences of differences of halves have 17.
const MOST_BITS: usize = 17;
/// Classes of how much a residual's neighbours differ from their predictions.
const CLASSES: usize = 12;

/// Contexts of the residuals of one channel, or of two that are alike.
pub(crate) struct ResidualContexts {
    /// By the class of the neighbourhood and the bits counted so far.
    more: [[Context; MOST_BITS]; CLASSES],
    /// The bit after the first, by the number of bits.
    second: [Context; MOST_BITS + 1],
    /// By the signs of the residuals at west and north.
    negative: [[Context; 3]; 3],
}

/// Residuals about the one that is coded.
pub(crate) struct Near {
    /// Of the same channel of the lumel at west, 0 where there is none.
    pub(crate) west: i32,
    /// Of the same channel of the lumel at north, 0 where there is none.
    pub(crate) north: i32,
    /// Of Y of the same lumel; 0 for Y itself.
    pub(crate) luma: i32,
}

impl Near {
    fn class(&self) -> usize {
        let sum = self.west.abs() + self.north.abs() + self.luma.abs();
        bit_length(sum).min(CLASSES - 1)
    }
}

impl ResidualContexts {
    pub(crate) const NEW: Self = Self {
        more: [[Context::NEW; MOST_BITS]; CLASSES],
        second: [Context::NEW; MOST_BITS + 1],
        negative: [[Context::NEW; 3]; 3],
    };

    /// Codes a residual whose magnitude is below 2^17.
    pub(crate) fn code(&mut self, coder: &mut impl BitCoder, near: &Near, value: i32) -> i32 {
        let wanted = bit_length(value);
        let more = &mut self.more[near.class()];
        let mut bits = 0;
        while bits < MOST_BITS && coder.bit(&mut more[bits], bits < wanted) {
            bits += 1;
        }
        if bits == 0 {
            return 0;
        }
        let mut magnitude = 1;
        for below in (0..bits - 1).rev() {
            let bit = value.unsigned_abs() >> below & 1 != 0;
            let bit = if below + 2 == bits {
                coder.bit(&mut self.second[bits], bit)
            } else {
                coder.even_bit(bit)
            };
            magnitude = magnitude << 1 | i32::from(bit);
        }
        let sign = |residual: i32| (residual.signum() + 1) as usize;
        let negative = &mut self.negative[sign(near.west)][sign(near.north)];
        if coder.bit(negative, value < 0) { -magnitude } else { magnitude }
    }
}

/// Bits of a magnitude; 0 has none.
pub(crate) fn bit_length(value: i32) -> usize {
    (u32::BITS - value.unsigned_abs().leading_zeros()) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::range_coder::{Decoder, Encoder};

    #[test]
    fn residuals_round_trip() {
        let largest = (1 << MOST_BITS) - 1;
        let values: Vec<i32> =
            (-70..70).chain([1000, -70_000, largest, -largest, 0, 31_743, -63_486]).collect();
        let near = |at: usize| Near {
            west: values[at.saturating_sub(1)],
            north: values[at / 2],
            luma: at as i32 % 3,
        };
        let mut encoder = Encoder::new(Vec::new());
        let mut contexts = ResidualContexts::NEW;
        for (at, value) in values.iter().enumerate() {
            assert_eq!(contexts.code(&mut encoder, &near(at), *value), *value);
        }
        let bytes = encoder.finish();
        let mut decoder = Decoder::new(&bytes).unwrap();
        let mut contexts = ResidualContexts::NEW;
        for (at, value) in values.iter().enumerate() {
            assert_eq!(contexts.code(&mut decoder, &near(at), 0), *value);
        }
        assert!(decoder.at_end() && !decoder.overrun());
    }
}
