//! How bright a picture on the device is.

use lumencast_shaders::layout::meter::{BINS, BINS_A_STOP, LEAST};
use lumencast_shaders::meter;

use crate::bindings;
use crate::gpu::Gpu;
use crate::readback::Readback;
use crate::timing::{Commands, Stage};

/// Bytes of a histogram.
const SIZE: u64 = (BINS * size_of::<u32>()) as u64;
/// Pixels along the side of what a workgroup counts.
const SQUARE: u32 = 16;

/// Counts how bright pixels are.
#[derive(Debug)]
pub(crate) struct Meter {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
    histogram: wgpu::Buffer,
}

impl Meter {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let types = [bindings::PICTURE, bindings::WRITTEN];
        let (layout, pipeline) = gpu.compute("meter", meter(), "meter", &types);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let histogram = gpu.buffer("histogram", usage, &[], SIZE);
        Self { layout, pipeline, histogram }
    }

    /// Measures a picture; the histogram will be in the buffer returned.
    pub(crate) fn measure(
        &self,
        gpu: &Gpu,
        commands: &mut Commands,
        picture: &wgpu::TextureView,
    ) -> wgpu::Buffer {
        let size = picture.texture().size();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("meter"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(picture),
                },
                wgpu::BindGroupEntry { binding: 1, resource: self.histogram.as_entire_binding() },
            ],
        });
        commands.encoder.clear_buffer(&self.histogram, 0, None);
        let (encoder, timestamp_writes) = commands.compute_pass(Stage::Screen);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("meter"),
            timestamp_writes,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(size.width.div_ceil(SQUARE), size.height.div_ceil(SQUARE), 1);
        drop(pass);
        let read = Readback::buffer(gpu, "histogram", SIZE);
        commands.encoder.copy_buffer_to_buffer(&self.histogram, 0, &read, 0, SIZE);
        read
    }
}

/// What the middle of a picture's luminances becomes.
const MIDDLE_GREY: f64 = 0.2;
/// The pixels that count as its middle, of those that are lit.
const MIDDLE: std::ops::Range<f64> = 0.1..0.95;
/// So large a share of the lit pixels is to stay below [`BURNT`].
const KEPT: f64 = 0.97;
/// Three times white.
const BURNT: f64 = 3.0;
/// A picture of which less is lit says nothing.
const LEAST_LIT: f64 = 0.02;

/// The exposure that suits a picture: the middle of its luminances becomes middle grey, unless that
/// would burn out more than a few per cent of it. To a part of a bin; `None` where (nearly) all is
/// black.
pub(crate) fn exposure(histogram: &[u32]) -> Option<f32> {
    let all: f64 = histogram.iter().map(|n| f64::from(*n)).sum();
    let lit = all - histogram.first().map_or(0.0, |n| f64::from(*n));
    if lit <= LEAST_LIT * all {
        return None;
    }
    let middle = MIDDLE.start * lit..MIDDLE.end * lit;
    let (mut below, mut sum, mut bright) = (0.0, 0.0, 0.0);
    for (bin, count) in histogram.iter().enumerate().skip(1) {
        let count = f64::from(*count);
        // Of its middle.
        let stops = f64::from(LEAST) + (bin as f64 - 0.5) / f64::from(BINS_A_STOP);
        let counted = (below + count).min(middle.end) - below.max(middle.start);
        sum += stops * counted.max(0.0);
        if below <= KEPT * lit && count > 0.0 {
            bright = stops;
        }
        below += count;
    }
    let average = (sum / (middle.end - middle.start)).exp2();
    Some((MIDDLE_GREY / average).min(BURNT / bright.exp2()) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bin_of(luminance: f32) -> usize {
        (BINS_A_STOP * (luminance.log2() - LEAST)).floor() as usize + 1
    }

    fn of(lit: &[(f32, u32)], black: u32) -> Option<f32> {
        let mut histogram = [0; BINS];
        histogram[0] = black;
        lit.iter().for_each(|(luminance, count)| histogram[bin_of(*luminance)] += count);
        exposure(&histogram)
    }

    #[track_caller]
    fn close(found: Option<f32>, expected: f32) {
        let found = found.expect("there is light");
        assert!((found / expected).log2().abs() < 1.0 / BINS_A_STOP, "{found} for {expected}");
    }

    #[test]
    fn the_middle_becomes_middle_grey() {
        close(of(&[(5.0, 1000)], 0), 0.04);
        // What is black around it does not count.
        close(of(&[(5.0, 1000)], 9000), 0.04);
        // Nor do a few lamps and dark corners.
        close(of(&[(1.0, 950), (1000.0, 20), (0.001, 30)], 0), 0.2);
    }

    #[test]
    fn bright_parts_are_not_burnt_out() {
        // A tenth of the picture is 1,000 times as bright as the rest.
        close(of(&[(1.0, 900), (1000.0, 100)], 0), 3.0 / 1000.0);
    }

    #[test]
    fn black_says_nothing() {
        assert_eq!(of(&[], 0), None);
        assert_eq!(of(&[], 1000), None);
        assert_eq!(of(&[(1.0, 10)], 1000), None);
    }
}
