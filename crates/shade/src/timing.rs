//! How long passes take on the device, where the adapter tells.

use std::ops::Add as _;

use crate::ShadeError;
use crate::gpu::Gpu;
use crate::readback::Readback;

/// Seconds on the device, by pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassTimes {
    /// Shadow maps: drawn once for all views, and kept while neither scene nor cascades change.
    pub shadows: f64,
    /// Surfaces and what lies behind them, of all views.
    pub pictures: f64,
}

impl std::ops::AddAssign for PassTimes {
    fn add_assign(&mut self, other: Self) {
        self.shadows += other.shadows;
        self.pictures += other.pictures;
    }
}

/// The most passes of a frame that are timed.
const MOST: u32 = 2048;
/// Of a timestamp.
const TICK: u64 = 8;
const DURING: &str = "reading timestamps";

/// Two timestamps for each pass of a frame.
#[derive(Debug)]
pub(crate) struct Timing {
    queries: wgpu::QuerySet,
    count: u32,
    /// How many of the passes, the first ones, draw shadow maps.
    shadow_maps: usize,
    resolved: wgpu::Buffer,
    read: wgpu::Buffer,
}

impl Timing {
    /// For so many passes, of which the first draw shadow maps; nothing where the adapter has no
    /// clock.
    pub(crate) fn new(gpu: &Gpu, passes: usize, shadow_maps: usize) -> Option<Self> {
        let count = 2 * u32::try_from(passes).ok().filter(|passes| (1..=MOST).contains(passes))?;
        if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let queries = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("passes"),
            ty: wgpu::QueryType::Timestamp,
            count,
        });
        let size = TICK * u64::from(count);
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let resolved = gpu.buffer("timestamps", usage, &[], size);
        let read = Readback::buffer(gpu, "timestamps", size);
        Some(Self { queries, count, shadow_maps, resolved, read })
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

    /// Asks for the timestamps of a frame that was submitted.
    pub(crate) fn submitted(self) -> Timed {
        Timed { read: Readback::begin(self.read), shadow_maps: self.shadow_maps }
    }
}

/// Timestamps on their way back.
#[derive(Debug)]
pub(crate) struct Timed {
    read: Readback,
    shadow_maps: usize,
}

impl Timed {
    /// Waits until the frame is done.
    pub(crate) fn wait(&self, gpu: &Gpu) -> Result<PassTimes, ShadeError> {
        self.read.wait(gpu, DURING).map(|bytes| self.times(gpu, &bytes))
    }

    /// Nothing where the frame is not done.
    pub(crate) fn take(&self, gpu: &Gpu) -> Result<Option<PassTimes>, ShadeError> {
        Ok(self.read.take(DURING)?.map(|bytes| self.times(gpu, &bytes)))
    }

    fn times(&self, gpu: &Gpu, bytes: &[u8]) -> PassTimes {
        let period = 1e-9 * f64::from(gpu.queue.get_timestamp_period());
        let ticks: Vec<u64> = bytes
            .chunks_exact(TICK as usize)
            .map(|tick| u64::from_le_bytes(tick.try_into().unwrap_or_default()))
            .collect();
        // Clocks may jump: no pass takes less than nothing.
        let seconds = |pair: &[u64]| period * pair[1].saturating_sub(pair[0]) as f64;
        let (shadows, pictures) = ticks.split_at(2 * self.shadow_maps);
        let sum = |ticks: &[u64]| ticks.chunks_exact(2).map(seconds).fold(0.0, f64::add);
        PassTimes { shadows: sum(shadows), pictures: sum(pictures) }
    }
}
