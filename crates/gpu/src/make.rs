//! What a device is made to hold: shaders, bindings, pipelines, buffers, texels.

use std::borrow::Cow;

use crate::device::Gpu;

impl Gpu {
    /// A shader module of WGSL. Where it is not valid, the device complains.
    pub fn shader(&self, label: &str, source: impl Into<Cow<'static, str>>) -> wgpu::ShaderModule {
        self.device().create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        })
    }

    /// The layout of a group whose bindings 0, 1, 2 and so on are of these types, seen by these stages.
    pub fn group_layout(
        &self,
        label: &str,
        visibility: wgpu::ShaderStages,
        types: &[wgpu::BindingType],
    ) -> wgpu::BindGroupLayout {
        let entry =
            |(binding, &ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
        let entries: Vec<_> = (0..).zip(types).map(entry).collect();
        self.device().create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        })
    }

    /// A group that binds these resources to 0, 1, 2 and so on.
    pub fn group(
        &self,
        label: &str,
        layout: &wgpu::BindGroupLayout,
        resources: &[wgpu::BindingResource<'_>],
    ) -> wgpu::BindGroup {
        let numbered = (0..).zip(resources.iter().cloned());
        let entries: Vec<_> = numbered
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        self.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(label),
            layout,
            entries: &entries,
        })
    }

    /// The layout of a pipeline that has these groups 0, 1, 2 and so on.
    pub fn pipeline_layout(
        &self,
        label: &str,
        groups: &[Option<&wgpu::BindGroupLayout>],
    ) -> wgpu::PipelineLayout {
        self.device().create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: groups,
            immediate_size: 0,
        })
    }

    /// A pipeline that computes what a shader's entry point says, with these groups.
    pub fn compute(
        &self,
        label: &str,
        source: impl Into<Cow<'static, str>>,
        entry_point: &str,
        groups: &[&wgpu::BindGroupLayout],
    ) -> wgpu::ComputePipeline {
        let module = self.shader(label, source);
        let groups: Vec<_> = groups.iter().map(|group| Some(*group)).collect();
        let layout = self.pipeline_layout(label, &groups);
        self.device().create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            cache: None,
        })
    }

    /// A buffer with contents, which copies can go to. It has at least `least` bytes, since bindings
    /// may not be empty.
    pub fn buffer(
        &self,
        label: &str,
        usage: wgpu::BufferUsages,
        contents: &[u8],
        least: u64,
    ) -> wgpu::Buffer {
        let size = (contents.len() as u64).max(least).next_multiple_of(4);
        let buffer = self.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        if !contents.is_empty() {
            self.queue().write_buffer(&buffer, 0, contents);
        }
        buffer
    }

    /// Writes texels, row by row and slice by slice without gaps, to a box of `size` texels of an
    /// uncompressed texture, from the place and level on that `to` names.
    pub fn write_texels(
        &self,
        to: wgpu::TexelCopyTextureInfo<'_>,
        texels: &[u8],
        size: wgpu::Extent3d,
    ) {
        let rows = size.height * size.depth_or_array_layers;
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(texels.len() as u32 / rows),
            rows_per_image: Some(size.height),
        };
        self.queue().write_texture(to, texels, layout, size);
    }
}
