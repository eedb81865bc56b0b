//! Descriptors of the usual kinds of texture.

use glam::{UVec2, UVec3};

/// Colours before they are shown: linear, in halves, 8 bytes a pixel.
pub const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Depths, 4 bytes a pixel.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The size of a 2D texture of one layer, texels.
pub fn plane_size(size: UVec2) -> wgpu::Extent3d {
    volume_size(size.extend(1))
}

/// The size of a 3D texture, or of a 2D one and its layers.
pub fn volume_size(UVec3 { x, y, z }: UVec3) -> wgpu::Extent3d {
    wgpu::Extent3d { width: x, height: y, depth_or_array_layers: z }
}

/// A 2D texture with one layer, one level and one sample. Others differ in a field:
///
/// ```
/// use glam::UVec2;
/// use lumencast_gpu::{textures, wgpu};
///
/// let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
/// let descriptor = wgpu::TextureDescriptor {
///     label: Some("samples"),
///     sample_count: 4,
///     ..textures::plane(UVec2::new(640, 480), textures::COLOR, usage)
/// };
/// assert_eq!(descriptor.size.width, 640);
/// ```
pub fn plane(
    size: UVec2,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: None,
        size: plane_size(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    }
}

/// A 3D texture with one level.
pub fn volume(
    size: UVec3,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        size: volume_size(size),
        dimension: wgpu::TextureDimension::D3,
        ..plane(UVec2::ONE, format, usage)
    }
}

/// A view of all of a texture.
pub fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
