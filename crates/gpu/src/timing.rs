//! Commands, and how long their passes take on the device, where the adapter tells.

use crate::device::{Gpu, TIMED_PASSES};
use crate::error::GpuError;
use crate::readback::Readback;

/// Bytes of a timestamp.
const TICK: usize = size_of::<u64>();
const DURING: &str = "reading timestamps";

/// Commands that are submitted together, whose passes are timed. Each pass has a stage `S`: what it is
/// for, in the caller's words.
#[derive(Debug)]
pub struct Commands<S> {
    /// Encodes what is no pass, such as copies.
    pub encoder: wgpu::CommandEncoder,
    clock: Option<wgpu::QuerySet>,
    /// The stages of the passes so far.
    stages: Vec<S>,
}

impl<S> Commands<S> {
    /// No commands yet.
    pub fn new(gpu: &Gpu) -> Self {
        let encoder = gpu.device().create_command_encoder(&Default::default());
        Self { encoder, clock: gpu.clock().cloned(), stages: Vec::new() }
    }

    /// What the next render pass is encoded with, and the timestamps that its descriptor has to ask for.
    pub fn pass(
        &mut self,
        stage: S,
    ) -> (&mut wgpu::CommandEncoder, Option<wgpu::RenderPassTimestampWrites<'_>>) {
        let stamps = self.stamps(stage).zip(self.clock.as_ref());
        let timestamps = stamps.map(|([begin, end], query_set)| wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(begin),
            end_of_pass_write_index: Some(end),
        });
        (&mut self.encoder, timestamps)
    }

    /// The same of the next compute pass.
    pub fn compute_pass(
        &mut self,
        stage: S,
    ) -> (&mut wgpu::CommandEncoder, Option<wgpu::ComputePassTimestampWrites<'_>>) {
        let stamps = self.stamps(stage).zip(self.clock.as_ref());
        let timestamps = stamps.map(|([begin, end], query_set)| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(begin),
            end_of_pass_write_index: Some(end),
        });
        (&mut self.encoder, timestamps)
    }

    /// Both timestamps of the next pass; none where there are too many passes.
    fn stamps(&mut self, stage: S) -> Option<[u32; 2]> {
        let pass = self.stages.len();
        self.stages.push(stage);
        (pass < TIMED_PASSES).then_some([2 * pass as u32, 2 * pass as u32 + 1])
    }

    /// Submits the commands, and asks for what their passes will have taken. There is no answer where
    /// the adapter has no clock, and where there are no passes or more than 2048.
    pub fn submit(self, gpu: &Gpu) -> Option<Timed<S>> {
        let Self { mut encoder, clock, stages } = self;
        let clock = clock.filter(|_| (1..=TIMED_PASSES).contains(&stages.len()));
        let read = clock.map(|clock| {
            let size = (2 * TICK * stages.len()) as u64;
            let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
            let resolved = gpu.buffer("timestamps", usage, &[], size);
            let read = Readback::buffer(gpu, "timestamps", size);
            encoder.resolve_query_set(&clock, 0..2 * stages.len() as u32, &resolved, 0);
            encoder.copy_buffer_to_buffer(&resolved, 0, &read, 0, size);
            read
        });
        gpu.queue().submit([encoder.finish()]);
        read.map(|read| Timed { read: Readback::begin(read), stages })
    }
}

/// Timestamps on their way back.
#[derive(Debug)]
pub struct Timed<S> {
    read: Readback,
    stages: Vec<S>,
}

impl<S: Copy> Timed<S> {
    /// Waits until the commands are done, and returns the seconds of each pass, in order.
    ///
    /// # Errors
    /// [`GpuError::Failed`] where the device was lost, or has failed otherwise.
    pub fn wait(&self, gpu: &Gpu) -> Result<Vec<(S, f64)>, GpuError> {
        self.read.wait(gpu, DURING).map(|bytes| self.seconds(gpu, &bytes))
    }

    /// The same without waiting: nothing where the commands are not done. It is to be called until it
    /// told, each time after [`Gpu::poll`].
    ///
    /// # Errors
    /// As [`Timed::wait`].
    pub fn take(&self, gpu: &Gpu) -> Result<Option<Vec<(S, f64)>>, GpuError> {
        Ok(self.read.take(DURING)?.map(|bytes| self.seconds(gpu, &bytes)))
    }

    fn seconds(&self, gpu: &Gpu, bytes: &[u8]) -> Vec<(S, f64)> {
        let period = 1e-9 * f64::from(gpu.queue().get_timestamp_period());
        let (ticks, _) = bytes.as_chunks::<TICK>();
        let (pairs, _) = ticks.as_chunks::<2>();
        let passes = self.stages.iter().zip(pairs);
        let timed = passes.map(|(stage, pair)| {
            let [begin, end] = pair.map(u64::from_le_bytes);
            // Clocks may jump: no pass takes less than nothing.
            (*stage, period * end.saturating_sub(begin) as f64)
        });
        timed.collect()
    }
}
