//! Entries of bind group layouts, as the groups of the shaders want them.

/// A binding that fragments read.
pub(crate) fn entry(binding: u32, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    let visibility = wgpu::ShaderStages::FRAGMENT;
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

/// A uniform buffer.
pub(crate) const UNIFORM: wgpu::BindingType = buffer(wgpu::BufferBindingType::Uniform);
/// A storage buffer that is only read.
pub(crate) const STORAGE: wgpu::BindingType =
    buffer(wgpu::BufferBindingType::Storage { read_only: true });
/// A storage buffer that is written.
pub(crate) const WRITTEN: wgpu::BindingType =
    buffer(wgpu::BufferBindingType::Storage { read_only: false });
/// A sampler that filters.
pub(crate) const SAMPLER: wgpu::BindingType =
    wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
/// What is filtered.
pub(crate) const FILTERED: wgpu::TextureSampleType =
    wgpu::TextureSampleType::Float { filterable: true };

/// A picture, read pixel by pixel.
pub(crate) const PICTURE: wgpu::BindingType =
    texture(wgpu::TextureSampleType::Float { filterable: false }, wgpu::TextureViewDimension::D2);

const fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// A texture of one sample.
pub(crate) const fn texture(
    sample_type: wgpu::TextureSampleType,
    view_dimension: wgpu::TextureViewDimension,
) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}
