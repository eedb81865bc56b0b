//! Sets of texture coordinates that materials read.

use super::json;

/// All textures of a material, the more important ones first.
pub(super) fn textures(m: &json::Material) -> impl Iterator<Item = &json::TextureInfo> {
    let pbr = &m.pbr_metallic_roughness;
    let specular = m.extensions.specular.as_ref();
    let [first, second] = match &m.extensions.glossiness {
        Some(gloss) => [&gloss.diffuse_texture, &gloss.specular_glossiness_texture],
        None => [&pbr.base_color_texture, &pbr.metallic_roughness_texture],
    };
    [
        first.as_ref(),
        second.as_ref(),
        m.normal_texture.as_ref().map(|n| &n.info),
        m.occlusion_texture.as_ref().map(|o| &o.info),
        m.emissive_texture.as_ref(),
        m.extensions.transmission.as_ref().and_then(|t| t.transmission_texture.as_ref()),
        specular.and_then(|s| s.specular_texture.as_ref()),
        specular.and_then(|s| s.specular_color_texture.as_ref()),
    ]
    .into_iter()
    .flatten()
}

/// The two sets of texture coordinates that a material reads: TEXCOORD_0 and 1 unless it asks for a
/// later one.
#[derive(Clone, Copy, Debug)]
pub(super) struct UvSets([usize; 2]);

impl UvSets {
    pub(super) fn of(material: Option<&json::Material>) -> Self {
        let mut sets = Vec::new();
        for info in material.into_iter().flat_map(textures) {
            if !sets.contains(&info.uv_set()) {
                sets.push(info.uv_set());
            }
        }
        if sets.iter().all(|set| *set < 2) {
            return Self([0, 1]);
        }
        // The sets of the most important textures come first.
        sets.truncate(2);
        sets.sort_unstable();
        let first = sets[0];
        Self([first, sets.get(1).copied().unwrap_or(if first == 0 { 1 } else { 0 })])
    }

    /// Numbers of the sets, by their index among a vertex's coordinates.
    pub(super) fn numbers(self) -> [usize; 2] {
        self.0
    }

    /// Index of a set among a vertex's coordinates.
    pub(super) fn place(self, set: usize) -> Option<usize> {
        self.0.iter().position(|here| *here == set)
    }
}
