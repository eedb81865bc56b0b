//! Light → frames, region by region.

use glam::{UVec3, Vec3};
use lumencast_light::{Order, ProbeVolume, ScaleRule};

use super::header::ProbeHeader;
use super::model::{Choices, Reconstruction, code_region};
use super::quantise::{from_rgb, step, step_index};
use super::regions::{Region, regions};
use crate::range_coder::{Encoder, MAX_MAGNITUDE};
use crate::{EncodedRegion, UpdateInfo};

// The three that follow were chosen by `examples/measure`: of many combinations those that cost the
// fewest bytes at an error of 0.55 % of c0's length, which is 0.95 % of a grey probe's c0 a channel.

/// Step over the length of a probe's c0.
const STEP_OF_C0: f64 = 0.021;
/// A residual rounds up from this fraction on: the nearest would be 0.5, but small values cost more
/// bits than they mend. It bounds the error of a value in steps.
const ROUND_UP_FROM: f64 = 0.64;
/// A probe is left as it is while its root-mean-square error is below this fraction of c0's length.
const SKIP_BELOW: f64 = 0.0055;
/// How many indices (quarters of an octave) a probe's step may be finer than needed before it
/// follows the probe's c0.
const FINER: i32 = 2;
/// Below this fraction of the field's scale, light is dark: half floats hold no less.
const DARK: f64 = 1.0 / 16_777_216.0;
/// Every so many frames of layer 0 one is a keyframe.
const KEYFRAME_EVERY: u64 = 10;

/// Encodes the updates of one field.
///
/// Costs, in memory: two reconstructions of the field (12 bytes a coefficient each).
#[derive(Clone, Debug)]
pub struct ProbeEncoder {
    resolution: UVec3,
    order: Order,
    scale: ScaleRule,
    regions: Vec<RegionState>,
}

#[derive(Clone, Debug)]
struct RegionState {
    region: Region,
    /// The newest update of layers 0 and 1 with what decoders make of it.
    bases: [Option<(u64, Reconstruction)>; 2],
    /// Layers whose next frame begins a group, since layer 0 had a keyframe.
    new_group: [bool; 3],
    scale_log2: i8,
}

impl ProbeEncoder {
    /// For a field of `resolution` cells.
    pub fn new(resolution: UVec3, order: Order) -> Self {
        let regions = regions(resolution)
            .into_iter()
            .map(|region| RegionState {
                region,
                bases: [None, None],
                new_group: [true; 3],
                scale_log2: 0,
            })
            .collect();
        Self { resolution, order, scale: ScaleRule::default(), regions }
    }

    /// The regions, as the catalog lists them.
    pub fn regions(&self) -> impl Iterator<Item = Region> + '_ {
        self.regions.iter().map(|state| state.region)
    }

    /// log2 of the field's scale after the last update; none before there was any light.
    pub fn scale_log2(&self) -> Option<i8> {
        self.scale.log2()
    }

    /// Encodes an update for the regions that somebody watches. A region newly watched begins at
    /// the next update of layer 0, with a keyframe. Coefficients that are not finite count as 0.
    ///
    /// # Panics
    /// If `volume` is not of the resolution and order given to [`ProbeEncoder::new`].
    pub fn encode(
        &mut self,
        volume: &ProbeVolume,
        info: UpdateInfo,
        watched: impl Fn(u32) -> bool,
    ) -> Vec<EncodedRegion> {
        assert_eq!((volume.grid.resolution, volume.order), (self.resolution, self.order));
        let scale_log2 = self.scale.update(&volume.coefficients);
        let mut frames = Vec::with_capacity(self.regions.len());
        for state in &mut self.regions {
            if watched(state.region.id) {
                frames.extend(state.encode(volume, info, scale_log2));
            } else {
                state.bases = [None, None];
            }
        }
        frames
    }
}

impl RegionState {
    fn encode(
        &mut self,
        volume: &ProbeVolume,
        info: UpdateInfo,
        scale_log2: i8,
    ) -> Option<EncodedRegion> {
        let layer = info.layer();
        if self.base(info).is_none() {
            if layer != 0 {
                return None;
            }
            self.new_group = [true; 3];
            self.scale_log2 = scale_log2;
        }
        let base = self.base(info);
        let header = ProbeHeader {
            info,
            base: base.map(|(update, _)| *update),
            scale_log2: self.scale_log2,
            order: volume.order,
            size: self.region.size,
        };
        let (bytes, reconstruction, error) =
            encode_region(volume, self.region, &header, base.map(|(_, r)| r));
        let new_group = std::mem::take(&mut self.new_group[usize::from(layer)]);
        if let Some(slot) = self.bases.get_mut(usize::from(layer)) {
            *slot = Some((info.update, reconstruction));
        }
        Some(EncodedRegion { region: self.region.id, layer, new_group, bytes, error })
    }

    /// The newest reconstruction of the own or a lower layer; none where a keyframe is due.
    fn base(&self, info: UpdateInfo) -> Option<&(u64, Reconstruction)> {
        let layer = usize::from(info.layer());
        if layer == 0
            && (info.update / 4 + u64::from(self.region.id)).is_multiple_of(KEYFRAME_EVERY)
        {
            return None;
        }
        self.bases[..=layer.min(1)]
            .iter()
            .flatten()
            .filter(|(update, _)| (1..=255).contains(&info.update.wrapping_sub(*update)))
            .max_by_key(|(update, _)| *update)
    }
}

/// The frame of a region, what decoders will make of it, and its error.
fn encode_region(
    volume: &ProbeVolume,
    region: Region,
    header: &ProbeHeader,
    base: Option<&Reconstruction>,
) -> (Vec<u8>, Reconstruction, f32) {
    let mut choices = Quantiser::new(volume, region, header.scale_log2);
    let mut bytes = Vec::with_capacity(64 + 4 * region.probe_count());
    header.write(&mut bytes);
    let mut encoder = Encoder::new(bytes);
    let reconstruction = code_region(&mut encoder, region.size, volume.order, base, &mut choices)
        .expect("the quantiser chooses only what can be coded");
    let error = choices.error(&reconstruction);
    (encoder.finish(), reconstruction, error)
}

/// Chooses steps and residuals for given light.
struct Quantiser {
    /// (a, b, c) of each coefficient, probe by probe.
    targets: Vec<[f64; 3]>,
    /// Length of each probe's c0, no less than what counts as dark.
    brightness: Vec<f64>,
    coefficients: usize,
}

impl Quantiser {
    fn new(volume: &ProbeVolume, region: Region, scale_log2: i8) -> Self {
        let coefficients = volume.order.coefficients();
        let dark = DARK * f64::from(scale_log2).exp2();
        let mut targets = Vec::with_capacity(region.probe_count() * coefficients);
        let mut brightness = Vec::with_capacity(region.probe_count());
        for probe in region.probes(volume.grid.resolution) {
            let first = targets.len();
            targets.extend(volume.probe(probe).iter().map(|&c| from_rgb(sane(c))));
            let c0: [f64; 3] = targets[first];
            brightness.push(length(&c0).max(dark));
        }
        Self { targets, brightness, coefficients }
    }

    fn target(&self, probe: usize) -> &[[f64; 3]] {
        &self.targets[probe * self.coefficients..][..self.coefficients]
    }

    fn error(&self, reconstruction: &Reconstruction) -> f32 {
        let sum: f64 = self
            .brightness
            .iter()
            .enumerate()
            .map(|(probe, brightness)| {
                let values = reconstruction.probe(probe, self.coefficients);
                squared_distance(self.target(probe), values) / (brightness * brightness)
            })
            .sum();
        (sum / (3 * self.targets.len()) as f64).sqrt() as f32
    }
}

impl Choices for Quantiser {
    fn skip(&mut self, probe: usize, base: &[[f32; 3]], base_step: i32) -> bool {
        let brightness = self.brightness[probe];
        let target = self.target(probe);
        let tolerated = SKIP_BELOW * brightness;
        let mean_square = squared_distance(target, base) / (3 * self.coefficients) as f64;
        mean_square < tolerated * tolerated
            && largest_distance(target, base.iter().map(|v| v.map(f64::from)))
                <= STEP_OF_C0 * brightness
            && step(base_step) < 2.0 * STEP_OF_C0 * brightness
    }

    fn step(&mut self, probe: usize, predicted: &[[f64; 3]], predicted_step: i32) -> i32 {
        let coarsest = step_index(STEP_OF_C0 * self.brightness[probe]);
        let farthest = largest_distance(self.target(probe), predicted.iter().copied());
        let finest = step_index(farthest / MAX_MAGNITUDE as f64) + 2;
        let wanted = if (coarsest - FINER..=coarsest).contains(&predicted_step) {
            predicted_step
        } else {
            coarsest
        };
        wanted.max(finest)
    }

    fn residual(&mut self, probe: usize, i: usize, k: usize, predicted: f64, step: f64) -> i64 {
        let steps = (self.target(probe)[i][k] - predicted) / step;
        let magnitude = (steps.abs() + (1.0 - ROUND_UP_FROM)).floor() as i64;
        if steps < 0.0 { -magnitude } else { magnitude }
    }
}

/// The largest coefficient that is coded, cd/m².
const BRIGHTEST: f32 = 1e18;

/// Finite and within what steps can express.
fn sane(c: Vec3) -> Vec3 {
    if c.is_finite() {
        c.clamp(Vec3::splat(-BRIGHTEST), Vec3::splat(BRIGHTEST))
    } else {
        Vec3::ZERO
    }
}

fn length(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn squared_distance(target: &[[f64; 3]], values: &[[f32; 3]]) -> f64 {
    let square = |(t, v): (&[f64; 3], &[f32; 3])| -> f64 {
        (0..3).map(|k| (t[k] - f64::from(v[k])).powi(2)).sum()
    };
    target.iter().zip(values).map(square).sum()
}

/// The largest difference of two values.
fn largest_distance(target: &[[f64; 3]], values: impl Iterator<Item = [f64; 3]>) -> f64 {
    target
        .iter()
        .zip(values)
        .flat_map(|(t, v)| (0..3).map(move |k| (t[k] - v[k]).abs()))
        .fold(0.0, f64::max)
}
