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

@group(3) @binding(0) var<uniform> material: Material;
@group(3) @binding(1) var base_color_texture: texture_2d<f32>;
@group(3) @binding(2) var base_color_sampler: sampler;
@group(3) @binding(3) var metallic_roughness_texture: texture_2d<f32>;
@group(3) @binding(4) var metallic_roughness_sampler: sampler;
@group(3) @binding(5) var normal_texture: texture_2d<f32>;
@group(3) @binding(6) var normal_sampler: sampler;
@group(3) @binding(7) var emissive_texture: texture_2d<f32>;
@group(3) @binding(8) var emissive_sampler: sampler;
@group(3) @binding(9) var specular_texture: texture_2d<f32>;
@group(3) @binding(10) var specular_sampler: sampler;
@group(3) @binding(11) var specular_color_texture: texture_2d<f32>;
@group(3) @binding(12) var specular_color_sampler: sampler;
@group(3) @binding(13) var transmission_texture: texture_2d<f32>;
@group(3) @binding(14) var transmission_sampler: sampler;
@group(3) @binding(15) var occlusion_texture: texture_2d<f32>;
@group(3) @binding(16) var occlusion_sampler: sampler;

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

// What a texture holds at a point, white where a material has none. That is the same for all that a draw
// shades, so that textures which are not there cost nothing.
fn sampled(picture: texture_2d<f32>, its_sampler: sampler, map: Map, at: Coordinates) -> vec4f {
    if is_there(map) {
        return textureSample(picture, its_sampler, mapped(map, at));
    }
    return vec4f(1.0);
}

// Linear base colour and opacity.
fn base_color_at(at: Coordinates, color: vec4f) -> vec4f {
    return material.base_color * color
        * sampled(base_color_texture, base_color_sampler, material.base_color_map, at);
}

// Samples every texture that is there: derivatives want that done by all.
fn substance_at(at: Coordinates, base_color: vec4f) -> Substance {
    let metallic_roughness = sampled(
        metallic_roughness_texture, metallic_roughness_sampler, material.metallic_roughness_map, at);
    let specular = sampled(specular_texture, specular_sampler, material.specular_map, at);
    let specular_color = sampled(
        specular_color_texture, specular_color_sampler, material.specular_color_map, at);
    let transmission = sampled(transmission_texture, transmission_sampler, material.transmission_map, at);
    return Substance(
        saturate(base_color.rgb),
        saturate(material.metallic * metallic_roughness.b),
        material.specular_color * specular_color.rgb,
        saturate(material.roughness * metallic_roughness.g),
        saturate(material.transmission * transmission.r),
        material.ior,
        saturate(material.specular * specular.a),
    );
}

fn emission_at(at: Coordinates) -> vec3f {
    return material.emissive * sampled(emissive_texture, emissive_sampler, material.emissive_map, at).rgb;
}

// The share of indirect light that arrives, 1 where there is no map.
fn occlusion_at(at: Coordinates) -> f32 {
    let there = sampled(occlusion_texture, occlusion_sampler, material.occlusion_map, at).r;
    return 1.0 + material.occlusion_strength * (there - 1.0);
}

// The normal map's normal, tangent space; z alone where there is no map.
fn mapped_normal(at: Coordinates) -> vec3f {
    let m = 2.0 * sampled(normal_texture, normal_sampler, material.normal_map, at).rgb - 1.0;
    let scaled = vec3f(m.xy * material.normal_scale, m.z);
    return select(vec3f(0.0, 0.0, 1.0), scaled, is_there(material.normal_map));
}
