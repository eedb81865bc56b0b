//! How bright a picture on the device is.

use lumencast_gpu::{Gpu, Readback, bindings};
use lumencast_shaders::layout::meter::{BINS, BINS_A_STOP, LEAST};
use lumencast_shaders::meter;

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
        let layout = gpu.group_layout("meter", wgpu::ShaderStages::COMPUTE, &types);
        let pipeline = gpu.compute("meter", meter(), "meter", &[&layout]);
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
        let picture = wgpu::BindingResource::TextureView(picture);
        let resources = [picture, self.histogram.as_entire_binding()];
        let group = gpu.group("meter", &self.layout, &resources);
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

/// What the middle of a picture's luminances becomes, unless too much burns out.
const MIDDLE_GREY: f64 = 0.2;
/// The pixels that count as its middle, of those that are lit.
const MIDDLE: std::ops::Range<f64> = 0.1..0.95;
/// Luminance times exposure from which on tone mappings give up contrast and colour.
const SHOULDER: f64 = 0.5;
/// Stops up the shoulder past which it makes no difference: a lamp in the picture is to be white.
const LOST: f64 = 4.0;
/// A picture may be so far up the shoulder, in stops, on average of all its pixels.
const MOST_BURNT: f64 = 0.18;
/// Stops that exposure goes down for bright parts: a room with a window is not to be black.
const MOST_STOPS_DOWN: f64 = 2.0;
/// How finely an exposure in between is looked for, stops.
const STEP: f64 = 0.01;
/// A picture of which less is lit says nothing.
const LEAST_LIT: f64 = 0.02;

/// The exposure that suits a picture; `None` where (nearly) all is black. The middle of its
/// luminances becomes middle grey, or so far below it that no more than [`MOST_BURNT`] burns out. The
/// page has the same rule (`web/viewer/src/view/exposure.ts`).
pub(crate) fn exposure(histogram: &[u32]) -> Option<f32> {
    let all: f64 = histogram.iter().map(|n| f64::from(*n)).sum();
    // Luminances in stops, and how many pixels have them; the first bin is black.
    let lit: Vec<(f64, f64)> = histogram
        .iter()
        .enumerate()
        .skip(1)
        .map(|(bin, count)| {
            (f64::from(LEAST) + (bin as f64 - 0.5) / f64::from(BINS_A_STOP), f64::from(*count))
        })
        .collect();
    let pixels: f64 = lit.iter().map(|(_, count)| count).sum();
    if pixels <= LEAST_LIT * all {
        return None;
    }
    let key = MIDDLE_GREY.log2() - middle(&lit, pixels);
    if burnt(&lit, pixels, key) <= MOST_BURNT {
        return Some(key.exp2() as f32);
    }
    let (mut dark, mut bright) = (key - MOST_STOPS_DOWN, key);
    while bright - dark > STEP {
        let between = 0.5 * (dark + bright);
        if burnt(&lit, pixels, between) > MOST_BURNT {
            bright = between;
        } else {
            dark = between;
        }
    }
    Some(dark.exp2() as f32)
}

/// The average of the middle of luminances, stops.
fn middle(lit: &[(f64, f64)], pixels: f64) -> f64 {
    let middle = MIDDLE.start * pixels..MIDDLE.end * pixels;
    let (mut below, mut sum) = (0.0, 0.0);
    for (stops, count) in lit {
        let counted = (below + count).min(middle.end) - middle.start.max(below);
        sum += stops * counted.max(0.0);
        below += count;
    }
    sum / (middle.end - middle.start)
}

/// How far luminances are up the shoulder on average, in stops, under an exposure in stops: few that
/// are far up count like many that are not.
fn burnt(lit: &[(f64, f64)], pixels: f64, exposure: f64) -> f64 {
    let up = |stops: f64| (stops + exposure - SHOULDER.log2()).clamp(0.0, LOST);
    lit.iter().map(|(stops, count)| up(*stops) * count).sum::<f64>() / pixels
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
        // Black pixels around it do not count.
        close(of(&[(5.0, 1000)], 9000), 0.04);
        // A few lamps and dark corners do not count either.
        close(of(&[(1.0, 950), (1000.0, 20), (0.001, 30)], 0), 0.2);
    }

    /// Exposure goes down by as much as keeps the bright part's colours, by two stops at most, as in the
    /// page.
    #[test]
    fn bright_parts_are_not_burnt_out() {
        // Three tenths of the picture are eight times as bright as the rest. Of them 0.6 stops may be
        // up the shoulder each.
        let found = of(&[(1.0, 700), (8.0, 300)], 0);
        close(found, 0.5 * (MOST_BURNT / 0.3).exp2() as f32 / 8.0);
        // A fifth is a window, which is lost whatever is done.
        let (bright, alone) = (of(&[(1.0, 800), (1000.0, 200)], 0), middle_grey(&[0.8, 0.2]));
        close(bright, alone / 4.0);
    }

    /// The exposure by the middle alone, of a part at 1 cd/m² and one at 1,000.
    fn middle_grey([dark, bright]: &[f32; 2]) -> f32 {
        let middle = (MIDDLE.end - MIDDLE.start) as f32;
        let counted = bright - (1.0 - MIDDLE.end as f32);
        assert!(*dark > MIDDLE.start as f32);
        MIDDLE_GREY as f32 / 1000.0f32.powf(counted / middle)
    }

    #[test]
    fn black_says_nothing() {
        assert_eq!(of(&[], 0), None);
        assert_eq!(of(&[], 1000), None);
        assert_eq!(of(&[(1.0, 10)], 1000), None);
    }
}
