//! How long passes take on the device, where the adapter tells.

use crate::ShadeError;
use crate::gpu::Gpu;

/// The most passes of a frame that are timed.
const MOST: u32 = 2048;
/// Of a timestamp.
const TICK: u64 = 8;

/// Two timestamps for each pass of a frame.
#[derive(Debug)]
pub(crate) struct Timing {
    queries: wgpu::QuerySet,
    count: u32,
    resolved: wgpu::Buffer,
    read: wgpu::Buffer,
}

impl Timing {
    /// For so many passes; nothing where the adapter has no clock.
    pub(crate) fn new(gpu: &Gpu, passes: usize) -> Option<Self> {
        let count = 2 * u32::try_from(passes).ok().filter(|passes| (1..=MOST).contains(passes))?;
        if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let queries = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("passes"),
            ty: wgpu::QueryType::Timestamp,
            count,
        });
        let buffer = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: TICK * u64::from(count),
                usage,
                mapped_at_creation: false,
            })
        };
        let resolved = buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC);
        let read = buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ);
        Some(Self { queries, count, resolved, read })
    }

    /// What a pass has to write.
    pub(crate) fn of_pass(&self, number: u32) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * number),
            end_of_pass_write_index: Some(2 * number + 1),
        }
    }

    /// Copies the timestamps to where they can be read.
    pub(crate) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..self.count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.read, 0, self.read.size());
    }

    /// Waits, and returns the seconds of each pass.
    pub(crate) fn seconds(&self, gpu: &Gpu) -> Result<Vec<f64>, ShadeError> {
        let bytes = gpu.read(&self.read, "reading timestamps")?;
        let period = 1e-9 * f64::from(gpu.queue.get_timestamp_period());
        let ticks: Vec<u64> = bytes
            .chunks_exact(TICK as usize)
            .map(|tick| u64::from_le_bytes(tick.try_into().unwrap_or_default()))
            .collect();
        // Clocks may jump: no pass takes less than nothing.
        let pass = |pair: &[u64]| period * pair[1].saturating_sub(pair[0]) as f64;
        Ok(ticks.chunks_exact(2).map(pass).collect())
    }
}
