//! glTF 2.0 metallic-roughness materials with the extensions that Lumencast reads.

use std::sync::Arc;

use glam::{Affine2, Vec3, Vec4};

/// A metallic-roughness material. Factors multiply their texture where there is one.
///
/// Source: glTF 2.0, section 3.9 and appendix B; KHR_materials_{emissive_strength, unlit,
/// transmission, ior, specular}.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Linear base colour and opacity, each 0 to 1.
    pub base_color: Vec4,
    /// sRGB colour, linear alpha.
    pub base_color_texture: Option<TextureRef>,
    /// 0 (dielectric) to 1 (metal).
    pub metallic: f32,
    /// Perceptual roughness r, 0 to 1; α = r².
    pub roughness: f32,
    /// Roughness in G, metalness in B, linear.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Tangent-space normal map.
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Share of indirect light that arrives, in R, linear. It serves clients that rasterise; a path
    /// tracer finds occlusion by itself.
    pub occlusion_texture: Option<TextureRef>,
    /// Strength of the occlusion map, 0 to 1: the share of indirect light that arrives is 1 +
    /// strength · (R − 1).
    pub occlusion_strength: f32,
    /// Emitted radiance in cd/m²: the file's factor times its strength.
    pub emissive: Vec3,
    /// sRGB colour.
    pub emissive_texture: Option<TextureRef>,
    /// How alpha is used.
    pub alpha_mode: AlphaMode,
    /// When false, the back face blocks light and reflects none.
    pub double_sided: bool,
    /// The base colour is shown as it is. The surface emits no light into the scene and reflects
    /// none.
    pub unlit: bool,
    /// Share of light transmitted instead of diffusely reflected, 0 to 1.
    pub transmission: f32,
    /// Transmission in R.
    pub transmission_texture: Option<TextureRef>,
    /// Index of refraction, 1.5 by default; 0 means infinite (F0 = 1).
    pub ior: f32,
    /// Strength of the dielectric specular reflection, 0 to 1.
    pub specular: f32,
    /// Strength in A.
    pub specular_texture: Option<TextureRef>,
    /// Colour of the dielectric specular reflection at normal incidence (linear, may exceed 1).
    pub specular_color: Vec3,
    /// sRGB colour.
    pub specular_color_texture: Option<TextureRef>,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            transmission: 0.0,
            transmission_texture: None,
            ior: 1.5,
            specular: 1.0,
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
        }
    }
}

/// How alpha is used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Opaque where alpha is at least the cutoff, a hole elsewhere.
    Mask(f32),
    /// Opaque with probability alpha.
    Blend,
}

/// A texture and how a material samples it.
#[derive(Clone, Debug)]
pub struct TextureRef {
    /// The texels.
    pub image: Arc<Image>,
    /// Index into [`Primitive::uv`](crate::Primitive): the set of texture coordinates.
    pub tex_coord: usize,
    /// KHR_texture_transform; the identity by default.
    pub texture_from_mesh: Affine2,
    /// Wrapping of u and v.
    pub wrap: [Wrap; 2],
    /// Magnification filter.
    pub filter: Filter,
}

/// Texture wrapping.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The texture repeats.
    #[default]
    Repeat,
    /// The texture repeats, every other copy mirrored.
    Mirror,
    /// Texels at the edge continue.
    Clamp,
}

/// Filtering of the finest mip level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// Nearest texel.
    Nearest,
    /// Bilinear.
    #[default]
    Linear,
}

/// An 8-bit RGBA image, first row at the top (v = 0). The material's slot determines whether its
/// colours are sRGB or linear.
#[derive(Clone, Debug)]
pub struct Image {
    /// Name or URI, for messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height` texels, row by row.
    pub texels: Vec<[u8; 4]>,
}
