//! KHR_materials_pbrSpecularGlossiness, by what there is of metalness and roughness: a dielectric whose
//! reflection at normal incidence is a colour (an index of refraction of 0, as KHR_materials_ior has
//! it), and a roughness of one less glossiness.

use std::sync::Arc;

use glam::{Vec3, Vec4};

use super::json;
use crate::error::Fault;
use crate::limits::Budget;
use crate::material::{Image, Material, TextureRef};

/// Makes a material of its factors and textures: of diffuse colour, and of specular colour with
/// glossiness as alpha. The extension goes before the metalness and roughness beside it.
pub(super) fn apply(
    material: &mut Material,
    json: &json::SpecularGlossiness,
    [diffuse, specular]: [Option<TextureRef>; 2],
    budget: &Budget,
) -> Result<(), Fault> {
    material.base_color = Vec4::from(json.diffuse_factor);
    material.base_color_texture = diffuse;
    material.metallic = 0.0;
    material.ior = 0.0;
    material.specular = 1.0;
    material.specular_texture = None;
    material.specular_color = Vec3::from(json.specular_factor);
    material.roughness = 1.0 - json.glossiness_factor;
    material.metallic_roughness_texture = None;
    let varies = |texture: &&TextureRef| texture.image.texels.iter().any(|t| t[3] < 255);
    if let Some(texture) = specular.as_ref().filter(varies) {
        budget.texels(texture.image.width, texture.image.height)?;
        let image = Arc::new(roughness(&texture.image, json.glossiness_factor));
        material.roughness = 1.0;
        material.metallic_roughness_texture = Some(TextureRef { image, ..texture.clone() });
    }
    material.specular_color_texture = specular;
    Ok(())
}

/// Roughness as green, as glTF has it.
fn roughness(gloss: &Image, factor: f32) -> Image {
    let rough = |alpha: u8| (255.0 - factor * f32::from(alpha)).round().clamp(0.0, 255.0) as u8;
    let texels = gloss.texels.iter().map(|t| [0, rough(t[3]), 0, 255]).collect();
    Image { name: gloss.name.clone(), width: gloss.width, height: gloss.height, texels }
}
