//! Buffers on their way back from the device.

use std::sync::mpsc::{Receiver, TryRecvError};

use crate::ShadeError;
use crate::gpu::Gpu;

/// A buffer whose contents were asked for. It can be waited for, or looked at now and then.
#[derive(Debug)]
pub(crate) struct Readback {
    buffer: wgpu::Buffer,
    mapped: Receiver<Result<(), wgpu::BufferAsyncError>>,
}

impl Readback {
    /// A buffer that copies can go to and be read from.
    pub(crate) fn buffer(gpu: &Gpu, label: &str, size: u64) -> wgpu::Buffer {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        })
    }

    /// Asks for what commands that were submitted before now leave in the buffer.
    pub(crate) fn begin(buffer: wgpu::Buffer) -> Self {
        let (sender, mapped) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // Nobody waits any more where the renderer gave up.
            let _ = sender.send(result);
        });
        Self { buffer, mapped }
    }

    /// The contents, once they are there.
    pub(crate) fn wait(
        &self,
        gpu: &Gpu,
        during: &'static str,
    ) -> Result<wgpu::BufferView, ShadeError> {
        gpu.finish(during)?;
        let failed = |reason: String| ShadeError::Failed { during, reason };
        let mapped = self.mapped.recv().map_err(|error| failed(error.to_string()))?;
        mapped.map_err(|error| failed(error.to_string()))?;
        self.contents(during)
    }

    /// The contents if they are there; to be called until it gave them, after the device was polled.
    pub(crate) fn take(
        &self,
        during: &'static str,
    ) -> Result<Option<wgpu::BufferView>, ShadeError> {
        let failed = |reason: String| ShadeError::Failed { during, reason };
        match self.mapped.try_recv() {
            Ok(Ok(())) => self.contents(during).map(Some),
            Ok(Err(error)) => Err(failed(error.to_string())),
            Err(TryRecvError::Empty) => Ok(None),
            Err(error @ TryRecvError::Disconnected) => Err(failed(error.to_string())),
        }
    }

    fn contents(&self, during: &'static str) -> Result<wgpu::BufferView, ShadeError> {
        self.buffer
            .get_mapped_range(..)
            .map_err(|error| ShadeError::Failed { during, reason: error.to_string() })
    }
}
