//! Buffers and textures on their way back from the device.

use std::sync::mpsc::{Receiver, TryRecvError};

use crate::device::Gpu;
use crate::error::GpuError;
use crate::textures::plane_size;

/// A buffer whose contents were asked for. It can be waited for, or looked at now and then.
#[derive(Debug)]
pub struct Readback {
    buffer: wgpu::Buffer,
    mapped: Receiver<Result<(), wgpu::BufferAsyncError>>,
}

impl Readback {
    /// A buffer of `size` bytes that copies can go to and be read from.
    pub fn buffer(gpu: &Gpu, label: &str, size: u64) -> wgpu::Buffer {
        gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        })
    }

    /// Asks for what commands that were submitted before now leave in a [buffer](Readback::buffer).
    pub fn begin(buffer: wgpu::Buffer) -> Self {
        let (sender, mapped) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // Nobody waits any more where the asker gave up.
            let _ = sender.send(result);
        });
        Self { buffer, mapped }
    }

    /// Waits until everything submitted is done, and returns the contents. `during` names what was
    /// done, for people.
    ///
    /// # Errors
    /// [`GpuError::Failed`] where the device was lost, or has failed otherwise.
    pub fn wait(&self, gpu: &Gpu, during: &'static str) -> Result<wgpu::BufferView, GpuError> {
        gpu.finish(during)?;
        let mapped = self.mapped.recv().map_err(|error| GpuError::failed(during, error))?;
        mapped.map_err(|error| GpuError::failed(during, error))?;
        self.contents(during)
    }

    /// The contents if they are there. It is to be called until it gave them, each time after
    /// [`Gpu::poll`].
    ///
    /// # Errors
    /// As [`Readback::wait`].
    pub fn take(&self, during: &'static str) -> Result<Option<wgpu::BufferView>, GpuError> {
        match self.mapped.try_recv() {
            Ok(Ok(())) => self.contents(during).map(Some),
            Ok(Err(error)) => Err(GpuError::failed(during, error)),
            Err(TryRecvError::Empty) => Ok(None),
            Err(error @ TryRecvError::Disconnected) => Err(GpuError::failed(during, error)),
        }
    }

    fn contents(&self, during: &'static str) -> Result<wgpu::BufferView, GpuError> {
        self.buffer.get_mapped_range(..).map_err(|error| GpuError::failed(during, error))
    }
}

/// A copy of a 2D texture's first level, to be read back.
#[derive(Debug)]
pub struct TextureCopy {
    buffer: wgpu::Buffer,
    /// Bytes from a row's beginning to the next one's.
    stride: usize,
    /// Bytes of a row's texels.
    row: usize,
}

impl TextureCopy {
    /// Adds the command that copies a texture, whose usage has `COPY_SRC`.
    ///
    /// # Panics
    /// Where the texture's format has several aspects.
    pub fn new(gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, texture: &wgpu::Texture) -> Self {
        let size = glam::UVec2::new(texture.width(), texture.height());
        let texel = texture.format().block_copy_size(None).expect("a format of one aspect");
        let row = texel * size.x;
        let stride = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = Readback::buffer(gpu, "texture", u64::from(stride) * u64::from(size.y));
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(stride),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            plane_size(size),
        );
        Self { buffer, stride: stride as usize, row: row as usize }
    }

    /// Waits for the copy, whose command has been submitted, and shows its rows of texels to `read`,
    /// from the top down.
    ///
    /// # Errors
    /// As [`Readback::wait`].
    pub fn wait(
        self,
        gpu: &Gpu,
        during: &'static str,
        read: impl FnMut(&[u8]),
    ) -> Result<(), GpuError> {
        let bytes = Readback::begin(self.buffer).wait(gpu, during)?;
        bytes.chunks_exact(self.stride).map(|row| &row[..self.row]).for_each(read);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;
    use crate::textures::plane;

    /// Rows whose bytes are no multiple of the copy's alignment come back without what fills them up.
    #[test]
    fn rows_of_any_width_come_back() {
        let gpu = Gpu::new().expect("an adapter");
        let size = UVec2::new(7, 3);
        let usage = wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC;
        let descriptor = plane(size, wgpu::TextureFormat::Rgba8Unorm, usage);
        let texture = gpu.device().create_texture(&descriptor);
        let texels: Vec<u8> = (0..4 * 7 * 3).collect();
        gpu.write_texels(texture.as_image_copy(), &texels, descriptor.size);
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let copy = TextureCopy::new(&gpu, &mut encoder, &texture);
        gpu.queue().submit([encoder.finish()]);
        let mut rows = Vec::new();
        copy.wait(&gpu, "reading", |row| rows.push(row.to_vec())).expect("rows");
        assert_eq!(rows.len(), 3);
        assert_eq!(rows.concat(), texels);
    }
}
