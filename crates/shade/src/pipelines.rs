//! Pipelines: how each kind of surface is drawn in each kind of pass.

use lumencast_shaders::{Shading, background, depth, forward};

use crate::gpu::{COLOR, DEPTH, Gpu};
use crate::materials::Surface;
use crate::settings::Transparency;
use crate::{geometry, materials};

/// What pipelines depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Variant {
    /// Samples a pixel in the target.
    pub(crate) samples: u32,
    pub(crate) shading: Shading,
    pub(crate) transparency: Transparency,
    /// Whether there is ambient occlusion.
    pub(crate) occluded: bool,
}

/// All pipelines of a variant.
#[derive(Debug)]
pub(crate) struct Pipelines {
    pub(crate) variant: Variant,
    forward: wgpu::RenderPipeline,
    blended: wgpu::RenderPipeline,
    pub(crate) background: wgpu::RenderPipeline,
}

/// What pipelines have in common, and those that no variant changes.
#[derive(Debug)]
pub(crate) struct Layouts {
    pub(crate) pass: wgpu::BindGroupLayout,
    pub(crate) material: wgpu::BindGroupLayout,
    forward: wgpu::PipelineLayout,
    background: wgpu::PipelineLayout,
    solid_depth: wgpu::RenderPipeline,
    masked_depth: wgpu::RenderPipeline,
}

/// The bindings of group 0.
fn pass_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty, has_dynamic_offset| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None },
        count: None,
    };
    let storage = wgpu::BufferBindingType::Storage { read_only: true };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("pass"),
        entries: &[
            entry(0, wgpu::BufferBindingType::Uniform, true),
            entry(1, storage, false),
            entry(2, storage, false),
        ],
    })
}

impl Layouts {
    /// `light` and `field`: the bindings of groups 1 and 2.
    pub(crate) fn new(
        gpu: &Gpu,
        light: &wgpu::BindGroupLayout,
        field: &wgpu::BindGroupLayout,
    ) -> Self {
        let device = &gpu.device;
        let pass = pass_layout(device);
        let material = materials::group_layout(device);
        let layout = |label, groups: &[Option<&wgpu::BindGroupLayout>]| {
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(label),
                bind_group_layouts: groups,
                immediate_size: 0,
            })
        };
        let forward = layout("forward", &[Some(&pass), Some(light), Some(field), Some(&material)]);
        let background = layout("background", &[Some(&pass), Some(light)]);
        let module = gpu.shader("depth", depth());
        let solid = layout("depth", &[Some(&pass)]);
        let masked = layout("masked depth", &[Some(&pass), None, None, Some(&material)]);
        let solid_depth = depth_pipeline(device, &solid, &module, "depth_vertex", None);
        let masked_depth = depth_pipeline(
            device,
            &masked,
            &module,
            "masked_depth_vertex",
            Some("masked_depth_fragment"),
        );
        Self { pass, material, forward, background, solid_depth, masked_depth }
    }

    pub(crate) fn depth(&self, surface: Surface) -> &wgpu::RenderPipeline {
        match surface {
            Surface::Solid => &self.solid_depth,
            Surface::Masked | Surface::Blended => &self.masked_depth,
        }
    }
}

impl Pipelines {
    pub(crate) fn new(gpu: &Gpu, layouts: &Layouts, variant: Variant) -> Self {
        let device = &gpu.device;
        let module = gpu.shader("forward", forward(variant.shading));
        let sky = gpu.shader("background", background());
        let is_sorted = variant.transparency == Transparency::Sorted;
        Self {
            variant,
            forward: forward_pipeline(device, layouts, &module, variant, false),
            blended: forward_pipeline(device, layouts, &module, variant, is_sorted),
            background: device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("background"),
                layout: Some(&layouts.background),
                vertex: vertex(&sky, "background_vertex", &[]),
                primitive: wgpu::PrimitiveState::default(),
                // Where nothing was drawn: depth 0 is infinitely far.
                depth_stencil: Some(depth_state(wgpu::CompareFunction::Equal, false)),
                multisample: multisample(variant.samples),
                fragment: Some(wgpu::FragmentState {
                    module: &sky,
                    entry_point: Some("background_fragment"),
                    compilation_options: Default::default(),
                    targets: &[Some(COLOR.into())],
                }),
                multiview_mask: None,
                cache: None,
            }),
        }
    }

    pub(crate) fn forward(&self, surface: Surface) -> &wgpu::RenderPipeline {
        match surface {
            Surface::Solid | Surface::Masked => &self.forward,
            Surface::Blended => &self.blended,
        }
    }
}

fn vertex<'a>(
    module: &'a wgpu::ShaderModule,
    entry: &'a str,
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
) -> wgpu::VertexState<'a> {
    wgpu::VertexState {
        module,
        entry_point: Some(entry),
        compilation_options: Default::default(),
        buffers,
    }
}

fn depth_state(compare: wgpu::CompareFunction, writes: bool) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(writes),
        depth_compare: Some(compare),
        stencil: Default::default(),
        bias: Default::default(),
    }
}

fn multisample(count: u32) -> wgpu::MultisampleState {
    wgpu::MultisampleState { count, ..Default::default() }
}

fn forward_pipeline(
    device: &wgpu::Device,
    layouts: &Layouts,
    module: &wgpu::ShaderModule,
    variant: Variant,
    blends: bool,
) -> wgpu::RenderPipeline {
    let buffers = geometry::vertex_layouts();
    let constant = |is: bool| f64::from(u8::from(is));
    let constants = [("BLENDED", constant(blends)), ("OCCLUDED", constant(variant.occluded))];
    let target = wgpu::ColorTargetState {
        format: COLOR,
        blend: blends.then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
        write_mask: wgpu::ColorWrites::ALL,
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("forward"),
        layout: Some(&layouts.forward),
        vertex: vertex(module, "forward_vertex", &buffers),
        // Nothing is culled: backs of single-sided materials hide what lies behind them.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(depth_state(wgpu::CompareFunction::Greater, !blends)),
        multisample: multisample(variant.samples),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("forward_fragment"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn depth_pipeline(
    device: &wgpu::Device,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    vertex_entry: &str,
    fragment_entry: Option<&str>,
) -> wgpu::RenderPipeline {
    let buffers = geometry::vertex_layouts();
    let fragment = fragment_entry.map(|entry| wgpu::FragmentState {
        module,
        entry_point: Some(entry),
        compilation_options: Default::default(),
        targets: &[],
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("depth"),
        layout: Some(layout),
        vertex: vertex(module, vertex_entry, &buffers),
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(depth_state(wgpu::CompareFunction::Greater, true)),
        multisample: multisample(1),
        fragment,
        multiview_mask: None,
        cache: None,
    })
}
