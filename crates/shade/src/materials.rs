//! Materials on the device: numbers and textures, one bind group each.

use glam::{Affine2, Vec4};
use lumencast_gpu::Gpu;
use lumencast_gpu::bindings::{FILTERED, SAMPLER, UNIFORM, texture};
use lumencast_scene::{AlphaMode, Material, TextureRef};
use lumencast_shaders::layout::{self, material};

use crate::settings::Materials;
use crate::textures::{Coding, Textures};

/// How a primitive's material wants it drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Surface {
    /// Covers all.
    Solid,
    /// Has holes.
    Masked,
    /// Covers in part.
    Blended,
}

/// A material on the device.
#[derive(Debug)]
pub(crate) struct GpuMaterial {
    pub(crate) group: wgpu::BindGroup,
    pub(crate) surface: Surface,
}

/// How many textures a material has.
const MAPS: usize = 8;

/// The bindings of group 3: numbers, then a texture and a sampler for each map.
pub(crate) fn group_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let map = [texture(FILTERED, wgpu::TextureViewDimension::D2), SAMPLER];
    let types = [&[UNIFORM][..], &map.repeat(MAPS)].concat();
    gpu.group_layout("material", wgpu::ShaderStages::FRAGMENT, &types)
}

impl GpuMaterial {
    pub(crate) fn new(
        gpu: &Gpu,
        group_layout: &wgpu::BindGroupLayout,
        textures: &mut Textures,
        material: &Material,
        model: Materials,
    ) -> Self {
        let maps = maps(material);
        let views = maps.map(|(map, coding)| textures.view(gpu, map, coding));
        let samplers = maps.map(|(map, _)| textures.sampler(gpu, map));
        let numbers = numbers(material, model);
        let uniform = wgpu::BufferUsages::UNIFORM;
        let buffer = gpu.buffer("material", uniform, bytemuck::bytes_of(&numbers), 0);
        let mut resources = vec![buffer.as_entire_binding()];
        for (view, sampler) in views.iter().zip(&samplers) {
            resources.push(wgpu::BindingResource::TextureView(view));
            resources.push(wgpu::BindingResource::Sampler(sampler));
        }
        let group = gpu.group(&material.name, group_layout, &resources);
        Self { group, surface: surface(material, model) }
    }
}

fn surface(material: &Material, model: Materials) -> Surface {
    match (model, material.alpha_mode) {
        (Materials::Lambert, _) | (Materials::Full, AlphaMode::Opaque) => Surface::Solid,
        (Materials::Full, AlphaMode::Mask(_)) => Surface::Masked,
        (Materials::Full, AlphaMode::Blend) => Surface::Blended,
    }
}

/// The maps of a material, in the order of the bindings.
fn maps(m: &Material) -> [(Option<&TextureRef>, Coding); MAPS] {
    [
        (m.base_color_texture.as_ref(), Coding::Srgb),
        (m.metallic_roughness_texture.as_ref(), Coding::Linear),
        (m.normal_texture.as_ref(), Coding::Linear),
        (m.emissive_texture.as_ref(), Coding::Srgb),
        (m.specular_texture.as_ref(), Coding::Linear),
        (m.specular_color_texture.as_ref(), Coding::Srgb),
        (m.transmission_texture.as_ref(), Coding::Linear),
        (m.occlusion_texture.as_ref(), Coding::Linear),
    ]
}

fn numbers(m: &Material, model: Materials) -> layout::Material {
    let bit = |is: bool, bit: u32| if is { bit } else { 0 };
    let [
        base_color_map,
        metallic_roughness_map,
        normal_map,
        emissive_map,
        specular_map,
        specular_color_map,
        transmission_map,
        occlusion_map,
    ] = maps(m).map(|(texture, _)| map(texture));
    layout::Material {
        base_color: m.base_color,
        emissive: m.emissive,
        metallic: m.metallic,
        specular_color: m.specular_color,
        roughness: m.roughness,
        transmission: m.transmission,
        ior: m.ior,
        specular: m.specular,
        normal_scale: m.normal_scale,
        occlusion_strength: m.occlusion_strength,
        cutoff: match m.alpha_mode {
            AlphaMode::Mask(cutoff) => cutoff,
            AlphaMode::Opaque | AlphaMode::Blend => 0.0,
        },
        flags: bit(m.double_sided, material::DOUBLE_SIDED)
            | bit(m.unlit, material::UNLIT)
            | bit(m.alpha_mode == AlphaMode::Blend, material::BLEND)
            | bit(model == Materials::Lambert, material::LAMBERT),
        _pad: 0,
        base_color_map,
        metallic_roughness_map,
        normal_map,
        emissive_map,
        specular_map,
        specular_color_map,
        transmission_map,
        occlusion_map,
    }
}

fn map(texture: Option<&TextureRef>) -> layout::Map {
    let (transform, set, is_there) = match texture {
        Some(t) => (t.texture_from_mesh, t.tex_coord.min(1) as f32, 1.0),
        None => (Affine2::IDENTITY, 0.0, 0.0),
    };
    let (linear, t) = (transform.matrix2, transform.translation);
    layout::Map {
        row0: Vec4::new(linear.x_axis.x, linear.y_axis.x, t.x, set),
        row1: Vec4::new(linear.x_axis.y, linear.y_axis.y, t.y, is_there),
    }
}
