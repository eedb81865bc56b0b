//! Ambient occlusion in screen space: how much of its half space each pixel's surface sees within a
//! short distance, by what the picture's own depth shows.
//!
//! Three passes a view, before its picture: depth, of one sample a pixel; visibility, at as many pixels,
//! which differ in where they look; and the mean of 4×4 of them that are of one surface. The picture
//! reads the result where its own depth is that of the pixel (`ambient_visibility` of the shader).
//! Six bytes a pixel.

use std::iter;

use glam::UVec2;
use lumencast_gpu::Gpu;
use lumencast_gpu::bindings::{DEPTHS, PICTURE, UNIFORM};
use lumencast_gpu::textures::{self, DEPTH};
use lumencast_shaders::{layout, occlusion};

use crate::settings::Occlusion;
use crate::timing::{Commands, Stage};

/// The visible share of a half space.
const VISIBILITY: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// What finds occlusion.
#[derive(Debug)]
pub(crate) struct Occluder {
    textures: Textures,
    /// Not made before they are wanted.
    pipelines: Option<Pipelines>,
}

/// What passes draw and pictures read. Each has a single pixel where there is no occlusion.
#[derive(Debug)]
struct Textures {
    size: UVec2,
    depth: wgpu::TextureView,
    rough: wgpu::TextureView,
    smooth: wgpu::TextureView,
}

#[derive(Debug)]
struct Pipelines {
    find_layout: wgpu::BindGroupLayout,
    find: wgpu::RenderPipeline,
    blur_layout: wgpu::BindGroupLayout,
    blur: wgpu::RenderPipeline,
}

/// The bindings of the passes of a frame.
#[derive(Debug)]
pub(crate) struct Groups {
    find: wgpu::BindGroup,
    blur: wgpu::BindGroup,
}

impl Occluder {
    /// What pictures without occlusion bind.
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self { textures: Textures::new(gpu, UVec2::ONE), pipelines: None }
    }

    /// Makes ready for pictures of a size; `pass`: the bindings of group 0.
    pub(crate) fn prepare(&mut self, gpu: &Gpu, pass: &wgpu::BindGroupLayout, size: UVec2) {
        if self.textures.size != size {
            self.textures = Textures::new(gpu, size);
        }
        self.pipelines.get_or_insert_with(|| Pipelines::new(gpu, pass));
    }

    /// What the depth of a view is drawn into.
    pub(crate) fn depth(&self) -> &wgpu::TextureView {
        &self.textures.depth
    }

    /// What a picture reads.
    pub(crate) fn visibility(&self) -> &wgpu::TextureView {
        &self.textures.smooth
    }

    /// What the passes of a frame bind; nothing where it was not made ready.
    pub(crate) fn groups(&self, gpu: &Gpu, settings: Occlusion) -> Option<Groups> {
        let pipelines = self.pipelines.as_ref()?;
        let settings = layout::Occlusion {
            radius: settings.radius,
            directions: settings.directions.max(1),
            steps: settings.steps.max(1),
            _pad: 0,
        };
        let uniform = wgpu::BufferUsages::UNIFORM;
        let settings = gpu.buffer("occlusion", uniform, bytemuck::bytes_of(&settings), 0);
        let group = |layout, views: &[&wgpu::TextureView]| {
            let views = views.iter().map(|view| wgpu::BindingResource::TextureView(view));
            let resources: Vec<_> = iter::once(settings.as_entire_binding()).chain(views).collect();
            gpu.group("occlusion", layout, &resources)
        };
        let Textures { depth, rough, .. } = &self.textures;
        Some(Groups {
            find: group(&pipelines.find_layout, &[depth]),
            blur: group(&pipelines.blur_layout, &[depth, rough]),
        })
    }

    /// Draws visibility, once depth is drawn; `bind` binds group 0.
    pub(crate) fn draw(
        &self,
        commands: &mut Commands,
        groups: &Groups,
        bind: impl Fn(&mut wgpu::RenderPass<'_>),
    ) {
        let Some(pipelines) = &self.pipelines else { return };
        for (pipeline, group, onto) in [
            (&pipelines.find, &groups.find, &self.textures.rough),
            (&pipelines.blur, &groups.blur, &self.textures.smooth),
        ] {
            let color = wgpu::RenderPassColorAttachment {
                view: onto,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                    store: wgpu::StoreOp::Store,
                },
            };
            let (encoder, timestamp_writes) = commands.pass(Stage::Occlusion);
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("occlusion"),
                color_attachments: &[Some(color)],
                timestamp_writes,
                ..Default::default()
            });
            pass.set_pipeline(pipeline);
            bind(&mut pass);
            pass.set_bind_group(1, group, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}

impl Textures {
    fn new(gpu: &Gpu, size: UVec2) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        let view = |label, format| {
            textures::view(&gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                ..textures::plane(size, format, usage)
            }))
        };
        Self {
            size,
            depth: view("depth of pixels", DEPTH),
            rough: view("visibility", VISIBILITY),
            smooth: view("smooth visibility", VISIBILITY),
        }
    }
}

impl Pipelines {
    fn new(gpu: &Gpu, pass: &wgpu::BindGroupLayout) -> Self {
        let group = |types| gpu.group_layout("occlusion", wgpu::ShaderStages::FRAGMENT, types);
        let find_layout = group(&[UNIFORM, DEPTHS]);
        let blur_layout = group(&[UNIFORM, DEPTHS, PICTURE]);
        let module = gpu.shader("occlusion", occlusion());
        let find = pipeline(gpu, &[Some(pass), Some(&find_layout)], &module, "occlusion_fragment");
        let blur = pipeline(gpu, &[Some(pass), Some(&blur_layout)], &module, "blur_fragment");
        Self { find_layout, find, blur_layout, blur }
    }
}

fn pipeline(
    gpu: &Gpu,
    groups: &[Option<&wgpu::BindGroupLayout>],
    module: &wgpu::ShaderModule,
    fragment_entry: &str,
) -> wgpu::RenderPipeline {
    let layout = gpu.pipeline_layout("occlusion", groups);
    gpu.device().create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment_entry),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("occlusion_vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment_entry),
            compilation_options: Default::default(),
            targets: &[Some(VISIBILITY.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
