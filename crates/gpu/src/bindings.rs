//! Types of what shaders bind. A group's bindings have the numbers 0, 1, 2 and so on, in the order in
//! which [`Gpu::group_layout`](crate::Gpu::group_layout) is given their types, and
//! [`Gpu::group`](crate::Gpu::group) what is bound.

/// A uniform buffer.
pub const UNIFORM: wgpu::BindingType = buffer(wgpu::BufferBindingType::Uniform, false);
/// A uniform buffer of which each pass binds another part, by an offset.
pub const UNIFORM_BY_OFFSET: wgpu::BindingType = buffer(wgpu::BufferBindingType::Uniform, true);
/// A storage buffer that is only read.
pub const STORAGE: wgpu::BindingType =
    buffer(wgpu::BufferBindingType::Storage { read_only: true }, false);
/// A storage buffer that is written.
pub const WRITTEN: wgpu::BindingType =
    buffer(wgpu::BufferBindingType::Storage { read_only: false }, false);
/// A sampler that filters.
pub const SAMPLER: wgpu::BindingType =
    wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
/// A sampler that does not filter.
pub const NEAREST_SAMPLER: wgpu::BindingType =
    wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering);
/// A picture, read pixel by pixel.
pub const PICTURE: wgpu::BindingType = texture(EXACT, wgpu::TextureViewDimension::D2);
/// A depth texture, read pixel by pixel.
pub const DEPTHS: wgpu::BindingType =
    texture(wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2);

/// Texels that are filtered.
pub const FILTERED: wgpu::TextureSampleType = wgpu::TextureSampleType::Float { filterable: true };
/// Texels that are read one by one, as f32 is on every adapter.
pub const EXACT: wgpu::TextureSampleType = wgpu::TextureSampleType::Float { filterable: false };

/// A texture of one sample.
pub const fn texture(
    sample_type: wgpu::TextureSampleType,
    view_dimension: wgpu::TextureViewDimension,
) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

const fn buffer(ty: wgpu::BufferBindingType, has_dynamic_offset: bool) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None }
}
