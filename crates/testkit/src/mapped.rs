//! A floor with a normal map, as a file brings it: its tangents are for a loader to find.

use glam::{Mat2, Vec2, Vec3, Vec4};
use lumencast_scene::Scene;
use serde_json::json;

/// The map's one texel: a normal that leans between −x and +y.
const TEXEL: [u8; 3] = [64, 191, 218];
const IMAGE: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR42mNw2H8LAAMcAdqS8h9FAAAAAElFTkSuQmCC";

/// A level floor of 18 × 18 m about the origin that is shaded as its normal map says, Lambert, albedo
/// [`MappedFloor::ALBEDO`]. Its first texture coordinates are x and z, its second the same turned by a
/// quarter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedFloor {
    /// Offset, rotation and scale of KHR_texture_transform.
    pub offset: [f32; 2],
    /// Radians.
    pub rotation: f32,
    /// Its numbers are equal but for their signs.
    pub scale: [f32; 2],
    /// Set of texture coordinates.
    pub tex_coord: usize,
    /// Tangents that the file brings.
    pub tangent: Option<Vec4>,
}

impl MappedFloor {
    /// As it reflects.
    pub const ALBEDO: f32 = 0.6;
    /// Texture coordinates as they are.
    pub const PLAIN: Self =
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: 0, tangent: None };

    /// Floors of every rotation, mirroring and set of texture coordinates, with tangents and without.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let mut floors = Vec::new();
        for rotation in [0.0, 0.5, -2.0] {
            for scale in [[1.0, 1.0], [-3.0, 3.0], [0.5, -0.5], [-1.0, -1.0]] {
                for tex_coord in [0, 1] {
                    for tangent in [None, Some(Vec4::new(0.6, 0.0, 0.8, -1.0))] {
                        let offset = [0.3, -7.0];
                        floors.push(Self { offset, rotation, scale, tex_coord, tangent });
                    }
                }
            }
        }
        floors
    }

    /// Texture coordinates of a set, by x and z.
    fn texture_from_floor(set: usize) -> Mat2 {
        if set == 0 { Mat2::IDENTITY } else { Mat2::from_cols(Vec2::NEG_Y, Vec2::X) }
    }

    /// The normal that it is to be shaded by: glTF 2.0, sections 3.7.2.1 and 3.9.3.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        let (sin, cos) = self.rotation.sin_cos();
        let turn = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
        let stretch = Mat2::from_diagonal(self.scale.into());
        let map_from_floor = turn * stretch * Self::texture_from_floor(self.tex_coord);
        let on_floor = |of_map: Vec2| {
            let at = (map_from_floor.inverse() * of_map).normalize();
            Vec3::new(at.x, 0.0, at.y)
        };
        let (right, up) = match self.tangent {
            None => (on_floor(Vec2::X), on_floor(Vec2::NEG_Y)),
            Some(given) => (given.truncate(), Vec3::Y.cross(given.truncate()) * given.w),
        };
        let map = TEXEL.map(|code| 2.0 * f32::from(code) / 255.0 - 1.0);
        (map[0] * right + map[1] * up + map[2] * Vec3::Y).normalize()
    }

    /// The scene that its file makes; there is no light in it.
    ///
    /// # Panics
    /// Where the loader refuses it.
    #[must_use]
    pub fn scene(&self) -> Scene {
        Scene::from_glb("floor", self.glb()).unwrap_or_else(|error| panic!("{error}"))
    }

    fn glb(&self) -> Vec<u8> {
        let corners = [[-9.0, 9.0], [9.0, 9.0], [9.0, -9.0], [-9.0, -9.0]].map(Vec2::from);
        let mut numbers: Vec<f32> = Vec::new();
        let (mut views, mut accessors) = (Vec::new(), Vec::new());
        let mut add = |kind: &str, values: Vec<f32>, width: usize| {
            let (offset, length) = (4 * numbers.len(), 4 * values.len());
            views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": length }));
            accessors.push(json!({
                "bufferView": accessors.len(), "componentType": 5126, "type": kind,
                "count": values.len() / width,
            }));
            numbers.extend(values);
            accessors.len() - 1
        };
        let position = |i: usize| [corners[i].x, 0.0, corners[i].y];
        let triangles = [0, 1, 2, 0, 2, 3];
        let position = add("VEC3", triangles.into_iter().flat_map(position).collect(), 3);
        let normal = add("VEC3", [Vec3::Y.to_array(); 6].concat(), 3);
        let mut attributes = json!({ "POSITION": position, "NORMAL": normal });
        for set in 0..2 {
            let uv = |i: usize| (Self::texture_from_floor(set) * corners[i]).to_array();
            let uv = add("VEC2", triangles.into_iter().flat_map(uv).collect(), 2);
            attributes[format!("TEXCOORD_{set}")] = uv.into();
        }
        if let Some(tangent) = self.tangent {
            let tangents = add("VEC4", [tangent.to_array(); 6].concat(), 4);
            attributes["TANGENT"] = tangents.into();
        }
        let transform = json!({
            "offset": self.offset, "rotation": self.rotation, "scale": self.scale,
            "texCoord": self.tex_coord,
        });
        let albedo = Self::ALBEDO;
        let file = json!({
            "asset": { "version": "2.0" },
            "extensionsUsed": ["KHR_texture_transform", "KHR_materials_specular"],
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": attributes, "material": 0 }] }],
            "images": [{ "uri": IMAGE }],
            "textures": [{ "source": 0 }],
            "materials": [{
                "pbrMetallicRoughness": {
                    "baseColorFactor": [albedo, albedo, albedo, 1.0], "metallicFactor": 0.0,
                },
                "normalTexture": {
                    "index": 0, "texCoord": 1 - self.tex_coord,
                    "extensions": { "KHR_texture_transform": transform },
                },
                "extensions": { "KHR_materials_specular": { "specularFactor": 0.0 } },
            }],
            "buffers": [{ "byteLength": 4 * numbers.len() }],
            "bufferViews": views,
            "accessors": accessors,
        });
        let binary: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        container(file.to_string().into_bytes(), &binary)
    }
}

/// A .glb of JSON and a binary chunk, four-byte aligned.
pub(crate) fn container(mut json: Vec<u8>, binary: &[u8]) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF".to_vec();
    let length = 12 + 8 + json.len() + 8 + binary.len();
    for word in [2, length as u32, json.len() as u32] {
        glb.extend_from_slice(&word.to_le_bytes());
    }
    glb.extend_from_slice(b"JSON");
    glb.extend_from_slice(&json);
    glb.extend_from_slice(&(binary.len() as u32).to_le_bytes());
    glb.extend_from_slice(b"BIN\0");
    glb.extend_from_slice(binary);
    glb
}
