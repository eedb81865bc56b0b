//! How bright a picture on the device is.

use lumencast_shaders::layout::meter::{BINS, BINS_A_STOP, LEAST};
use lumencast_shaders::meter;

use crate::bindings;
use crate::gpu::Gpu;
use crate::readback::Readback;

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
        let of_compute = |binding, ty| wgpu::BindGroupLayoutEntry {
            visibility: wgpu::ShaderStages::COMPUTE,
            ..bindings::entry(binding, ty)
        };
        let histogram = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: false },
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("meter"),
            entries: &[of_compute(0, bindings::PICTURE), of_compute(1, histogram)],
        });
        let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("meter"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let module = gpu.shader("meter", meter());
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("meter"),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("meter"),
            compilation_options: Default::default(),
            cache: None,
        });
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let histogram = gpu.buffer("histogram", usage, &[], SIZE);
        Self { layout, pipeline, histogram }
    }

    /// Measures a picture; the histogram will be in the buffer returned.
    pub(crate) fn measure(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
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
        encoder.clear_buffer(&self.histogram, 0, None);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("meter"),
            timestamp_writes: None,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(size.width.div_ceil(SQUARE), size.height.div_ceil(SQUARE), 1);
        drop(pass);
        let read = Readback::buffer(gpu, "histogram", SIZE);
        encoder.copy_buffer_to_buffer(&self.histogram, 0, &read, 0, SIZE);
        read
    }
}

/// The luminance below which so large a share of the pixels lies, to a 24th of a stop; `None` where
/// nothing is as bright as the second bin.
pub(crate) fn percentile(histogram: &[u32], share: f64) -> Option<f32> {
    let total: u64 = histogram.iter().map(|n| u64::from(*n)).sum();
    let rank = share * total as f64;
    let mut below = 0.0;
    for (bin, count) in histogram.iter().enumerate() {
        let count = f64::from(*count);
        if count > 0.0 && below + count >= rank {
            let within = ((rank - below) / count) as f32;
            let stops = LEAST + (bin as f32 - 1.0 + within) / BINS_A_STOP;
            return (bin > 0).then(|| stops.exp2());
        }
        below += count;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bin_of(luminance: f32) -> usize {
        (BINS_A_STOP * (luminance.log2() - LEAST)).floor() as usize + 1
    }

    #[test]
    fn percentiles_lie_in_their_bins() {
        let mut histogram = [0; BINS];
        histogram[bin_of(0.5)] = 90;
        histogram[bin_of(3.0)] = 10;
        let half = percentile(&histogram, 0.5).expect("most are");
        let bright = percentile(&histogram, 0.99).expect("some are");
        assert!((half / 0.5).log2().abs() <= 1.0 / BINS_A_STOP, "{half}");
        assert!((bright / 3.0).log2().abs() <= 1.0 / BINS_A_STOP, "{bright}");
        assert!(percentile(&histogram, 0.95) < percentile(&histogram, 0.99));
    }

    #[test]
    fn black_has_none() {
        let mut histogram = [0; BINS];
        assert_eq!(percentile(&histogram, 0.99), None);
        histogram[0] = 1000;
        histogram[BINS - 1] = 1;
        assert_eq!(percentile(&histogram, 0.99), None);
    }
}
