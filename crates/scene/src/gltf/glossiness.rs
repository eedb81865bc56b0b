//! Expresses KHR_materials_pbrSpecularGlossiness by the metallic-roughness model. The result is a
//! dielectric with the specular colour as its reflectance at normal incidence, by an index of
//! refraction of 0 as in KHR_materials_ior. Roughness is 1 − glossiness.

use std::sync::Arc;

use glam::{Vec3, Vec4};

use super::json;
use crate::error::Fault;
use crate::limits::Budget;
use crate::material::{Image, Material, TextureRef};

/// Sets a material's factors and textures from the extension, which has precedence over
/// metallic-roughness values. The extension has a diffuse colour, and a specular colour with
/// glossiness in alpha.
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

/// An image of roughness in G, as glTF has it, from glossiness in A.
fn roughness(gloss: &Image, factor: f32) -> Image {
    let rough = |alpha: u8| (255.0 - factor * f32::from(alpha)).round().clamp(0.0, 255.0) as u8;
    let texels = gloss.texels.iter().map(|t| [0, rough(t[3]), 0, 255]).collect();
    Image { name: gloss.name.clone(), width: gloss.width, height: gloss.height, texels }
}
