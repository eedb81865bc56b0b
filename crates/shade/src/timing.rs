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
    /// Ambient occlusion, with the depth that it is of, of all views.
    pub occlusion: f64,
    /// Surfaces and what lies behind them, of all views.
    pub pictures: f64,
}

impl std::ops::AddAssign for PassTimes {
    fn add_assign(&mut self, other: Self) {
        self.shadows += other.shadows;
        self.occlusion += other.occlusion;
        self.pictures += other.pictures;
    }
}

/// The most spans of a frame that are timed.
const MOST: u32 = 2048;
/// Of a timestamp.
const TICK: u64 = 8;
const DURING: &str = "reading timestamps";

/// The spans of a frame that are timed, in this order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spans {
    pub(crate) shadow_maps: u32,
    pub(crate) pictures: u32,
    /// As many as there are pictures, or none. Each is of several passes.
    pub(crate) occlusions: u32,
}

/// Two timestamps for each span of a frame.
#[derive(Debug)]
pub(crate) struct Timing {
    queries: wgpu::QuerySet,
    count: u32,
    spans: Spans,
    resolved: wgpu::Buffer,
    read: wgpu::Buffer,
}

impl Timing {
    /// Nothing where the adapter has no clock.
    pub(crate) fn new(gpu: &Gpu, spans: Spans) -> Option<Self> {
        let all = spans.shadow_maps + spans.pictures + spans.occlusions;
        let count = 2 * Some(all).filter(|all| (1..=MOST).contains(all))?;
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
        Some(Self { queries, count, spans, resolved, read })
    }

    /// What the pass of a shadow map or a picture has to write, which is a span by itself.
    pub(crate) fn of_pass(&self, number: u32) -> wgpu::RenderPassTimestampWrites<'_> {
        self.writes(Some(2 * number), Some(2 * number + 1))
    }

    /// What the first and the last pass of the occlusion of a picture have to write, whose own pass
    /// has this number.
    pub(crate) fn of_occlusion(&self, number: u32) -> [wgpu::RenderPassTimestampWrites<'_>; 2] {
        let first = 2 * (number + self.spans.pictures);
        [self.writes(Some(first), None), self.writes(None, Some(first + 1))]
    }

    fn writes(
        &self,
        beginning_of_pass_write_index: Option<u32>,
        end_of_pass_write_index: Option<u32>,
    ) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index,
            end_of_pass_write_index,
        }
    }

    /// Copies the timestamps to where they can be read.
    pub(crate) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..self.count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.read, 0, self.read.size());
    }

    /// Asks for the timestamps of a frame that was submitted.
    pub(crate) fn submitted(self) -> Timed {
        Timed { read: Readback::begin(self.read), spans: self.spans }
    }
}

/// Timestamps on their way back.
#[derive(Debug)]
pub(crate) struct Timed {
    read: Readback,
    spans: Spans,
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
        let (shadows, views) = ticks.split_at(2 * self.spans.shadow_maps as usize);
        let (pictures, occlusions) = views.split_at(2 * self.spans.pictures as usize);
        let sum = |ticks: &[u64]| ticks.chunks_exact(2).map(seconds).fold(0.0, f64::add);
        PassTimes { shadows: sum(shadows), occlusion: sum(occlusions), pictures: sum(pictures) }
    }
}
