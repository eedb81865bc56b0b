//! A binary adaptive range coder, carry-less as in LZMA (Pavlov; Martin 1979), with 16-bit
//! probabilities that adapt fast at first. See docs/wire.md, "Range coder".
//!
//! Encoder and decoder are two implementations of [`BitCoder`], so the model of what is coded
//! ([`crate::probe`], [`crate::lumel`]) is written once: it passes each bit in and goes on with the bit that comes out.

/// Zero bytes that an encoder may leave off the end, and a decoder may read past it.
const IMPLICIT_ZEROS: usize = 64;
/// A probability never comes nearer than this to 0 or 1 (of 65536).
const MARGIN: u16 = 32;
const TOP: u32 = 1 << 24;

/// An adaptive estimate of a bit's probability.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Context {
    /// Probability of a 0, of 65536.
    zero: u16,
    /// Bits seen, up to 5: the step of adaptation goes from 1/2 to 1/64.
    seen: u8,
}

impl Context {
    pub(crate) const NEW: Self = Self { zero: 1 << 15, seen: 0 };

    fn bound(self, range: u32) -> u32 {
        (range >> 16) * u32::from(self.zero)
    }

    fn adapt(&mut self, bit: bool) {
        let shift = (self.seen + 1).min(6);
        if bit {
            self.zero -= (self.zero - MARGIN) >> shift;
        } else {
            self.zero += (u16::MAX - (MARGIN - 1) - self.zero) >> shift;
        }
        self.seen = (self.seen + 1).min(5);
    }
}

/// Codes bits in either direction.
pub(crate) trait BitCoder {
    /// Encoder: writes `bit` and returns it. Decoder: ignores `bit`, returns the one read.
    fn bit(&mut self, context: &mut Context, bit: bool) -> bool;
    /// The same with probability ½.
    fn even_bit(&mut self, bit: bool) -> bool;
    /// Whether more was read than there is.
    fn overrun(&self) -> bool;
}

/// Writes bits.
pub(crate) struct Encoder {
    low: u64,
    range: u32,
    /// The last byte that a carry could still change, followed by `pending - 1` bytes 0xFF.
    cache: u8,
    pending: usize,
    out: Vec<u8>,
}

impl Encoder {
    /// Appends to `out`.
    pub(crate) fn new(out: Vec<u8>) -> Self {
        Self { low: 0, range: u32::MAX, cache: 0, pending: 1, out }
    }

    fn shift_low(&mut self) {
        if self.low < 0xFF00_0000 || self.low > 0xFFFF_FFFF {
            let carry = (self.low >> 32) as u8;
            self.out.push(self.cache.wrapping_add(carry));
            let filler = 0xFF_u8.wrapping_add(carry);
            self.out.extend(std::iter::repeat_n(filler, self.pending - 1));
            self.cache = (self.low >> 24) as u8;
            self.pending = 0;
        }
        self.pending += 1;
        self.low = (self.low & 0x00FF_FFFF) << 8;
    }

    fn normalise(&mut self) {
        while self.range < TOP {
            self.shift_low();
            self.range <<= 8;
        }
    }

    /// Flushes, and returns the bytes without their trailing zeros.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        for _ in 0..5 {
            self.shift_low();
        }
        let zeros = self.out.iter().rev().take(IMPLICIT_ZEROS).take_while(|&&b| b == 0).count();
        self.out.truncate(self.out.len() - zeros);
        self.out
    }
}

impl BitCoder for Encoder {
    fn bit(&mut self, context: &mut Context, bit: bool) -> bool {
        let bound = context.bound(self.range);
        if bit {
            self.low += u64::from(bound);
            self.range -= bound;
        } else {
            self.range = bound;
        }
        context.adapt(bit);
        self.normalise();
        bit
    }

    fn even_bit(&mut self, bit: bool) -> bool {
        self.range >>= 1;
        if bit {
            self.low += u64::from(self.range);
        }
        self.normalise();
        bit
    }

    fn overrun(&self) -> bool {
        false
    }
}

/// Reads bits.
pub(crate) struct Decoder<'a> {
    code: u32,
    range: u32,
    rest: &'a [u8],
    zeros: usize,
}

impl<'a> Decoder<'a> {
    /// Of a payload; `None` if it cannot be one (its first byte is not 0).
    pub(crate) fn new(payload: &'a [u8]) -> Option<Self> {
        let mut decoder = Self { code: 0, range: u32::MAX, rest: payload, zeros: 0 };
        if decoder.next() != 0 {
            return None;
        }
        for _ in 0..4 {
            decoder.code = decoder.code << 8 | u32::from(decoder.next());
        }
        Some(decoder)
    }

    fn next(&mut self) -> u8 {
        match self.rest.split_first() {
            Some((&byte, rest)) => {
                self.rest = rest;
                byte
            }
            None => {
                self.zeros += 1;
                0
            }
        }
    }

    fn normalise(&mut self) {
        while self.range < TOP {
            self.range <<= 8;
            self.code = self.code << 8 | u32::from(self.next());
        }
    }

    /// Whether all bytes were used.
    pub(crate) fn at_end(&self) -> bool {
        self.rest.is_empty()
    }
}

impl BitCoder for Decoder<'_> {
    fn bit(&mut self, context: &mut Context, _: bool) -> bool {
        let bound = context.bound(self.range);
        let bit = self.code >= bound;
        if bit {
            self.code -= bound;
            self.range -= bound;
        } else {
            self.range = bound;
        }
        context.adapt(bit);
        self.normalise();
        bit
    }

    fn even_bit(&mut self, _: bool) -> bool {
        self.range >>= 1;
        let bit = self.code >= self.range;
        if bit {
            self.code -= self.range;
        }
        self.normalise();
        bit
    }

    fn overrun(&self) -> bool {
        self.zeros > IMPLICIT_ZEROS
    }
}

/// Contexts of a signed number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SignedContexts {
    nonzero: Context,
    negative: Context,
    more: [Context; UNARY],
}

/// Unary bits of a magnitude before its rest is coded as Exp-Golomb.
const UNARY: usize = 14;
/// Leading ones of that Exp-Golomb code: magnitudes go up to 15 + 2^29 − 2.
const GOLOMB_ONES: u32 = 28;
/// The largest magnitude that can be coded.
pub(crate) const MAX_MAGNITUDE: i64 = UNARY as i64 + (1 << (GOLOMB_ONES + 1)) - 1;

impl SignedContexts {
    pub(crate) const NEW: Self =
        Self { nonzero: Context::NEW, negative: Context::NEW, more: [Context::NEW; UNARY] };

    /// Codes a number of at most [`MAX_MAGNITUDE`]; `None` when what is read is longer.
    pub(crate) fn code(&mut self, coder: &mut impl BitCoder, value: i64) -> Option<i64> {
        if !coder.bit(&mut self.nonzero, value != 0) {
            return Some(0);
        }
        let negative = coder.bit(&mut self.negative, value < 0);
        let wanted = value.abs() - 1;
        let mut magnitude = 0;
        while magnitude < UNARY as i64
            && coder.bit(&mut self.more[magnitude as usize], magnitude < wanted)
        {
            magnitude += 1;
        }
        if magnitude == UNARY as i64 {
            magnitude += golomb(coder, wanted - magnitude)?;
        }
        let magnitude = magnitude + 1;
        Some(if negative { -magnitude } else { magnitude })
    }
}

/// Exp-Golomb of order 0: as many ones as value + 1 has bits after its first, a zero, those bits.
fn golomb(coder: &mut impl BitCoder, value: i64) -> Option<i64> {
    let wanted = (value + 1).max(1);
    let mut bits = 0;
    while coder.even_bit(wanted >> (bits + 1) != 0) {
        bits += 1;
        if bits > GOLOMB_ONES {
            return None;
        }
    }
    let mut result = 1;
    for bit in (0..bits).rev() {
        result = result << 1 | i64::from(coder.even_bit(wanted >> bit & 1 != 0));
    }
    Some(result - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_round_trip() {
        let numbers: Vec<i64> = (-40..40)
            .chain([1000, -70_000, MAX_MAGNITUDE, -MAX_MAGNITUDE, 0, 0, 0])
            .chain((0..5000).map(|i| i64::from(i % 97 == 0)))
            .collect();
        let mut encoder = Encoder::new(Vec::new());
        let mut contexts = SignedContexts::NEW;
        for &n in &numbers {
            assert_eq!(contexts.code(&mut encoder, n), Some(n));
        }
        let bytes = encoder.finish();
        let mut decoder = Decoder::new(&bytes).unwrap();
        let mut contexts = SignedContexts::NEW;
        for &n in &numbers {
            assert_eq!(contexts.code(&mut decoder, 0), Some(n));
        }
        assert!(decoder.at_end() && !decoder.overrun());
    }

    #[test]
    fn a_long_run_of_likely_bits_costs_almost_nothing() {
        let mut encoder = Encoder::new(Vec::new());
        let mut context = Context::NEW;
        for _ in 0..100_000 {
            encoder.bit(&mut context, true);
        }
        // Adaptation by 1/64 stops 64 + 32 short of 65536: 0.0021 bits each, 26 bytes in all.
        assert!(encoder.finish().len() < 36);
    }

    #[test]
    fn carries_run_through_pending_bytes() {
        // Bits of probability ½ that are all 1 drive `low` to all ones; a last unlikely bit carries.
        for ones in 0..200 {
            let mut encoder = Encoder::new(Vec::new());
            let mut skewed = Context { zero: 65000, seen: 5 };
            for _ in 0..ones {
                encoder.even_bit(true);
            }
            encoder.bit(&mut skewed, true);
            encoder.even_bit(false);
            let bytes = encoder.finish();
            let mut decoder = Decoder::new(&bytes).unwrap();
            let mut skewed = Context { zero: 65000, seen: 5 };
            for _ in 0..ones {
                assert!(decoder.even_bit(false));
            }
            assert!(decoder.bit(&mut skewed, false));
            assert!(!decoder.even_bit(false));
        }
    }

    #[test]
    fn reading_past_the_end_is_noticed() {
        let mut decoder = Decoder::new(&[]).unwrap();
        for _ in 0..8 * (IMPLICIT_ZEROS + 2) {
            decoder.even_bit(false);
        }
        assert!(decoder.overrun());
    }
}
