// What a light binds: all its volumes, in one 3D texture, and all pages of lumels, in layers of another.

#import field/volume

struct Fields {
    // Volumes.
    count: u32,
    // Irradiance is what the pages hold times this.
    lumel_scale: f32,
}

@group(2) @binding(0) var<uniform> fields: Fields;
@group(2) @binding(1) var<storage, read> volumes: array<Volume>;
@group(2) @binding(2) var atlas: texture_3d<f32>;
@group(2) @binding(3) var atlas_sampler: sampler;
@group(2) @binding(4) var pages: texture_2d_array<f32>;
