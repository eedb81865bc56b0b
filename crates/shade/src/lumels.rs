//! Lumels on the device: all pages of all lightmaps, in the layers of one texture; of each lightmap
//! those of slopes after those of light.

use glam::{UVec2, UVec3, Vec3};
use half::f16;
use lumencast_gpu::{Gpu, textures};
use lumencast_light::{Light, Lightmap, ScaleRule};
use rayon::prelude::*;

use crate::ShadeError;

/// Halves of a texel.
const CHANNELS: usize = 4;

/// The pages' texture.
#[derive(Debug)]
pub(crate) struct GpuLumels {
    pages: wgpu::Texture,
    scale: ScaleRule,
}

impl GpuLumels {
    /// No lumels.
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self { pages: texture(gpu, UVec3::ONE), scale: ScaleRule::default() }
    }

    /// Takes in other light: pages as large as before stay where they are.
    pub(crate) fn update(&mut self, gpu: &Gpu, light: &Light) -> Result<(), ShadeError> {
        let lightmaps: Vec<&Lightmap> = light.lightmaps().collect();
        let Some(size) = size(&lightmaps) else { return Ok(()) };
        let limits = gpu.device().limits();
        if size.x > limits.max_texture_dimension_2d || size.z > limits.max_texture_array_layers {
            return Err(ShadeError::Pages { side: size.x, pages: size.z });
        }
        if textures::volume_size(size) != self.pages.size() {
            (self.pages, self.scale) = (texture(gpu, size), ScaleRule::default());
        }
        let largest = |lightmap: &&Lightmap| {
            let values = lightmap.irradiance.par_iter().filter(|value| value.is_finite());
            values.copied().reduce(|| Vec3::ZERO, Vec3::max)
        };
        let largest: Vec<Vec3> = lightmaps.iter().map(largest).collect();
        let factor = f32::from(self.scale.update(&largest)).exp2().recip();
        let mut layer = 0;
        for lightmap in lightmaps {
            let side = lightmap.layout.page_size;
            let page_lumels = (side as usize).pow(2);
            let light = lightmap.irradiance.chunks(page_lumels).map(|page| (page, factor));
            let slopes = lightmap.slopes.iter().flat_map(|slopes| slopes.chunks(page_lumels));
            for (page, factor) in light.chain(slopes.map(|page| (page, 1.0))) {
                let texel = |value: &Vec3| {
                    let Vec3 { x, y, z } = factor * *value;
                    [x, y, z, 0.0].map(|value| f16::from_f32(value).to_bits())
                };
                let texels: Vec<[u16; CHANNELS]> = page.par_iter().map(texel).collect();
                let origin = wgpu::Origin3d { z: layer, ..wgpu::Origin3d::ZERO };
                let to = wgpu::TexelCopyTextureInfo { origin, ..self.pages.as_image_copy() };
                let size = textures::plane_size(UVec2::splat(side));
                gpu.write_texels(to, bytemuck::cast_slice(&texels), size);
                layer += 1;
            }
        }
        Ok(())
    }

    pub(crate) fn view(&self) -> wgpu::TextureView {
        self.pages.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        })
    }

    /// Irradiance is so many times what the texture holds.
    pub(crate) fn scale(&self) -> f32 {
        f32::from(self.scale.log2().unwrap_or(0)).exp2()
    }
}

/// The side of the largest page and the number of all, those of slopes too; nothing where there is none.
fn size(lightmaps: &[&Lightmap]) -> Option<UVec3> {
    let side = lightmaps.iter().map(|lightmap| lightmap.layout.page_size).max()?;
    let pages = |lightmap: &&Lightmap| {
        let pages = lightmap.layout.pages;
        if lightmap.slopes.is_some() { 2 * pages } else { pages }
    };
    let pages: u32 = lightmaps.iter().map(pages).sum();
    (side > 0 && pages > 0).then_some(UVec3::new(side, side, pages))
}

fn texture(gpu: &Gpu, size: UVec3) -> wgpu::Texture {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some("pages"),
        size: textures::volume_size(size),
        ..textures::plane(UVec2::ONE, wgpu::TextureFormat::Rgba16Float, usage)
    })
}
