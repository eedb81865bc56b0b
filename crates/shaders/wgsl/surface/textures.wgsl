// What a material is made of at a point. Textures choose their mips by the pixels beside, so that only
// fragments can ask, and all of a draw have to.

#import surface/bindings
#import surface/bsdf
#import surface/material

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

// What surfaces scatter by; every texture that is there is sampled.
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
