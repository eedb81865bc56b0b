//! Punctual lights, shadow maps and the environment on the device: group 1 of the shaders.

use std::sync::Arc;

use glam::{UVec2, UVec3, Vec3};
use half::f16;
use lumencast_gpu::Gpu;
use lumencast_gpu::bindings::{
    DEPTHS, FILTERED, NEAREST_SAMPLER, PICTURE, SAMPLER, STORAGE, UNIFORM, texture,
};
use lumencast_gpu::textures::{self, DEPTH};
use lumencast_scene::{Environment, HdrImage, LightKind, PlacedLight, PunctualLight};
use lumencast_shaders::layout::{self, light};

use crate::environment_brdf::{Reflected, environment_brdf};
use crate::frame::Frame;
use crate::occlusion::Occluder;
use crate::shadows::ShadowPlan;

/// Entries a side of the environment BRDF's table.
const TABLE: usize = 32;

/// What lights a frame.
#[derive(Debug)]
pub(crate) struct GpuLights {
    pub(crate) layout: wgpu::BindGroupLayout,
    nearest: wgpu::Sampler,
    linear: wgpu::Sampler,
    table: wgpu::TextureView,
    picture: (Option<Arc<HdrImage>>, wgpu::TextureView),
    maps: wgpu::Texture,
}

/// The bindings of group 1.
fn group_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let table = texture(FILTERED, wgpu::TextureViewDimension::D2);
    let maps = texture(wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2Array);
    let types = [
        UNIFORM,
        UNIFORM,
        PICTURE,
        STORAGE,
        STORAGE,
        maps,
        NEAREST_SAMPLER,
        table,
        SAMPLER,
        PICTURE,
        DEPTHS,
    ];
    gpu.group_layout("light", wgpu::ShaderStages::FRAGMENT, &types)
}

impl GpuLights {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let sampler = |label, filter| {
            gpu.device().create_sampler(&wgpu::SamplerDescriptor {
                label: Some(label),
                mag_filter: filter,
                min_filter: filter,
                ..Default::default()
            })
        };
        Self {
            layout: group_layout(gpu),
            nearest: sampler("shadows", wgpu::FilterMode::Nearest),
            linear: sampler("table", wgpu::FilterMode::Linear),
            table: table(gpu),
            picture: (None, picture(gpu, UVec2::ONE, &[Vec3::ZERO])),
            maps: maps(gpu, 1, 1),
        }
    }

    /// Makes room for a plan's shadow maps, and returns a view of each.
    pub(crate) fn shadow_maps(&mut self, gpu: &Gpu, plan: &ShadowPlan) -> Vec<wgpu::TextureView> {
        let (side, layers) = (plan.resolution.max(1), plan.views.len().max(1) as u32);
        if (self.maps.width(), self.maps.depth_or_array_layers()) != (side, layers) {
            self.maps = maps(gpu, side, layers);
        }
        let layer = |base_array_layer| {
            self.maps.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        };
        (0..plan.views.len() as u32).map(layer).collect()
    }

    /// The group to bind.
    pub(crate) fn group(
        &mut self,
        gpu: &Gpu,
        frame: &Frame<'_>,
        occlusion: &Occluder,
    ) -> wgpu::BindGroup {
        let Frame { snapshot, plan, .. } = *frame;
        let environment = self.environment(gpu, &snapshot.environment);
        let lights: Vec<layout::PunctualLight> = snapshot
            .lights
            .iter()
            .zip(&plan.lights)
            .map(|(light, &(first, count))| of_light(light, first, count))
            .collect();
        let uniform =
            |label, contents: &[u8]| gpu.buffer(label, wgpu::BufferUsages::UNIFORM, contents, 0);
        let storage = |label, contents: &[u8], least: usize| {
            gpu.buffer(label, wgpu::BufferUsages::STORAGE, contents, least as u64)
        };
        let frame = uniform("frame", bytemuck::bytes_of(&frame.layout()));
        let environment = uniform("environment", bytemuck::bytes_of(&environment));
        let lights =
            storage("lights", bytemuck::cast_slice(&lights), size_of::<layout::PunctualLight>());
        let least = size_of::<layout::ShadowView>();
        let views = storage("shadow views", bytemuck::cast_slice(&plan.views), least);
        let maps = self.maps.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let texture = wgpu::BindingResource::TextureView;
        let sampler = wgpu::BindingResource::Sampler;
        let resources = [
            frame.as_entire_binding(),
            environment.as_entire_binding(),
            texture(&self.picture.1),
            lights.as_entire_binding(),
            views.as_entire_binding(),
            texture(&maps),
            sampler(&self.nearest),
            texture(&self.table),
            sampler(&self.linear),
            texture(occlusion.visibility()),
            texture(occlusion.depth()),
        ];
        gpu.group("light", &self.layout, &resources)
    }

    fn environment(&mut self, gpu: &Gpu, environment: &Environment) -> layout::Environment {
        match environment {
            Environment::Constant { radiance } => elevation(*radiance, *radiance, *radiance),
            Environment::Sky { zenith, horizon, ground } => elevation(*zenith, *horizon, *ground),
            Environment::Image { image: None, .. } => elevation(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO),
            Environment::Image { image: Some(image), intensity, rotation, .. } => {
                if !self.picture.0.as_ref().is_some_and(|known| Arc::ptr_eq(known, image)) {
                    let view = picture(gpu, UVec2::new(image.width, image.height), &image.texels);
                    self.picture = (Some(image.clone()), view);
                }
                layout::Environment {
                    zenith: Vec3::splat(*intensity),
                    kind: 1,
                    turn: rotation / std::f32::consts::TAU,
                    ..layout::Environment::default()
                }
            }
        }
    }
}

fn elevation(zenith: Vec3, horizon: Vec3, ground: Vec3) -> layout::Environment {
    layout::Environment { zenith, horizon, ground, ..layout::Environment::default() }
}

fn of_light(placed: &PlacedLight, first_shadow: u32, shadow_count: u32) -> layout::PunctualLight {
    let PunctualLight { kind, color, intensity, range } = placed.light;
    let (cone_scale, cone_offset) = match kind {
        LightKind::Spot { inner, outer, .. } => {
            let scale = 1.0 / (inner.cos() - outer.cos()).max(0.001);
            (scale, -outer.cos() * scale)
        }
        _ => (0.0, 1.0),
    };
    let (kind, size) = match kind {
        LightKind::Point { radius } => (light::POINT, radius),
        LightKind::Spot { radius, .. } => (light::SPOT, radius),
        LightKind::Directional { angle } => (light::DIRECTIONAL, (0.5 * angle).tan()),
    };
    layout::PunctualLight {
        position: placed.position,
        kind,
        direction: placed.direction,
        size,
        intensity: color * intensity,
        window: range.map_or(0.0, |range| range.powi(-4)),
        cone_scale,
        cone_offset,
        first_shadow,
        shadow_count,
    }
}

fn maps(gpu: &Gpu, side: u32, layers: u32) -> wgpu::Texture {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some("shadow maps"),
        size: textures::volume_size(UVec3::new(side, side, layers)),
        ..textures::plane(UVec2::ONE, DEPTH, usage)
    })
}

/// The environment BRDF, as halves. The left half has a, b and the mean direction, the right the bands.
fn table(gpu: &Gpu) -> wgpu::TextureView {
    let entries = environment_brdf(TABLE);
    let left = |e: &Reflected| [e.albedo.x, e.albedo.y, e.mean.x, e.mean.y];
    let right = |e: &Reflected| [e.bands.x, e.bands.y, e.bands.z, 0.0];
    let halves: Vec<u16> = entries
        .chunks(TABLE)
        .flat_map(|row| row.iter().map(left).chain(row.iter().map(right)))
        .flatten()
        .map(|v| f16::from_f32(v).to_bits())
        .collect();
    let format = wgpu::TextureFormat::Rgba16Float;
    let side = TABLE as u32;
    let size = UVec2::new(2 * side, side);
    plane(gpu, "environment BRDF", format, size, bytemuck::cast_slice(&halves))
}

/// The environment's picture in f32: suns do not fit halves.
fn picture(gpu: &Gpu, size: UVec2, texels: &[Vec3]) -> wgpu::TextureView {
    let texels: Vec<[f32; 4]> = texels.iter().map(|t| t.extend(1.0).to_array()).collect();
    let format = wgpu::TextureFormat::Rgba32Float;
    plane(gpu, "environment", format, size, bytemuck::cast_slice(&texels))
}

fn plane(
    gpu: &Gpu,
    label: &str,
    format: wgpu::TextureFormat,
    size: UVec2,
    texels: &[u8],
) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        ..textures::plane(size, format, usage)
    });
    gpu.write_texels(texture.as_image_copy(), texels, texture.size());
    textures::view(&texture)
}
