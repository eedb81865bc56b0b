//! What pictures are drawn into, and how they come back.

use glam::{UVec2, Vec3};
use half::f16;

use crate::ShadeError;
use crate::gpu::{COLOR, DEPTH, Gpu};
use crate::readback::Readback;
use crate::timing::{Commands, Stage};

/// Rows that are copied to a buffer begin at multiples of so many bytes.
const ROW_ALIGNMENT: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;
/// Of a pixel of [`COLOR`].
const PIXEL: u32 = 8;

/// Textures of one size and sample count.
#[derive(Debug)]
pub(crate) struct Target {
    size: UVec2,
    samples: u32,
    /// Multisampled, where there is more than one sample.
    drawn: wgpu::TextureView,
    resolved: wgpu::Texture,
    resolved_view: wgpu::TextureView,
    depth: wgpu::TextureView,
}

impl Target {
    pub(crate) fn new(gpu: &Gpu, size: UVec2, samples: u32) -> Self {
        let texture = |label, format, sample_count, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: extent(size),
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let attached = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let read = wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::TEXTURE_BINDING;
        let resolved = texture("picture", COLOR, 1, attached | read);
        let view =
            |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let resolved_view = view(&resolved);
        let drawn = match samples {
            1 => resolved_view.clone(),
            _ => view(&texture("samples", COLOR, samples, attached)),
        };
        let depth = view(&texture("depth", DEPTH, samples, attached));
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
    pub(crate) fn copy(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) -> Copied {
        let row = (PIXEL * self.size.x).next_multiple_of(ROW_ALIGNMENT);
        let buffer = Readback::buffer(gpu, "picture", u64::from(row) * u64::from(self.size.y));
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            self.resolved.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            extent(self.size),
        );
        Copied { buffer, row, size: self.size }
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

fn extent(size: UVec2) -> wgpu::Extent3d {
    wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 }
}

/// A copy of a picture.
#[derive(Debug)]
pub(crate) struct Copied {
    buffer: wgpu::Buffer,
    row: u32,
    size: UVec2,
}

impl Copied {
    /// Waits for the picture, whose commands have been submitted, and adds it times `weight` to
    /// `sum`.
    pub(crate) fn add_to(self, gpu: &Gpu, sum: &mut [Vec3], weight: f32) -> Result<(), ShadeError> {
        let bytes = Readback::begin(self.buffer).wait(gpu, "reading a picture back")?;
        let rows = bytes.chunks_exact(self.row as usize);
        for (own, row) in sum.chunks_exact_mut(self.size.x as usize).zip(rows) {
            for (pixel, halves) in own.iter_mut().zip(row.chunks_exact(PIXEL as usize)) {
                let half =
                    |i: usize| f16::from_le_bytes([halves[2 * i], halves[2 * i + 1]]).to_f32();
                *pixel += weight * Vec3::new(half(0), half(1), half(2));
            }
        }
        Ok(())
    }
}
