//! What pictures are drawn into, and how they come back.

use glam::{UVec2, Vec3};
use half::f16;
use lumencast_gpu::textures::{self, COLOR, DEPTH};
use lumencast_gpu::{Gpu, GpuError, TextureCopy};

use crate::timing::{Commands, Stage};

/// Bytes of a pixel of [`COLOR`].
const PIXEL: usize = 8;

/// Textures of one size and sample count.
#[derive(Debug)]
pub(crate) struct Target {
    size: UVec2,
    samples: u32,
    /// This is multisampled where there is more than one sample.
    drawn: wgpu::TextureView,
    resolved: wgpu::Texture,
    resolved_view: wgpu::TextureView,
    depth: wgpu::TextureView,
}

impl Target {
    pub(crate) fn new(gpu: &Gpu, size: UVec2, samples: u32) -> Self {
        let texture = |label, format, sample_count, usage| {
            gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                sample_count,
                ..textures::plane(size, format, usage)
            })
        };
        let attached = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let read = wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::TEXTURE_BINDING;
        let resolved = texture("picture", COLOR, 1, attached | read);
        let resolved_view = textures::view(&resolved);
        let drawn = match samples {
            1 => resolved_view.clone(),
            _ => textures::view(&texture("samples", COLOR, samples, attached)),
        };
        let depth = textures::view(&texture("depth", DEPTH, samples, attached));
        Self { size, samples, drawn, resolved, resolved_view, depth }
    }

    /// Whether it is of this size and sample count.
    pub(crate) fn fits(&self, size: UVec2, samples: u32) -> bool {
        (self.size, self.samples) == (size, samples)
    }

    /// A pass that draws a picture from nothing.
    pub(crate) fn pass<'a>(&self, commands: &'a mut Commands) -> wgpu::RenderPass<'a> {
        let (encoder, timestamp_writes) = commands.pass(Stage::Picture);
        let color = wgpu::RenderPassColorAttachment {
            view: &self.drawn,
            depth_slice: None,
            resolve_target: (self.samples > 1).then_some(&self.resolved_view),
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: if self.samples > 1 { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store },
            },
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(color)],
            depth_stencil_attachment: Some(depth_attachment(&self.depth, wgpu::StoreOp::Discard)),
            timestamp_writes,
            ..Default::default()
        })
    }

    /// The picture: linear, pre-exposed.
    pub(crate) fn picture(&self) -> &wgpu::TextureView {
        &self.resolved_view
    }

    /// Copies the picture to where it can be read.
    pub(crate) fn copy(&self, gpu: &Gpu, commands: &mut Commands) -> PictureCopy {
        PictureCopy(TextureCopy::new(gpu, &mut commands.encoder, &self.resolved))
    }
}

/// A cleared depth attachment: infinitely far.
pub(crate) fn depth_attachment(
    view: &wgpu::TextureView,
    store: wgpu::StoreOp,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store }),
        stencil_ops: None,
    }
}

/// A copy of a picture.
#[derive(Debug)]
pub(crate) struct PictureCopy(TextureCopy);

impl PictureCopy {
    /// Waits for the picture, whose commands have been submitted, and adds it times `weight` to
    /// `sum`.
    pub(crate) fn add_to(self, gpu: &Gpu, sum: &mut [Vec3], weight: f32) -> Result<(), GpuError> {
        let mut pixels = sum.iter_mut();
        self.0.wait(gpu, "reading a picture back", |row| {
            for (halves, pixel) in row.chunks_exact(PIXEL).zip(pixels.by_ref()) {
                let half =
                    |i: usize| f16::from_le_bytes([halves[2 * i], halves[2 * i + 1]]).to_f32();
                *pixel += weight * Vec3::new(half(0), half(1), half(2));
            }
        })
    }
}
