//! The passes of a frame over the scene: what each looks from, and what it draws.

use lumencast_gpu::Gpu;
use lumencast_shaders::layout;

use crate::camera::{Camera, Frustum};
use crate::materials::Surface;
use crate::scene::{Call, GpuScene};
use crate::settings::Transparency;

/// What a frame's passes look from.
#[derive(Clone, Copy)]
pub(crate) struct Viewers<'a> {
    pub(crate) shadows: &'a [layout::ShadowView],
    pub(crate) cameras: &'a [Camera],
    /// How cameras see blended surfaces.
    pub(crate) transparency: Transparency,
    /// How far patterns are turned, parts of a turn.
    pub(crate) turn: f32,
}

/// The passes of a frame over the scene: those of shadow maps, then those of cameras.
pub(crate) struct Passes {
    /// Group 0, which holds the views of all passes.
    group: wgpu::BindGroup,
    /// Bytes from one pass's view to the next's.
    stride: u32,
    shadows: Vec<Vec<Call>>,
    cameras: Vec<Vec<Call>>,
}

/// One of the passes.
#[derive(Clone, Copy)]
pub(crate) struct Pass<'a> {
    group: &'a wgpu::BindGroup,
    /// Where its view lies in the group, bytes.
    offset: u32,
    /// What it draws, in this order.
    pub(crate) calls: &'a [Call],
}

impl Pass<'_> {
    /// Binds what the pass looks from.
    pub(crate) fn bind(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(0, self.group, &[self.offset]);
    }
}

impl Passes {
    /// `layout`: the bindings of group 0.
    pub(crate) fn new(
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        scene: &GpuScene,
        viewers: &Viewers<'_>,
    ) -> Self {
        // The instances that the passes draw.
        let mut visible = Vec::new();
        let Viewers { shadows, cameras, transparency, turn } = *viewers;
        let casters = |view: &layout::ShadowView| {
            scene.calls(&Frustum::new(&view.clip_from_world), &mut visible, |_| true)
        };
        let shadow_calls = shadows.iter().map(casters).collect();
        let seen = |camera: &Camera| seen(scene, camera, transparency, &mut visible);
        let camera_calls = cameras.iter().map(seen).collect();
        let views: Vec<layout::View> = shadows
            .iter()
            .map(|view| layout::View {
                clip_from_world: view.clip_from_world,
                ..Default::default()
            })
            .chain(cameras.iter().map(|camera| camera.layout(turn)))
            .collect();

        let size = size_of::<layout::View>();
        let alignment = gpu.device().limits().min_uniform_buffer_offset_alignment;
        let stride = (size as u32).next_multiple_of(alignment);
        let mut bytes = vec![0; stride as usize * views.len().max(1)];
        for (slot, view) in bytes.chunks_exact_mut(stride as usize).zip(&views) {
            slot[..size].copy_from_slice(bytemuck::bytes_of(view));
        }
        let views = gpu.buffer("views", wgpu::BufferUsages::UNIFORM, &bytes, 0);
        let storage = wgpu::BufferUsages::STORAGE;
        let visible = gpu.buffer("visible", storage, bytemuck::cast_slice(&visible), 4);
        let view = wgpu::BufferBinding {
            buffer: &views,
            offset: 0,
            size: std::num::NonZeroU64::new(size as u64),
        };
        let resources = [
            wgpu::BindingResource::Buffer(view),
            scene.instances.as_entire_binding(),
            visible.as_entire_binding(),
            scene.rectangles.as_entire_binding(),
        ];
        let group = gpu.group("pass", layout, &resources);
        Self { group, stride, shadows: shadow_calls, cameras: camera_calls }
    }

    /// A pass for each shadow map.
    pub(crate) fn shadows(&self) -> impl Iterator<Item = Pass<'_>> {
        self.shadows.iter().zip(0..).map(|(calls, number)| self.pass(number, calls))
    }

    /// A pass for each camera.
    pub(crate) fn cameras(&self) -> impl Iterator<Item = Pass<'_>> {
        let first = self.shadows.len() as u32;
        self.cameras.iter().zip(first..).map(|(calls, number)| self.pass(number, calls))
    }

    fn pass<'a>(&'a self, number: u32, calls: &'a [Call]) -> Pass<'a> {
        Pass { group: &self.group, offset: number * self.stride, calls }
    }
}

/// What a camera shows, in the order in which it is drawn.
fn seen(
    scene: &GpuScene,
    camera: &Camera,
    transparency: Transparency,
    visible: &mut Vec<u32>,
) -> Vec<Call> {
    let frustum = Frustum::new(&camera.clip_from_world);
    match transparency {
        Transparency::Coverage => scene.calls(&frustum, visible, |_| true),
        Transparency::Sorted => {
            let solid = |surface| surface != Surface::Blended;
            let mut calls = scene.calls(&frustum, visible, solid);
            calls.extend(scene.sorted_calls(&frustum, camera.eye, visible));
            calls
        }
    }
}
