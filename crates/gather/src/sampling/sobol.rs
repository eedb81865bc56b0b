//! Random numbers for paths: Owen-scrambled Sobol points, padded two dimensions at a time. The
//! sample index is shuffled anew for each pair (Burley 2020, "Practical hash-based Owen
//! scrambling").
//!
//! Every number is a function of seed, receiver, sample and the number of draws so far. So results
//! do not depend on which thread computes what.

use glam::Vec2;

use super::{ONE_MINUS_EPSILON, mix, mix2};

use crate::numbers::numbers;

/// The random numbers of one path.
#[derive(Clone, Debug)]
pub(crate) struct Sampler {
    /// Hash of seed and receiver, which selects the sequence.
    sequence: u64,
    /// Index of the sample, with its bits reversed.
    reversed: u32,
    drawn: u64,
}

impl Sampler {
    #[inline]
    pub(crate) fn new(seed: u64, receiver: u32, sample: u32) -> Self {
        let reversed = sample.reverse_bits();
        Self { sequence: mix2(seed, u64::from(receiver)), reversed, drawn: 0 }
    }

    /// A point of the unit square. The points of a receiver's samples are well spread.
    #[inline]
    pub(crate) fn square(&mut self) -> Vec2 {
        self.draw().square()
    }

    /// A number in [0, 1). The numbers of a receiver's samples are well spread.
    #[inline]
    pub(crate) fn number(&mut self) -> f32 {
        self.draw().number()
    }

    /// A sampler of another sequence for the same path; drawing from it does not change this one's
    /// numbers.
    #[inline]
    pub(crate) fn aside(&self) -> Self {
        Self { sequence: mix(!self.sequence), reversed: self.reversed, drawn: 0 }
    }

    /// A key of this path, for decisions by hash.
    #[inline]
    pub(crate) fn key(&self) -> u64 {
        mix2(self.sequence, u64::from(self.reversed))
    }

    /// Advances the sampler; the result computes the next number or point.
    #[inline(always)]
    pub(crate) fn draw(&mut self) -> Draw {
        self.drawn += 1;
        let key = self.sequence.wrapping_add(self.drawn.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let scramble = mix(key);
        let order = (scramble.wrapping_mul(0x5851_f42d_4c95_7f2d) >> 32) as u32;
        let reversed = self.reversed;
        Draw { reversed, order, scramble: [scramble as u32, (scramble >> 32) as u32] }
    }
}

/// A number or a point of the unit square that is computed on demand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw {
    reversed: u32,
    order: u32,
    scramble: [u32; 2],
}

numbers!(Draw of u32 { reversed: u32, order: u32, scramble: pair });

impl Draw {
    #[inline(always)]
    pub(crate) fn number(self) -> f32 {
        let i = shuffled(self.reversed, self.order);
        unit(owen_reversed(i, self.scramble[0]).reverse_bits())
    }

    #[inline(always)]
    pub(crate) fn square(self) -> Vec2 {
        let i = shuffled(self.reversed, self.order);
        let x = owen_reversed(i, self.scramble[0]).reverse_bits();
        let y = owen_reversed(sobol_reversed(i), self.scramble[1]).reverse_bits();
        Vec2::new(unit(x), unit(y))
    }
}

#[inline(always)]
fn unit(bits: u32) -> f32 {
    (bits as f32 * (1.0 / 4_294_967_296.0)).min(ONE_MINUS_EPSILON)
}

/// The sample's index in the shuffled order. The Owen scramble of the index keeps every prefix of a
/// power of two well spread.
#[inline(always)]
fn shuffled(reversed: u32, key: u32) -> u32 {
    owen_reversed(reversed, key).reverse_bits()
}

/// Owen scrambling of a fraction: each bit changes depending on the bits above it. In reversed
/// order those are the bits below, and carries propagate upwards from them (Laine and Karras 2011;
/// constants by Vegdahl). Bit 0 of the input is the fraction's first bit.
#[inline(always)]
fn owen_reversed(reversed: u32, key: u32) -> u32 {
    let mut x = reversed;
    x = x.wrapping_add(key);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x
}

/// The second Sobol dimension in reversed bits: the index times Pascal's triangle mod 2. That
/// product takes five steps (Ahmed 2024).
#[inline(always)]
fn sobol_reversed(index: u32) -> u32 {
    let mut x = index;
    x ^= (x & 0xffff_0000) >> 16;
    x ^= (x & 0xff00_ff00) >> 8;
    x ^= (x & 0xf0f0_f0f0) >> 4;
    x ^= (x & 0xcccc_cccc) >> 2;
    x ^= (x & 0xaaaa_aaaa) >> 1;
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The textbook construction: direction numbers of the polynomial x + 1.
    fn sobol_by_matrix(index: u32) -> u32 {
        let mut v = 1u32 << 31;
        let mut x = 0;
        for bit in 0..32 {
            if index >> bit & 1 == 1 {
                x ^= v;
            }
            v ^= v >> 1;
        }
        x
    }

    #[test]
    fn second_dimension_is_sobols() {
        for index in (0..4096).chain([0xdead_beef, u32::MAX, 1 << 31]) {
            assert_eq!(sobol_reversed(index).reverse_bits(), sobol_by_matrix(index), "{index}");
        }
    }

    /// Of 256 points, every elementary interval of area 1/256 holds exactly one.
    #[test]
    fn pairs_are_a_0_2_net() {
        for draw in 0..3 {
            for (wide, high) in [(256, 1), (64, 4), (16, 16), (4, 64), (1, 256)] {
                let mut seen = vec![0; 256];
                for sample in 0..256 {
                    let mut sampler = Sampler::new(7, 3, sample);
                    let mut p = sampler.square();
                    for _ in 0..draw {
                        p = sampler.square();
                    }
                    let cell = (p * Vec2::new(wide as f32, high as f32)).floor();
                    seen[cell.y as usize * wide + cell.x as usize] += 1;
                }
                assert!(seen.iter().all(|&n| n == 1), "draw {draw}, {wide}×{high}: {seen:?}");
            }
        }
    }

    #[test]
    fn dimensions_are_independent() {
        let n = 4096;
        let mut products = [0.0f64; 3];
        for sample in 0..n {
            let mut s = Sampler::new(1, 1, sample);
            let (a, b, c) = (s.square(), s.square(), s.number());
            for (sum, (p, q)) in products.iter_mut().zip([(a.x, b.x), (a.y, c), (b.x, c)]) {
                *sum += f64::from((p - 0.5) * (q - 0.5));
            }
        }
        // Independent uniforms: mean 0, standard deviation 1/(12·√n).
        let sigma = 1.0 / (12.0 * f64::from(n).sqrt());
        for p in products {
            assert!((p / f64::from(n)).abs() < 4.0 * sigma, "{products:?}");
        }
    }
}
