//! Pipelines: how each kind of surface is drawn in each kind of pass.

use lumencast_gpu::Gpu;
use lumencast_gpu::bindings::{STORAGE, UNIFORM_BY_OFFSET};
use lumencast_gpu::textures::{COLOR, DEPTH};
use lumencast_shaders::{Shading, background, depth, forward, pages};

use crate::materials::Surface;
use crate::pages::VERTEX_LAYOUT;
use crate::part;
use crate::settings::Transparency;

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
    /// Puts the depth of solid surfaces into a picture, before they are shaded.
    pub(crate) first: wgpu::RenderPipeline,
    solid: wgpu::RenderPipeline,
    masked: wgpu::RenderPipeline,
    blended: wgpu::RenderPipeline,
    pub(crate) background: wgpu::RenderPipeline,
    pub(crate) pages: wgpu::RenderPipeline,
}

/// What pipelines have in common, and those that no variant changes.
#[derive(Debug)]
pub(crate) struct Layouts {
    pub(crate) pass: wgpu::BindGroupLayout,
    forward: wgpu::PipelineLayout,
    background: wgpu::PipelineLayout,
    pages: wgpu::PipelineLayout,
    depth: wgpu::PipelineLayout,
    solid_depth: wgpu::RenderPipeline,
    masked_depth: wgpu::RenderPipeline,
}

/// The bindings of group 0.
fn pass_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let types = [UNIFORM_BY_OFFSET, STORAGE, STORAGE, STORAGE];
    gpu.group_layout("pass", wgpu::ShaderStages::VERTEX_FRAGMENT, &types)
}

impl Layouts {
    /// `light`, `field` and `material`: the bindings of groups 1 to 3.
    pub(crate) fn new(
        gpu: &Gpu,
        light: &wgpu::BindGroupLayout,
        field: &wgpu::BindGroupLayout,
        material: &wgpu::BindGroupLayout,
    ) -> Self {
        let device = gpu.device();
        let pass = pass_layout(gpu);
        let layout = |label, groups: &[_]| gpu.pipeline_layout(label, groups);
        let forward = layout("forward", &[Some(&pass), Some(light), Some(field), Some(material)]);
        let background = layout("background", &[Some(&pass), Some(light)]);
        let pages = layout("pages", &[None, Some(light), Some(field)]);
        let module = gpu.shader("depth", depth());
        let depth = layout("depth", &[Some(&pass)]);
        let masked = layout("masked depth", &[Some(&pass), None, None, Some(material)]);
        let into_map = |layout, vertex, fragment| {
            let depth = depth_state(wgpu::CompareFunction::Greater, true);
            let drawn = MeshPipeline {
                label: "depth",
                layout,
                module: &module,
                vertex,
                fragment,
                constants: &[],
                target: None,
                depth,
                samples: 1,
            };
            drawn.create(device)
        };
        let solid_depth = into_map(&depth, "depth_vertex", None);
        let masked_depth = into_map(&masked, "masked_depth_vertex", Some("masked_depth_fragment"));
        Self { pass, forward, background, pages, depth, solid_depth, masked_depth }
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
        let device = gpu.device();
        let module = gpu.shader("forward", forward(variant.shading));
        let only_depth = gpu.shader("depth", depth());
        let nothing =
            wgpu::ColorTargetState { write_mask: wgpu::ColorWrites::empty(), ..COLOR.into() };
        let first = MeshPipeline {
            label: "depth",
            layout: &layouts.depth,
            module: &only_depth,
            vertex: "depth_vertex",
            fragment: Some("depth_fragment"),
            constants: &[],
            target: Some(nothing),
            depth: depth_state(wgpu::CompareFunction::Greater, true),
            samples: variant.samples,
        };
        let behind = FlatPipeline {
            label: "background",
            layout: &layouts.background,
            module: &gpu.shader("background", background()),
            entries: ["background_vertex", "background_fragment"],
            buffers: &[],
            topology: wgpu::PrimitiveTopology::TriangleList,
            // Where nothing was drawn: depth 0 is infinitely far.
            compare: wgpu::CompareFunction::Equal,
        };
        let in_front = FlatPipeline {
            label: "pages",
            layout: &layouts.pages,
            module: &gpu.shader("pages", pages()),
            entries: ["pages_vertex", "pages_fragment"],
            buffers: &[Some(VERTEX_LAYOUT)],
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            compare: wgpu::CompareFunction::Always,
        };
        Self {
            variant,
            first: first.create(device),
            solid: forward_pipeline(device, layouts, &module, variant, Surface::Solid),
            masked: forward_pipeline(device, layouts, &module, variant, Surface::Masked),
            blended: forward_pipeline(device, layouts, &module, variant, Surface::Blended),
            background: behind.create(device, variant.samples),
            pages: in_front.create(device, variant.samples),
        }
    }

    pub(crate) fn forward(&self, surface: Surface) -> &wgpu::RenderPipeline {
        match surface {
            Surface::Solid => &self.solid,
            Surface::Masked => &self.masked,
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
    surface: Surface,
) -> wgpu::RenderPipeline {
    let is_solid = surface == Surface::Solid;
    let blends = surface == Surface::Blended && variant.transparency == Transparency::Sorted;
    let constant = |is: bool| f64::from(u8::from(is));
    let constants = [("BLENDED", constant(blends)), ("OCCLUDED", constant(variant.occluded))];
    let depth = if is_solid {
        // It is there already.
        depth_state(wgpu::CompareFunction::Equal, false)
    } else {
        depth_state(wgpu::CompareFunction::Greater, !blends)
    };
    let drawn = MeshPipeline {
        label: "forward",
        layout: &layouts.forward,
        module,
        vertex: "forward_vertex",
        fragment: Some(if is_solid { "solid_fragment" } else { "holed_fragment" }),
        constants: &constants,
        target: Some(wgpu::ColorTargetState {
            format: COLOR,
            blend: blends.then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            write_mask: wgpu::ColorWrites::ALL,
        }),
        depth,
        samples: variant.samples,
    };
    drawn.create(device)
}

/// What a pipeline that draws meshes is made of.
struct MeshPipeline<'a> {
    label: &'a str,
    layout: &'a wgpu::PipelineLayout,
    module: &'a wgpu::ShaderModule,
    vertex: &'a str,
    fragment: Option<&'a str>,
    /// Values of the fragment's overrides.
    constants: &'a [(&'a str, f64)],
    /// The colours that are written, if any.
    target: Option<wgpu::ColorTargetState>,
    depth: wgpu::DepthStencilState,
    samples: u32,
}

impl MeshPipeline<'_> {
    fn create(self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let buffers = part::vertex_layouts();
        let targets = [self.target];
        let fragment = self.fragment.map(|entry| wgpu::FragmentState {
            module: self.module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: self.constants,
                ..Default::default()
            },
            targets: if targets[0].is_some() { &targets } else { &[] },
        });
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.label),
            layout: Some(self.layout),
            vertex: vertex(self.module, self.vertex, &buffers),
            // Nothing is culled: backs of single-sided materials hide what lies behind them.
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(self.depth),
            multisample: multisample(self.samples),
            fragment,
            multiview_mask: None,
            cache: None,
        })
    }
}

/// What a pipeline that draws flat before or behind all meshes is made of.
struct FlatPipeline<'a> {
    label: &'a str,
    layout: &'a wgpu::PipelineLayout,
    module: &'a wgpu::ShaderModule,
    /// Of vertices and fragments.
    entries: [&'a str; 2],
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    topology: wgpu::PrimitiveTopology,
    /// Where it is drawn, by the depth that is there.
    compare: wgpu::CompareFunction,
}

impl FlatPipeline<'_> {
    fn create(self, device: &wgpu::Device, samples: u32) -> wgpu::RenderPipeline {
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.label),
            layout: Some(self.layout),
            vertex: vertex(self.module, self.entries[0], self.buffers),
            primitive: wgpu::PrimitiveState { topology: self.topology, ..Default::default() },
            depth_stencil: Some(depth_state(self.compare, false)),
            multisample: multisample(samples),
            fragment: Some(wgpu::FragmentState {
                module: self.module,
                entry_point: Some(self.entries[1]),
                compilation_options: Default::default(),
                targets: &[Some(COLOR.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
