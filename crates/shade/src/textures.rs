//! Textures of materials, with their mips.
//!
//! A level is the mean of four texels of the level before, taken in linear light; so a texture seen
//! from afar is as bright as the mean of what the tracer meets there.

use std::collections::HashMap;
use std::sync::{Arc, LazyLock};

use glam::{UVec2, Vec3, Vec4};
use lumencast_gpu::{Gpu, textures};
use lumencast_picture::{linear_from_srgb, srgb_from_linear};
use lumencast_scene::{Filter, Image, TextureRef, Wrap};
use rayon::prelude::*;

/// How the RGB of a texture is coded; alpha is always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Coding {
    /// Colours.
    Srgb,
    /// Everything else.
    Linear,
}

/// Textures and samplers that are on the device, each once.
#[derive(Debug)]
pub(crate) struct Textures {
    /// Textures by their images' addresses. Each image is kept, so that no other takes its place.
    textures: HashMap<(usize, Coding), (Arc<Image>, wgpu::TextureView)>,
    samplers: HashMap<([Wrap; 2], Filter), wgpu::Sampler>,
    white: wgpu::TextureView,
    anisotropy: u16,
}

impl Textures {
    pub(crate) fn new(gpu: &Gpu, anisotropy: u16) -> Self {
        let white = upload(gpu, UVec2::ONE, &[vec![[255; 4]]], Coding::Linear);
        // In lavapipe, anisotropic filtering of surfaces whose UVs have no area gives NaN.
        let anisotropy = if gpu.is_software() { 1 } else { anisotropy.clamp(1, 16) };
        Self { textures: HashMap::new(), samplers: HashMap::new(), white, anisotropy }
    }

    /// Forgets textures whose materials are gone.
    pub(crate) fn forget_unused(&mut self) {
        self.textures.retain(|_, (image, _)| Arc::strong_count(image) > 1);
    }

    /// The texture to bind, white where there is none.
    pub(crate) fn view(
        &mut self,
        gpu: &Gpu,
        texture: Option<&TextureRef>,
        coding: Coding,
    ) -> wgpu::TextureView {
        let Some(texture) = texture else { return self.white.clone() };
        let image = &texture.image;
        let (_, view) =
            self.textures.entry((Arc::as_ptr(image).addr(), coding)).or_insert_with(|| {
                let largest = gpu.device().limits().max_texture_dimension_2d;
                let (size, levels) = mips(image, coding, largest);
                (image.clone(), upload(gpu, size, &levels, coding))
            });
        view.clone()
    }

    /// The sampler to bind.
    pub(crate) fn sampler(&mut self, gpu: &Gpu, texture: Option<&TextureRef>) -> wgpu::Sampler {
        let (wrap, filter) = texture.map_or_else(Default::default, |t| (t.wrap, t.filter));
        let anisotropy = self.anisotropy;
        let make = || {
            let mode = |wrap: Wrap| match wrap {
                Wrap::Repeat => wgpu::AddressMode::Repeat,
                Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
                Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
            };
            let (near, clamp) = match filter {
                Filter::Nearest => (wgpu::FilterMode::Nearest, 1),
                Filter::Linear => (wgpu::FilterMode::Linear, anisotropy),
            };
            gpu.device().create_sampler(&wgpu::SamplerDescriptor {
                label: Some("material"),
                address_mode_u: mode(wrap[0]),
                address_mode_v: mode(wrap[1]),
                mag_filter: near,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                anisotropy_clamp: clamp,
                ..Default::default()
            })
        };
        self.samplers.entry((wrap, filter)).or_insert_with(make).clone()
    }
}

/// All levels of an image, the first at most `largest` texels a side.
fn mips(image: &Image, coding: Coding, largest: u32) -> (UVec2, Vec<Vec<[u8; 4]>>) {
    let mut size = UVec2::new(image.width, image.height);
    let mut levels = vec![image.texels.clone()];
    let mut first = 0;
    while size.max_element() > 1 {
        if size.max_element() > largest {
            first = levels.len();
        }
        let last = levels.last().expect("there is the first level");
        let (next, half) = halved(last, size, coding);
        levels.push(next);
        size = half;
    }
    levels.drain(..first);
    let shrunk = |side: u32| (side >> first).max(1);
    (UVec2::new(shrunk(image.width), shrunk(image.height)), levels)
}

/// The next level. Each texel is the mean of those it covers; odd sides leave their last one out.
fn halved(texels: &[[u8; 4]], size: UVec2, coding: Coding) -> (Vec<[u8; 4]>, UVec2) {
    let half = (size / 2).max(UVec2::ONE);
    let texel = |x: u32, y: u32| {
        let (x, y) = (x.min(size.x - 1), y.min(size.y - 1));
        linear(texels[y as usize * size.x as usize + x as usize], coding)
    };
    let row = |y: u32| {
        (0..half.x).map(move |x| {
            let (x, y) = (2 * x, 2 * y);
            let sum = texel(x, y) + texel(x + 1, y) + texel(x, y + 1) + texel(x + 1, y + 1);
            coded(0.25 * sum, coding)
        })
    };
    ((0..half.y).into_par_iter().flat_map_iter(row).collect(), half)
}

/// What each code of sRGB stands for.
static LINEAR_FROM_SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| linear_from_srgb(Vec3::splat(code as f32 / 255.0)).x)
});

fn linear([r, g, b, a]: [u8; 4], coding: Coding) -> Vec4 {
    let code = Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a)) / 255.0;
    match coding {
        Coding::Linear => code,
        Coding::Srgb => {
            let of = |code: u8| LINEAR_FROM_SRGB[usize::from(code)];
            Vec4::new(of(r), of(g), of(b), code.w)
        }
    }
}

fn coded(linear: Vec4, coding: Coding) -> [u8; 4] {
    let code = match coding {
        Coding::Linear => linear,
        Coding::Srgb => srgb_from_linear(linear.truncate()).extend(linear.w),
    };
    (code * 255.0 + 0.5).to_array().map(|v| v as u8)
}

fn upload(gpu: &Gpu, size: UVec2, levels: &[Vec<[u8; 4]>], coding: Coding) -> wgpu::TextureView {
    let format = match coding {
        Coding::Srgb => wgpu::TextureFormat::Rgba8UnormSrgb,
        Coding::Linear => wgpu::TextureFormat::Rgba8Unorm,
    };
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some("material"),
        mip_level_count: levels.len() as u32,
        ..textures::plane(size, format, usage)
    });
    for (level, texels) in (0..).zip(levels) {
        let size = UVec2::new((size.x >> level).max(1), (size.y >> level).max(1));
        let to = wgpu::TexelCopyTextureInfo { mip_level: level, ..texture.as_image_copy() };
        gpu.write_texels(to, bytemuck::cast_slice(texels), textures::plane_size(size));
    }
    textures::view(&texture)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, texels: Vec<[u8; 4]>) -> Image {
        Image { name: String::new(), width, height, texels }
    }

    #[test]
    fn levels_are_means_of_linear_light() {
        let (black, white) = ([0, 0, 0, 0], [255; 4]);
        let checkers = image(2, 2, vec![black, white, white, black]);
        let (size, levels) = mips(&checkers, Coding::Srgb, 4096);
        assert_eq!((size, levels.len()), (UVec2::splat(2), 2));
        // Half the light is code 188 of sRGB; alpha is linear.
        assert_eq!(levels[1], [[188, 188, 188, 128]]);
        let (_, levels) = mips(&checkers, Coding::Linear, 4096);
        assert_eq!(levels[1], [[128; 4]]);
    }

    #[test]
    fn any_size_comes_down_to_one_texel() {
        let (size, levels) = mips(&image(5, 1, vec![[7; 4]; 5]), Coding::Linear, 4096);
        assert_eq!(size, UVec2::new(5, 1));
        assert_eq!(levels.iter().map(Vec::len).collect::<Vec<_>>(), [5, 2, 1]);
        assert!(levels.iter().flatten().all(|t| *t == [7; 4]));
    }

    #[test]
    fn images_too_large_for_the_device_lose_their_first_levels() {
        let (size, levels) = mips(&image(64, 16, vec![[9; 4]; 1024]), Coding::Linear, 32);
        assert_eq!(size, UVec2::new(32, 8));
        assert_eq!((levels.len(), levels[0].len()), (6, 256));
    }

    #[test]
    fn codes_survive() {
        for code in 0..=255 {
            let texel = [code, code, 255 - code, code];
            for coding in [Coding::Linear, Coding::Srgb] {
                let back = coded(linear(texel, coding), coding);
                let off = |i: usize| back[i].abs_diff(texel[i]);
                assert!((0..4).all(|i| off(i) <= 1), "{texel:?} {back:?}");
            }
        }
    }
}
