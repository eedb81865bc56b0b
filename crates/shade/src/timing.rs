//! How long the passes of a frame take on the device, where the adapter tells.

use lumencast_gpu::{Gpu, GpuError};

/// Commands of a frame.
pub(crate) type Commands = lumencast_gpu::Commands<Stage>;

/// What a pass is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    Deformation,
    Shadows,
    Occlusion,
    Picture,
    Screen,
}

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

    fn sum(passes: Vec<(Stage, f64)>) -> Self {
        let mut times = Self::default();
        passes.into_iter().for_each(|(stage, seconds)| *times.of(stage) += seconds);
        times
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

/// The times of a frame on their way back.
#[derive(Debug)]
pub(crate) struct Timed(lumencast_gpu::Timed<Stage>);

impl Timed {
    /// Submits commands; nothing where the adapter has no clock.
    pub(crate) fn submit(commands: Commands, gpu: &Gpu) -> Option<Self> {
        commands.submit(gpu).map(Self)
    }

    /// Waits until the frame is done.
    pub(crate) fn wait(&self, gpu: &Gpu) -> Result<PassTimes, GpuError> {
        self.0.wait(gpu).map(PassTimes::sum)
    }

    /// Nothing where the frame is not done.
    pub(crate) fn take(&self, gpu: &Gpu) -> Result<Option<PassTimes>, GpuError> {
        Ok(self.0.take(gpu)?.map(PassTimes::sum))
    }
}
