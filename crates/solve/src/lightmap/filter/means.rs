//! Means over neighbours.

use std::ops::Range;

use lumencast_light::luminance;

use super::columns::Columns;
use super::numbers::{add, after, before, long};
use super::pairs::Pairs;
use super::taps::Tap;

/// Weighted sums over neighbours.
pub(super) struct Means {
    wanted: Range<usize>,
    values: Vec<Vec<f32>>,
    variance: Vec<f32>,
    samples: Vec<f32>,
    weights: Vec<f32>,
    /// Weights of one neighbour each.
    buffer: Vec<f32>,
}

impl Means {
    /// Those of wanted lumels alone.
    #[inline(always)]
    pub(super) fn new(of: &Columns, wanted: Range<usize>) -> Self {
        let column = || vec![0.0; wanted.len()];
        let values = of.values.iter().map(|_| column()).collect();
        let [variance, samples, weights, mut buffer] = [0, 1, 2, 3].map(|_| column());
        let kernel = Tap::OWN.kernel();
        for (weight, samples) in buffer.iter_mut().zip(&of.samples[wanted.clone()]) {
            *weight = kernel * samples;
        }
        let mut means = Self { wanted, values, variance, samples, weights, buffer };
        let wanted = means.wanted.clone();
        means.add_up(of, wanted.clone(), wanted);
        means
    }

    /// Adds those a shift on, and those a shift back.
    #[inline(always)]
    pub(super) fn add(&mut self, of: &Columns, pairs: &Pairs, shift: usize, kernel: f32) {
        let Range { start, end } = self.wanted;
        let on = start..end.min(of.samples.len() - shift);
        let back = start.max(shift)..end;
        for (here, there, pair) in [
            (on.clone(), after(&on, shift), on),
            (back.clone(), before(&back, shift), before(&back, shift)),
        ] {
            let (beside, alike) = (&pairs.beside[pair.clone()], &pairs.alike[pair]);
            let (known, samples) = (&of.known[here.clone()], &of.samples[there.clone()]);
            let weights = &mut self.buffer[..here.len()];
            let [beside, alike, known, samples] =
                long([beside, alike, known, samples], weights.len());
            for (i, weight) in weights.iter_mut().enumerate() {
                // Where nothing is known, all light is welcome.
                let welcome = 1.0 + known[i] * (alike[i] - 1.0);
                *weight = kernel * beside[i] * welcome * samples[i];
            }
            self.add_up(of, here, there);
        }
    }

    /// Adds what neighbours tell, by their weights in the buffer.
    #[inline(always)]
    fn add_up(&mut self, of: &Columns, here: Range<usize>, there: Range<usize>) {
        let into = before(&here, self.wanted.start);
        let weights = &self.buffer[..here.len()];
        for (sums, values) in self.values.iter_mut().zip(&of.values) {
            add(&mut sums[into.clone()], &values[there.clone()], weights);
        }
        add(&mut self.samples[into.clone()], &of.samples[there.clone()], weights);
        let variance = self.variance[into.clone()].iter_mut().zip(&of.variance[there]);
        for ((sum, variance), weight) in variance.zip(weights) {
            *sum += weight * weight * variance;
        }
        self.weights[into].iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight);
    }

    /// Puts the means in place of what they are means of.
    #[inline(always)]
    pub(super) fn put(self, into: &mut Columns) {
        for (i, at) in self.wanted.enumerate() {
            let weight = self.weights[i];
            if weight > 0.0 {
                for (value, sums) in into.values.iter_mut().zip(&self.values) {
                    value[at] = sums[i] / weight;
                }
                into.variance[at] = self.variance[i] / (weight * weight);
                into.samples[at] = self.samples[i] / weight;
                into.known[at] = 1.0;
                let irradiance = [0, 1, 2].map(|k| into.values[k][at]);
                into.luminance[at] = luminance(irradiance.into());
            }
        }
    }
}
