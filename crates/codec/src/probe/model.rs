//! The model of a region's values: which numbers are coded, in which order, with which predictions
//! and contexts (docs/wire.md, "What is coded"). Encoder and decoder both walk it.

use glam::UVec3;
use lumencast_light::{Order, sh::MAX_COEFFICIENTS};

use super::quantise::{MAX_STEP, step};
use crate::DecodeError;
use crate::range_coder::{BitCoder, Context, SignedContexts};

/// What encoder and decoder agree that a region holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Reconstruction {
    /// (a, b, c) of each coefficient, probe by probe.
    pub(crate) values: Vec<[f32; 3]>,
    /// Step index of each probe.
    pub(crate) steps: Vec<i16>,
}

impl Reconstruction {
    pub(crate) fn probe(&self, index: usize, coefficients: usize) -> &[[f32; 3]] {
        &self.values[index * coefficients..][..coefficients]
    }
}

/// What an encoder decides; a decoder's answers are ignored.
pub(crate) trait Choices {
    /// Whether to leave a probe as it is in the base.
    fn skip(&mut self, probe: usize, base: &[[f32; 3]], base_step: i32) -> bool;
    /// The step index of a probe that is coded, given its predicted values.
    fn step(&mut self, probe: usize, predicted: &[[f64; 3]], predicted_step: i32) -> i32;
    /// The residual of a value, in steps.
    fn residual(
        &mut self,
        probe: usize,
        coefficient: usize,
        channel: usize,
        predicted: f64,
        step: f64,
    ) -> i64;
}

/// The choices of a decoder: none.
pub(crate) struct Given;

impl Choices for Given {
    fn skip(&mut self, _: usize, _: &[[f32; 3]], _: i32) -> bool {
        false
    }

    fn step(&mut self, _: usize, _: &[[f64; 3]], _: i32) -> i32 {
        0
    }

    fn residual(&mut self, _: usize, _: usize, _: usize, _: f64, _: f64) -> i64 {
        0
    }
}

/// Contexts of a frame.
struct Contexts {
    skip: [Context; 3],
    step: SignedContexts,
    /// By channel (a; b or c), band, neighbourhood.
    residual: [[[SignedContexts; 3]; 5]; 2],
}

/// Residuals of a probe, for the next one's contexts.
type Residuals = [[i64; 3]; MAX_COEFFICIENTS];

/// Codes one region, in the direction of `coder`.
pub(crate) fn code_region<C: BitCoder>(
    coder: &mut C,
    size: UVec3,
    order: Order,
    base: Option<&Reconstruction>,
    choices: &mut impl Choices,
) -> Result<Reconstruction, DecodeError> {
    let size = size.as_usizevec3();
    let (count, n) = (size.element_product(), order.coefficients());
    let mut contexts = Contexts {
        skip: [Context::NEW; 3],
        step: SignedContexts::NEW,
        residual: [[[SignedContexts::NEW; 3]; 5]; 2],
    };
    let mut region =
        Reconstruction { values: Vec::with_capacity(count * n), steps: Vec::with_capacity(count) };
    let mut skipped = vec![false; count];
    let mut previous: Residuals = [[0; 3]; MAX_COEFFICIENTS];
    for probe in 0..count {
        if coder.overrun() {
            return Err(DecodeError::Truncated);
        }
        let (x, y) = (probe % size.x, probe / size.x % size.y);
        let z = probe / (size.x * size.y);
        // The neighbours before this one, at x−1, y−1, z−1.
        let before = [
            (x > 0).then(|| probe - 1),
            (y > 0).then(|| probe - size.x),
            (z > 0).then(|| probe - size.x * size.y),
        ];
        let mut predicted = [[0.0_f64; 3]; MAX_COEFFICIENTS];
        let predicted = &mut predicted[..n];
        let predicted_step;
        if let Some(base) = base {
            let values = base.probe(probe, n);
            predicted_step = i32::from(base.steps[probe]);
            let likely = before[..2].iter().flatten().filter(|&&i| skipped[i]).count();
            let skip = choices.skip(probe, values, predicted_step);
            if coder.bit(&mut contexts.skip[likely], skip) {
                skipped[probe] = true;
                region.values.extend_from_slice(values);
                region.steps.push(base.steps[probe]);
                previous = [[0; 3]; MAX_COEFFICIENTS];
                continue;
            }
            for (predicted, value) in predicted.iter_mut().zip(values) {
                *predicted = value.map(f64::from);
            }
        } else {
            predict_from_neighbours(predicted, &region, before);
            predicted_step = if probe > 0 { i32::from(region.steps[probe - 1]) } else { 0 };
        }

        let q = choices.step(probe, predicted, predicted_step);
        let dq = contexts.step.code(coder, i64::from(q - predicted_step));
        let q = dq
            .map(|dq| dq + i64::from(predicted_step))
            .filter(|q| q.abs() <= i64::from(MAX_STEP))
            .ok_or(DecodeError::Malformed("step index"))? as i32;
        region.steps.push(q as i16);
        let step = step(q);

        let mut residuals: Residuals = [[0; 3]; MAX_COEFFICIENTS];
        let mut band = 0;
        for i in 0..n {
            band += usize::from(i == (band + 1) * (band + 1));
            let mut value = [0.0; 3];
            for k in 0..3 {
                let near = if k > 0 {
                    residuals[i][0]
                } else if i > 0 {
                    residuals[i - 1][0]
                } else {
                    0
                };
                let near = (near.abs() + previous[i][k].abs()).min(2) as usize;
                let wanted = choices.residual(probe, i, k, predicted[i][k], step);
                let residual = contexts.residual[usize::from(k > 0)][band][near]
                    .code(coder, wanted)
                    .ok_or(DecodeError::Malformed("residual"))?;
                residuals[i][k] = residual;
                value[k] = (predicted[i][k] + residual as f64 * step) as f32;
                if !value[k].is_finite() {
                    return Err(DecodeError::Malformed("a value is not finite"));
                }
            }
            region.values.push(value);
        }
        previous = residuals;
    }
    if coder.overrun() {
        return Err(DecodeError::Truncated);
    }
    Ok(region)
}

/// Means of the values of the neighbours that there are.
fn predict_from_neighbours(
    predicted: &mut [[f64; 3]],
    region: &Reconstruction,
    before: [Option<usize>; 3],
) {
    let n = predicted.len();
    let count = before.iter().flatten().count();
    if count == 0 {
        return;
    }
    for neighbour in before.into_iter().flatten() {
        for (sum, value) in predicted.iter_mut().zip(region.probe(neighbour, n)) {
            for k in 0..3 {
                sum[k] += f64::from(value[k]);
            }
        }
    }
    for sum in predicted {
        *sum = sum.map(|v| v / count as f64);
    }
}
