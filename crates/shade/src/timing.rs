//! The commands of a frame, and how long their passes take on the device, where the adapter tells.

use crate::ShadeError;
use crate::gpu::{Gpu, TIMED_PASSES};
use crate::readback::Readback;

/// Seconds on the device, by what passes are for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassTimes {
    /// Skins and morph targets, once a moment of the scene.
    pub deformation: f64,
    /// Shadow maps: drawn once for all views, and kept while neither scene nor cascades change.
    pub shadows: f64,
    /// Ambient occlusion, with the depth that it is of, of all views.
    pub occlusion: f64,
    /// Surfaces and what lies behind them, of all views.
    pub pictures: f64,
    /// Showing a picture on a screen, and measuring it.
    pub screen: f64,
}

impl PassTimes {
    fn of(&mut self, stage: Stage) -> &mut f64 {
        match stage {
            Stage::Deformation => &mut self.deformation,
            Stage::Shadows => &mut self.shadows,
            Stage::Occlusion => &mut self.occlusion,
            Stage::Picture => &mut self.pictures,
            Stage::Screen => &mut self.screen,
        }
    }
}

impl std::ops::AddAssign for PassTimes {
    fn add_assign(&mut self, other: Self) {
        self.deformation += other.deformation;
        self.shadows += other.shadows;
        self.occlusion += other.occlusion;
        self.pictures += other.pictures;
        self.screen += other.screen;
    }
}

/// What a pass is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    Deformation,
    Shadows,
    Occlusion,
    Picture,
    Screen,
}

/// Of a timestamp.
const TICK: usize = size_of::<u64>();
const DURING: &str = "reading timestamps";

/// Commands that are submitted together, whose passes are timed.
#[derive(Debug)]
pub(crate) struct Commands {
    pub(crate) encoder: wgpu::CommandEncoder,
    clock: Option<wgpu::QuerySet>,
    /// Of the passes so far.
    stages: Vec<Stage>,
}

impl Commands {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let encoder = gpu.device.create_command_encoder(&Default::default());
        Self { encoder, clock: gpu.clock.clone(), stages: Vec::new() }
    }

    /// For a pass that is to be encoded: what it is encoded with, and what it has to write.
    pub(crate) fn pass(
        &mut self,
        stage: Stage,
    ) -> (&mut wgpu::CommandEncoder, Option<wgpu::RenderPassTimestampWrites<'_>>) {
        let stamps = self.stamps(stage).zip(self.clock.as_ref());
        let timestamps = stamps.map(|([begin, end], query_set)| wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(begin),
            end_of_pass_write_index: Some(end),
        });
        (&mut self.encoder, timestamps)
    }

    /// The same of a compute pass.
    pub(crate) fn compute_pass(
        &mut self,
        stage: Stage,
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
    fn stamps(&mut self, stage: Stage) -> Option<[u32; 2]> {
        let pass = self.stages.len();
        self.stages.push(stage);
        (pass < TIMED_PASSES).then_some([2 * pass as u32, 2 * pass as u32 + 1])
    }

    /// Submits the commands, and asks for what they will have taken.
    pub(crate) fn submit(self, gpu: &Gpu) -> Option<Timed> {
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
        gpu.queue.submit([encoder.finish()]);
        read.map(|read| Timed { read: Readback::begin(read), stages })
    }
}

/// Timestamps on their way back.
#[derive(Debug)]
pub(crate) struct Timed {
    read: Readback,
    stages: Vec<Stage>,
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
        let (ticks, _) = bytes.as_chunks::<TICK>();
        let (pairs, _) = ticks.as_chunks::<2>();
        let mut times = PassTimes::default();
        for (stage, pair) in self.stages.iter().zip(pairs) {
            let [begin, end] = pair.map(u64::from_le_bytes);
            // Clocks may jump: no pass takes less than nothing.
            *times.of(*stage) += period * end.saturating_sub(begin) as f64;
        }
        times
    }
}
