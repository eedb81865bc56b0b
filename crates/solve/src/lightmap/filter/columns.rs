//! Lumels that are filtered.

use std::ops::Range;

use glam::Vec3;
use lumencast_light::luminance;

/// A lumel that is filtered. One that nothing is known of has no samples: it takes the light of those about
/// it, and gives none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noisy {
    /// World, metres.
    pub(crate) position: Vec3,
    /// World, unit.
    pub(crate) normal: Vec3,
    pub(crate) irradiance: Vec3,
    /// Its slope times its luminance; 0 where it is not known.
    pub(crate) slope: Vec3,
    /// Variance of the mean's luminance.
    pub(crate) variance: f32,
    pub(crate) samples: f32,
}

impl Noisy {
    pub(crate) fn is_known(&self) -> bool {
        self.samples > 0.0
    }
}

/// Lumels as columns of numbers, row after row of a window: what is done to many of them at a time is
/// done by vectors. Rows follow one another without a gap, so what lies beyond the end of a row is the
/// next one's beginning: lumels within reach of a border are wrong.
pub(super) struct Columns {
    pub(super) side: usize,
    pub(super) position: [Vec<f32>; 3],
    /// Zero where there is no lumel: nothing faces as it does.
    pub(super) normal: [Vec<f32>; 3],
    /// Irradiance, and the slope where any lumel has one.
    pub(super) values: Vec<Vec<f32>>,
    /// 0 where nothing is known, as its variance.
    pub(super) luminance: Vec<f32>,
    pub(super) variance: Vec<f32>,
    /// 0 where nothing is known.
    pub(super) samples: Vec<f32>,
    /// 1 where something is known, 0 elsewhere.
    pub(super) known: Vec<f32>,
}

impl Columns {
    pub(super) fn new(window: &[Option<Noisy>], side: usize) -> Self {
        let column = |of: &dyn Fn(&Noisy) -> f32| -> Vec<f32> {
            window.iter().map(|lumel| lumel.as_ref().map_or(0.0, of)).collect()
        };
        let known = |of: &dyn Fn(&Noisy) -> f32| {
            column(&|lumel| if lumel.is_known() { of(lumel) } else { 0.0 })
        };
        let three = |of: &dyn Fn(&Noisy) -> Vec3| [0, 1, 2].map(|k| column(&|lumel| of(lumel)[k]));
        let mut values: Vec<Vec<f32>> = three(&|lumel| lumel.irradiance).into();
        if window.iter().flatten().any(|lumel| lumel.slope != Vec3::ZERO) {
            values.extend(three(&|lumel| lumel.slope));
        }
        Self {
            side,
            position: three(&|lumel| lumel.position),
            normal: three(&|lumel| lumel.normal),
            values,
            luminance: known(&|lumel| luminance(lumel.irradiance)),
            variance: known(&|lumel| lumel.variance),
            samples: column(&|lumel| lumel.samples),
            known: column(&|lumel| f32::from(lumel.is_known())),
        }
    }

    /// Puts what is known of a lumel there.
    pub(super) fn put(&self, number: usize, lumel: &mut Noisy) {
        let three = |first: usize| {
            let values = self.values.get(first..first + 3)?;
            Some(Vec3::from_array([0, 1, 2].map(|k| values[k][number])))
        };
        lumel.irradiance = three(0).unwrap_or_default();
        lumel.slope = three(3).unwrap_or_default();
        lumel.variance = self.variance[number];
        lumel.samples = self.samples[number];
    }
}

/// Some numbers of three columns.
#[inline(always)]
pub(super) fn part<'a>(columns: &'a [Vec<f32>; 3], range: &Range<usize>) -> [&'a [f32]; 3] {
    [0, 1, 2].map(|k| &columns[k][range.clone()])
}
