// What a material binds.

#import surface/material

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
