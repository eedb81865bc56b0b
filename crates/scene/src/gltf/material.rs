//! glTF materials.

use std::collections::BTreeSet;

use glam::{Vec3, Vec4};

use super::texture::{Images, image_of};
use super::uv_sets::{UvSets, textures};
use super::{glossiness, json};
use crate::error::{At, Fault, invalid};
use crate::limits::{self, Budget};
use crate::material::{AlphaMode, Material};

/// Indices of the images that materials show.
pub(super) fn images_used(root: &json::Root) -> Result<Vec<usize>, Fault> {
    let mut used = BTreeSet::new();
    for (index, material) in root.materials.iter().enumerate() {
        for info in textures(material) {
            used.extend(image_of(root, info.index).at(|| describe(index, &material.name))?);
        }
    }
    Ok(used.into_iter().collect())
}

/// The file's materials, followed by glTF's default material.
pub(super) fn read(
    root: &json::Root,
    images: &Images,
    budget: &Budget,
    warnings: &mut Vec<String>,
) -> Result<Vec<Material>, Fault> {
    let mut materials = Vec::with_capacity(root.materials.len() + 1);
    for (index, json) in root.materials.iter().enumerate() {
        let first = warnings.len();
        let place = || describe(index, &json.name);
        materials.push(read_material(root, json, images, budget, warnings).at(place)?);
        warnings[first..].iter_mut().for_each(|w| *w = format!("{}: {w}", place()));
    }
    materials.push(Material { name: "default".into(), ..Material::default() });
    Ok(materials)
}

fn describe(index: usize, name: &str) -> String {
    if name.is_empty() { format!("material {index}") } else { format!("material {index} {name:?}") }
}

fn read_material(
    root: &json::Root,
    json: &json::Material,
    images: &Images,
    budget: &Budget,
    warnings: &mut Vec<String>,
) -> Result<Material, Fault> {
    let pbr = &json.pbr_metallic_roughness;
    let extensions = &json.extensions;
    let sets = UvSets::of(Some(json));
    let mut texture = |info: Option<&json::TextureInfo>| match info {
        Some(info) => images.texture(root, info, sets, warnings),
        None => Ok(None),
    };
    let mut material = Material {
        name: json.name.clone(),
        base_color: Vec4::from(pbr.base_color_factor),
        metallic: pbr.metallic_factor,
        roughness: pbr.roughness_factor,
        normal_texture: texture(json.normal_texture.as_ref().map(|n| &n.info))?,
        normal_scale: json.normal_texture.as_ref().map_or(1.0, |n| n.scale),
        occlusion_texture: texture(json.occlusion_texture.as_ref().map(|o| &o.info))?,
        occlusion_strength: json.occlusion_texture.as_ref().map_or(1.0, |o| o.strength),
        emissive: Vec3::from(json.emissive_factor)
            * extensions.emissive_strength.as_ref().map_or(1.0, |e| e.emissive_strength),
        emissive_texture: texture(json.emissive_texture.as_ref())?,
        alpha_mode: alpha_mode(json)?,
        double_sided: json.double_sided,
        unlit: extensions.unlit.is_some(),
        ior: extensions.ior.as_ref().map_or(1.5, |i| i.ior),
        ..Material::default()
    };
    if let Some(transmission) = &extensions.transmission {
        material.transmission = transmission.transmission_factor;
        material.transmission_texture = texture(transmission.transmission_texture.as_ref())?;
    }
    if let Some(specular) = &extensions.specular {
        material.specular = specular.specular_factor;
        material.specular_texture = texture(specular.specular_texture.as_ref())?;
        material.specular_color = Vec3::from(specular.specular_color_factor);
        material.specular_color_texture = texture(specular.specular_color_texture.as_ref())?;
    }
    if let Some(gloss) = &extensions.glossiness {
        let infos = [&gloss.diffuse_texture, &gloss.specular_glossiness_texture];
        let [diffuse, specular] = infos.map(|info| texture(info.as_ref()));
        glossiness::apply(&mut material, gloss, [diffuse?, specular?], budget)?;
    } else {
        material.base_color_texture = texture(pbr.base_color_texture.as_ref())?;
        let info = pbr.metallic_roughness_texture.as_ref();
        material.metallic_roughness_texture = texture(info)?;
    }
    check(&mut material)?;
    Ok(material)
}

fn alpha_mode(json: &json::Material) -> Result<AlphaMode, Fault> {
    match json.alpha_mode.as_str() {
        "OPAQUE" => Ok(AlphaMode::Opaque),
        "MASK" => Ok(AlphaMode::Mask(json.alpha_cutoff)),
        "BLEND" => Ok(AlphaMode::Blend),
        other => Err(invalid(format!("unknown alphaMode {other:?}"))),
    }
}

/// Refuses values without meaning; clamps shares that are a little out of range.
fn check(m: &mut Material) -> Result<(), Fault> {
    let numbers = [
        m.metallic,
        m.roughness,
        m.normal_scale,
        m.occlusion_strength,
        m.transmission,
        m.ior,
        m.specular,
    ];
    let cutoff = if let AlphaMode::Mask(cutoff) = m.alpha_mode { cutoff } else { 0.0 };
    if !(m.base_color.is_finite()
        && m.specular_color.is_finite()
        && cutoff.is_finite()
        && numbers.iter().all(|n| n.is_finite()))
    {
        return Err(invalid("a factor is not finite"));
    }
    if !(m.emissive.cmpge(Vec3::ZERO).all() && m.emissive.max_element() <= limits::LIGHT) {
        return Err(invalid(format!("its emission is not within 0 and {:e} cd/m²", limits::LIGHT)));
    }
    if m.ior != 0.0 && m.ior < 1.0 {
        return Err(invalid(format!("its index of refraction is {}; 1 or more is needed", m.ior)));
    }
    m.base_color = m.base_color.clamp(Vec4::ZERO, Vec4::ONE);
    m.specular_color = m.specular_color.clamp(Vec3::ZERO, Vec3::splat(limits::EXTENT));
    for share in [
        &mut m.metallic,
        &mut m.roughness,
        &mut m.occlusion_strength,
        &mut m.transmission,
        &mut m.specular,
    ] {
        *share = share.clamp(0.0, 1.0);
    }
    Ok(())
}
