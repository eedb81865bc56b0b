// glTF's metallic-roughness materials with their textures.

// How a texture is looked up: KHR_texture_transform's rows, and which set of coordinates.
struct Map {
    // a, c, tx; set of coordinates, 0 or 1.
    row0: vec4f,
    // b, d, ty; 1 where there is a texture, else 0.
    row1: vec4f,
}

struct Material {
    base_color: vec4f,
    emissive: vec3f,
    metallic: f32,
    specular_color: vec3f,
    roughness: f32,
    transmission: f32,
    ior: f32,
    specular: f32,
    normal_scale: f32,
    occlusion_strength: f32,
    // Coverage below it is none; 0 where alpha is not a mask.
    cutoff: f32,
    // Bits, see MATERIAL_*.
    flags: u32,
    _pad: u32,
    base_color_map: Map,
    metallic_roughness_map: Map,
    normal_map: Map,
    emissive_map: Map,
    specular_map: Map,
    specular_color_map: Map,
    transmission_map: Map,
    occlusion_map: Map,
}

const MATERIAL_DOUBLE_SIDED: u32 = 1u;
const MATERIAL_UNLIT: u32 = 2u;
const MATERIAL_BLEND: u32 = 4u;
// Every surface an opaque two-sided Lambert one (`MaterialModel::Lambert`).
const MATERIAL_LAMBERT: u32 = 8u;

// Both sets of texture coordinates.
struct Coordinates {
    uv0: vec2f,
    uv1: vec2f,
}

// Whether a material has the texture.
fn is_there(map: Map) -> bool {
    return map.row1.w > 0.5;
}

fn mapped(map: Map, at: Coordinates) -> vec2f {
    let uv = select(at.uv0, at.uv1, map.row0.w > 0.5);
    return vec2f(dot(map.row0.xyz, vec3f(uv, 1.0)), dot(map.row1.xyz, vec3f(uv, 1.0)));
}
